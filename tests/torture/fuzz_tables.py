"""Damaged tables: the labels file, the configuration, and the files of a catalog."""

from __future__ import annotations

import os
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from random import Random

from motionary.catalog import Catalog, CatalogError
from motionary.catalog.query import CatalogTable
from motionary.catalog.schema import PUBLISHED
from motionary.catalog.verify import verify
from motionary.pipeline.readers import scan_library
from motionary.workflows.errors import UserError
from motionary.workflows.labels_file import supplied_labels
from motionary.workflows.settings import load_settings
from tests.torture.fuzz import Fault, Kind, Outcome
from tests.torture.mutation import damaged, mutated
from tests.torture.world import embedded_library, motionary, run_arguments, take_clips

CLIPS = 6
ACTION = "action"
LARGE = 80
"""One case of so many is large on purpose."""

TOML = """\
[read]
unit = 0.01
up = "y"

[features]
epsilon = 0.1            # how little a pose must change
kind = "pose+travel"
travel_time = 0.1

[distances]
thresholds = "random"
tile = 16

[clusters]
primary = "ward"
label_column = "action"

[alignment]
weights = "legs"

[conventions.our-rig]
pelvis = "hip_ctrl"
spine = "spine_a"
"""
_LARGE_TOML = (
    lambda: "[" * 100_000,
    lambda: "a = " + "[" * 100_000,
    lambda: "a = " + "{a=" * 100_000,
    lambda: ".".join("a" * 100_000) + " = 1",
    lambda: f"[{'.'.join('a' * 100_000)}]",
    lambda: "[features]\nepsilon = " + "1" * 1_000_000,
    lambda: "[clusters]\nn_clusters = 0x" + "f" * 1_000_000,
    lambda: TOML.replace("[read]", "".join(f"[conventions.r{i}]\n" for i in range(20_000)) + "[read]"),
    lambda: "\n" * 1_000_000,
)
_LARGE_CSV = (
    lambda: "path,action\n" + '"' + "x" * 3_000_000,
    lambda: "," * 100_000,
    lambda: ",".join(["path", "action"] * 10_000) + "\n1,2",
    lambda: "path,action\n" + "a/b.bvh,walk\n" * 100_000,
    lambda: "path,action\n" + "\n" * 1_000_000,
    lambda: "path,action\n" + "../" * 300_000 + "x.bvh,walk",
    lambda: "path,action\n" + "x" * 3_000_000 + ",walk",
)


def _small_library(shared: Path) -> None:
    take_clips(embedded_library(shared.parent / "embedded"), shared / "library", CLIPS)


def _small_catalog(shared: Path) -> None:
    _small_library(shared)
    if not (shared / "catalog" / "CURRENT").exists():
        done = motionary(*run_arguments(shared / "library", shared / "catalog"))
        if done.returncode:
            raise RuntimeError(f"no catalog to damage: {done.stderr}")


def _labels(rng: Random, number: int, shared: Path) -> Mapping[str, bytes]:
    if number % LARGE == LARGE // 2:
        return {"labels.csv": _LARGE_CSV[number // LARGE % len(_LARGE_CSV)]().encode()}
    return {"labels.csv": mutated(_valid_labels(shared), rng)}


@cache
def _valid_labels(shared: Path) -> str:
    library = shared / "library"
    clips = {str(path.relative_to(library)) for path in library.rglob("*.bvh")}
    header, *rows = (library / "labels.csv").read_text().splitlines()
    inside = [f"../library/{row}" for row in rows if row.split(",")[0] in clips]
    return "\n".join([header, *inside, "elsewhere.bvh,walk,proud,x,1,", ""])


def _check_labels(shared: Path, folder: Path) -> Outcome:
    file = folder / "labels.csv"
    sources = _sources(shared)
    try:
        labels = supplied_labels(file, None, sources, ACTION)
    except UserError as error:
        return _refusal(error, file)
    table = labels.table
    known = {source.clip_id for source in sources}
    clip_ids = table["clip_id"].to_pylist()
    if not set(clip_ids) <= known or len(set(clip_ids)) < len(clip_ids) or ACTION not in table.column_names:
        raise Fault(f"labels of clips {clip_ids} in columns {table.column_names}")
    return "read"


@cache
def _sources(shared: Path) -> list:
    return scan_library(shared / "library")


def _toml(rng: Random, number: int, shared: Path) -> Mapping[str, bytes]:
    if number % LARGE == LARGE // 2:
        return {"x.toml": _LARGE_TOML[number // LARGE % len(_LARGE_TOML)]().encode()}
    return {"x.toml": mutated(rng.choice((TOML, TOML.split("[conventions", maxsplit=1)[0])), rng)}


def _check_toml(shared: Path, folder: Path) -> Outcome:
    file = folder / "x.toml"
    try:
        load_settings(file, {})
    except UserError as error:
        return _refusal(error, file)
    return "read"


def _refusal(error: Exception, file: Path) -> Outcome:
    """Raise `Fault` unless a refusal names its file and is short enough to be read."""
    text = str(error)
    if str(file) not in text or len(text) > len(str(file)) + 3000:
        raise Fault(f"a refusal does not name its file, or goes on and on: {text[:2000]!r}")
    return "refused"


def _catalog(rng: Random, number: int, shared: Path) -> Mapping[str, bytes]:
    """Damage `CURRENT`, the manifest or one part."""
    catalog = shared / "catalog"
    manifests, parts = (sorted(catalog.glob(one)) for one in ("snapshots/*.json", "tables/*/*.parquet"))
    path = rng.choice((catalog / "CURRENT", rng.choice(manifests), *(rng.choice(parts) for _ in range(4))))
    content = path.read_bytes()
    changed = damaged(content, rng) if path.suffix == ".parquet" else mutated(content.decode(), rng)
    return {f"catalog/{path.relative_to(catalog)}": changed}


def _check_catalog(shared: Path, folder: Path) -> Outcome:
    """Open the catalog whose one file is damaged, and ask it for what that file holds."""
    catalog, whole = folder / "catalog", shared / "catalog"
    (changed,) = (path.relative_to(catalog) for path in catalog.rglob("*") if path.is_file())
    for path in whole.rglob("*"):
        here = catalog / path.relative_to(whole)
        if path.is_file() and not here.exists():
            here.parent.mkdir(parents=True, exist_ok=True)
            os.link(path, here)
    table = changed.parts[1] if changed.suffix == ".parquet" else "clips"
    try:
        opened = Catalog.open(str(catalog))
        if table in PUBLISHED:
            opened.sql(f'select * from "{table}"')
            CatalogTable(table, opened.store, opened.files(table)).to_arrow()
        for clip in opened.clips.to_arrow()["clip_id"].to_pylist()[:1]:
            opened.motion(clip)
            opened.aligned(clip)
    except CatalogError as error:
        if str(catalog) not in str(error):
            raise Fault(f"a refusal does not name the catalog or its file: {str(error)[:2000]!r}") from None
        return "refused"
    silent = (
        table in PUBLISHED and (folder / "catalog" / changed).read_bytes() != (whole / changed).read_bytes()
    )
    if changed.suffix == ".parquet" and silent and all(check.passed for check in verify(str(catalog))):
        raise Fault("a damaged part is read, and verify does not find it")
    return "read"


LABELS = Kind("labels", 0.14, _small_library, _labels, _check_labels)
SETTINGS = Kind("toml", 0.12, lambda shared: None, _toml, _check_toml)
CATALOG = Kind("catalog", 0.14, _small_catalog, _catalog, _check_catalog)
