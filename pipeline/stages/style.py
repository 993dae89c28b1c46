"""Aligned clips -> what each does that its reference does not, and where that lies in the style space."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import pyarrow as pa

from motionary.pipeline.canonical import Convention
from motionary.pipeline.stages.columns import per_clip
from motionary.pipeline.stages.motions import read_motion_rows
from motionary.pipeline.style import Residual, StyleSpace, residuals
from motionary.pipeline.tables import TABLES

VERSION = 2
MAKES = ("styles",)


def style(
    represented: pa.Table,
    ingested: pa.Table,
    aligned: pa.Table,
    styles: pa.Table,
    kept: Mapping[str, str],
    conventions: Sequence[Convention],
    frame_rate: float,
) -> dict[str, pa.Table]:
    """Subtract each cluster's reference from its clips.

    Parameters
    ----------
    represented : pyarrow.Table
        The cluster of every clip of the library, in clip_id order.
    ingested, aligned : pyarrow.Table
        Of the clips that are not `kept`, and maybe more.
    styles : pyarrow.Table
        What this stage made in the earlier run.
    kept : mapping of str to str
        The clips of clusters in which nothing changed, and what they are called there.
    conventions : sequence of Convention
        A user's own joint-name conventions.
    frame_rate : float
        Frames a second of the aligned clips.

    Returns
    -------
    dict of str to pyarrow.Table
        `styles`, in the order of the clips.
    """
    clip_rows = {clip["clip_id"]: clip for clip in ingested.to_pylist()}
    earlier = {row["clip_id"]: row for row in styles.to_pylist()}
    frames = per_clip(aligned)
    members: dict[int, list[str]] = {}
    reference_of: dict[int, str] = {}
    for row in represented.to_pylist():
        members.setdefault(row["cluster_id"], []).append(row["clip_id"])
        if row["is_reference"]:
            reference_of[row["cluster_id"]] = row["clip_id"]

    rows: dict[str, dict] = {}
    for cluster_id, clip_ids in members.items():
        if clip_ids[0] in kept:
            place = {"cluster_id": cluster_id, "reference_id": reference_of[cluster_id]}
            rows |= {one: earlier[kept[one]] | {"clip_id": one} | place for one in clip_ids}
            continue
        in_order = sorted(clip_ids, key=lambda one: clip_rows[one]["digest"])  # names decide nothing
        motions = {one: read_motion_rows(clip_rows[one], frames[one], frame_rate) for one in in_order}
        reference_id = reference_of[cluster_id]
        found = residuals([*motions.values()], motions[reference_id], conventions=conventions)
        space = StyleSpace.fit([one.vector() for one in found])
        for clip_id, one, scores in zip(in_order, found, space.scores, strict=True):
            place = {"clip_id": clip_id, "cluster_id": cluster_id, "reference_id": reference_id}
            explained = space.explained_variance_ratio.tolist()
            rows[clip_id] = place | _energies(one) | {"scores": scores.tolist(), "explained": explained}
    every = [rows[clip_id] for clip_id in represented["clip_id"].to_pylist()]
    return {"styles": pa.Table.from_pylist(every, schema=TABLES["styles"])}


def _energies(residual: Residual) -> dict:
    by_region = residual.region_energy
    return {
        "kind": residual.kind,
        "energy": sum(by_region.values()),
        **{f"energy_{region}": energy for region, energy in by_region.items()},
        "joints": list(residual.names),
        "joint_energy": list(residual.joint_energy.values()),
        "travel_energy": list(residual.root_energy.values()),
    }
