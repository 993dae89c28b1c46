"""Aligned clips -> what each does that its reference does not, and where that lies in the style space.

Nothing holds the whole library: a clip is read, subtracted from and forgotten. Clusters are worked on in
groups, as many as there is room for and at least one; a group's frames are read twice, first for the
references. With J joints, 19 at least, and references of m frames this takes, in bytes:

- of every clip that is subtracted from 900 + 24 J, its name and skeleton; its row of `styles`, which is the
  result, 200 + 20 J
- of every clip of a group 384 J + 512, its residual averaged over 16 stretches; of the one cluster that is
  analysed five times that besides
- of every reference of a group 32 J + 24 a frame

and beside the parts that are being read 200 J a frame, for the clips of one part.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pyarrow as pa

from motionary.pipeline.canonical import CANONICAL_JOINTS, Convention
from motionary.pipeline.motion import FloatArray, Motion
from motionary.pipeline.parts import Parts
from motionary.pipeline.stages.columns import per_clip
from motionary.pipeline.stages.groups import groups_within
from motionary.pipeline.stages.motions import read_motion_rows
from motionary.pipeline.style import Residual, StyleSpace, residuals
from motionary.pipeline.style.residual import ResidualKind
from motionary.pipeline.tables import TABLES

VERSION = 2
MAKES = ("styles",)

_CLIP_COLUMNS = ["clip_id", "path", "digest", "unit", "skeleton", "notes"]
_FRAME_COLUMNS = ["clip_id", "root_position", "rotations"]
_STRETCHES = 16
_ANALYSIS = 5  # times the vectors: them centred and squared, their singular vectors, and the solver's own


@dataclass(frozen=True, eq=False)
class _Cluster:
    """A cluster whose clips are subtracted from.

    Parameters
    ----------
    cluster_id : int
    reference_id : str
    clip_ids : sequence of str
        In the order of their contents: names decide nothing.
    joints, frames : int
        Of the reference.
    """

    cluster_id: int
    reference_id: str
    clip_ids: Sequence[str]
    joints: int
    frames: int

    @property
    def held(self) -> int:
        """Bytes of its vectors and its reference."""
        return self.vectors + self.frames * (32 * self.joints + 24)

    @property
    def work(self) -> int:
        """Bytes that its analysis takes beside them."""
        return _ANALYSIS * self.vectors

    @property
    def vectors(self) -> int:
        """Bytes of its clips' averaged residuals."""
        values = 3 * max(self.joints, len(CANONICAL_JOINTS)) + 4
        return len(self.clip_ids) * _STRETCHES * values * 8


def style(
    represented: pa.Table,
    styles: pa.Table,
    ingested: Parts,
    aligned: Parts,
    kept: Mapping[str, str],
    conventions: Sequence[Convention],
    frame_rate: float,
    room: int,
) -> dict[str, pa.Table]:
    """Subtract each cluster's reference from its clips.

    Parameters
    ----------
    represented : pyarrow.Table
        The cluster of every clip of the library, in clip_id order.
    styles : pyarrow.Table
        What this stage made in the earlier run.
    ingested, aligned : Parts
        Of the clips that are not `kept`, and maybe more; all frames of a clip in one part.
    kept : mapping of str to str
        The clips of clusters in which nothing changed, and what they are called there.
    conventions : sequence of Convention
        A user's own joint-name conventions.
    frame_rate : float
        Frames a second of the aligned clips.
    room : int
        Bytes that a group of clusters may take, see above; no bit of the result depends on it.

    Returns
    -------
    dict of str to pyarrow.Table
        `styles`, in the order of the clips.
    """
    clip_ids, cluster_ids = (represented[one].to_pylist() for one in ("clip_id", "cluster_id"))
    references = represented.filter(represented["is_reference"])
    reference_of = dict(
        zip(references["cluster_id"].to_pylist(), references["clip_id"].to_pylist(), strict=True)
    )
    made = [_kept_rows(styles, kept, dict(zip(clip_ids, cluster_ids, strict=True)), reference_of)]
    clips = _clip_rows(ingested, {clip_id for clip_id in clip_ids if clip_id not in kept})
    members: dict[int, list[str]] = {}
    for clip_id, cluster_id in zip(clip_ids, cluster_ids, strict=True):
        if clip_id in clips:
            members.setdefault(cluster_id, []).append(clip_id)
    for group in groups_within(_clusters(members, reference_of, clips, aligned), room):
        made += _subtracted(group, clips, aligned, conventions, frame_rate)
    every = pa.concat_tables(made)
    place = {clip_id: i for i, clip_id in enumerate(every["clip_id"].to_pylist())}
    return {"styles": every.take(np.array([place[clip_id] for clip_id in clip_ids], dtype=np.int64))}


def _kept_rows(
    styles: pa.Table, kept: Mapping[str, str], cluster_of: Mapping[str, int], reference_of: Mapping[int, str]
) -> pa.Table:
    """Take over the rows of clusters in which nothing changed, under what things are called now."""
    place = {clip_id: i for i, clip_id in enumerate(styles["clip_id"].to_pylist())}
    here = [clip_id for clip_id in kept if clip_id in cluster_of]
    rows = styles.take(np.array([place[kept[clip_id]] for clip_id in here], dtype=np.int64))
    cluster_ids = [cluster_of[clip_id] for clip_id in here]
    now = {
        "clip_id": here,
        "cluster_id": cluster_ids,
        "reference_id": [reference_of[one] for one in cluster_ids],
    }
    columns = {name: now.get(name, rows[name]) for name in TABLES["styles"].names}
    return pa.table(columns, schema=TABLES["styles"])


def _clip_rows(ingested: Parts, wanted: set[str]) -> dict[str, dict]:
    """Read the rows of clips; those of one rig share the names of its joints."""
    clips: dict[str, dict] = {}
    rigs: dict[tuple, tuple] = {}
    for part in ingested.read(_CLIP_COLUMNS):
        for row in part.to_pylist():
            if row["clip_id"] in wanted:
                record = row["skeleton"]
                rig = tuple(record["joints"]), tuple(record["parents"])
                names, parents = rigs.setdefault(rig, rig)
                offsets = np.array(record["offsets"])
                row["skeleton"] = {"joints": names, "parents": parents, "offsets": offsets}
                clips[row["clip_id"]] = row
    return clips


def _clusters(
    members: Mapping[int, Sequence[str]],
    reference_of: Mapping[int, str],
    clips: Mapping[str, dict],
    aligned: Parts,
) -> list[_Cluster]:
    frames: dict[str, int] = {}
    for part in aligned.read(["clip_id"]):
        frames |= {clip_id: len(rows) for clip_id, rows in per_clip(part).items()}
    return [
        _Cluster(
            cluster_id,
            reference_of[cluster_id],
            sorted(clip_ids, key=lambda one: clips[one]["digest"]),
            len(clips[reference_of[cluster_id]]["skeleton"]["joints"]),
            frames[reference_of[cluster_id]],
        )
        for cluster_id, clip_ids in members.items()
    ]


def _subtracted(
    group: Sequence[_Cluster],
    clips: Mapping[str, dict],
    aligned: Parts,
    conventions: Sequence[Convention],
    frame_rate: float,
) -> list[pa.Table]:
    """Subtract the references of some clusters from their clips; `styles` of these, cluster by cluster."""
    cluster_of = {clip_id: one for one in group for clip_id in one.clip_ids}
    row_of = {clip_id: i for one in group for i, clip_id in enumerate(one.clip_ids)}
    references, kinds = _references(cluster_of, clips, aligned, frame_rate)
    vectors: dict[int, FloatArray] = {}
    energies: dict[int, list[pa.Table]] = {one.cluster_id: [] for one in group}
    for part in aligned.read(_FRAME_COLUMNS):
        for cluster, motions in _by_cluster(part, cluster_of, clips, frame_rate):
            one = cluster.cluster_id
            found = residuals(motions, references[one], kinds[one], conventions)
            for motion, residual in zip(motions, found, strict=True):
                vector = residual.vector(_STRETCHES)
                if one not in vectors:
                    vectors[one] = np.empty((len(cluster.clip_ids), len(vector)))
                vectors[one][row_of[motion.name]] = vector
            energies[one].append(_energies(cluster, motions, found))
    return [_with_scores(cluster, energies[cluster.cluster_id], vectors.pop(cluster.cluster_id), row_of)
            for cluster in group]  # fmt: skip


def _references(
    cluster_of: Mapping[str, _Cluster], clips: Mapping[str, dict], aligned: Parts, frame_rate: float
) -> tuple[dict[int, Motion], dict[int, ResidualKind]]:
    """Read the references of clusters, and find how their clips compare; see `residuals`."""
    references: dict[int, Motion] = {}
    kinds: dict[int, ResidualKind] = {one.cluster_id: "rotations" for one in cluster_of.values()}
    for part in aligned.read(_FRAME_COLUMNS):
        for clip_id, rows in per_clip(part).items():
            if clip_id not in cluster_of:
                continue
            cluster = cluster_of[clip_id]
            rig, other = (clips[one]["skeleton"] for one in (clip_id, cluster.reference_id))
            of_markers = len(rows["rotations"][0]) == 3 * len(rig["joints"])
            if of_markers or any(rig[one] != other[one] for one in ("joints", "parents")):
                kinds[cluster.cluster_id] = "pose"
            if clip_id == cluster.reference_id:
                references[cluster.cluster_id] = read_motion_rows(clips[clip_id], rows, frame_rate)
    return references, kinds


def _by_cluster(
    part: pa.Table, cluster_of: Mapping[str, _Cluster], clips: Mapping[str, dict], frame_rate: float
) -> Iterator[tuple[_Cluster, list[Motion]]]:
    """Read the motions of a part, cluster by cluster."""
    rows = {clip_id: rows for clip_id, rows in per_clip(part).items() if clip_id in cluster_of}
    there = {cluster_of[clip_id].cluster_id: cluster_of[clip_id] for clip_id in rows}
    for cluster in there.values():
        ids = [clip_id for clip_id in rows if cluster_of[clip_id] is cluster]
        yield cluster, [read_motion_rows(clips[one], rows[one], frame_rate) for one in ids]


def _energies(cluster: _Cluster, motions: Sequence[Motion], found: Sequence[Residual]) -> pa.Table:
    rows = [
        {
            "clip_id": motion.name,
            "cluster_id": cluster.cluster_id,
            "reference_id": cluster.reference_id,
            "kind": residual.kind,
            "energy": sum(residual.region_energy.values()),
            **{f"energy_{region}": energy for region, energy in residual.region_energy.items()},
            "joints": list(residual.names),
            "joint_energy": list(residual.joint_energy.values()),
            "travel_energy": list(residual.root_energy.values()),
        }
        for motion, residual in zip(motions, found, strict=True)
    ]
    return pa.Table.from_pylist(rows, schema=_WITHOUT_SCORES)


_WITHOUT_SCORES = pa.schema([one for one in TABLES["styles"] if one.name not in ("scores", "explained")])


def _with_scores(
    cluster: _Cluster, energies: Sequence[pa.Table], vectors: FloatArray, row_of: Mapping[str, int]
) -> pa.Table:
    """Analyse a cluster, and give its clips' rows what that finds."""
    space = StyleSpace.fit(vectors)
    rows = pa.concat_tables(energies)
    places = [row_of[clip_id] for clip_id in rows["clip_id"].to_pylist()]
    found = {
        "scores": space.scores[places].tolist(),
        "explained": [space.explained_variance_ratio.tolist()] * len(rows),
    }
    columns = {name: found[name] if name in found else rows[name] for name in TABLES["styles"].names}
    return pa.table(columns, schema=TABLES["styles"])
