"""Styles part by part: against a plain computation, for any room and any division into parts."""

from dataclasses import replace

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pytest

from motionary.catalog import Catalog
from motionary.pipeline.motion import Motion
from motionary.pipeline.parts import Parts
from motionary.pipeline.stages.motions import motion_rows, skeleton_record
from motionary.pipeline.stages.style import style
from motionary.pipeline.style import REGIONS, StyleSpace, residuals
from motionary.pipeline.tables import TABLES

LARGE = 2**40
RATE = 30.0


@pytest.fixture(scope="module")
def motions(demo_catalog) -> dict[str, Motion]:
    """Return aligned clips of three of the demo's clusters, each cluster's of one rig."""
    catalog = Catalog.open(demo_catalog)
    largest = catalog.sql(
        "select cluster_id from clusters group by 1 having count(*) >= 4 order by count(*) desc, 1 limit 3"
    )["cluster_id"].to_pylist()
    found = {}
    for cluster_id in largest:
        rows = catalog.sql(
            "select clip_id from clusters where cluster_id = ? order by is_reference desc, clip_id",
            [cluster_id],
        )
        clips = {clip_id: catalog.aligned(clip_id) for clip_id in rows["clip_id"].to_pylist()}
        rig = next(iter(clips.values())).skeleton.names
        alike = [clip_id for clip_id, motion in clips.items() if motion.skeleton.names == rig]
        found |= {clip_id: clips[clip_id] for clip_id in alike[:7]}
    return {clip_id: replace(motion, name=clip_id, fps=RATE) for clip_id, motion in found.items()}


@pytest.fixture(scope="module")
def library(motions, demo_catalog):
    """Return the tables of those clips; markers' and another rig's are in the second and third clusters."""
    catalog = Catalog.open(demo_catalog)
    own = pc.is_in(catalog.clusters.to_arrow()["clip_id"], pa.array([*motions]))
    represented = catalog.clusters.to_arrow().filter(own).sort_by("clip_id")
    represented = represented.select(TABLES["represented"].names).cast(TABLES["represented"])
    of_cluster = {}
    for row in represented.to_pylist():
        if not row["is_reference"]:
            of_cluster.setdefault(row["cluster_id"], []).append(row["clip_id"])
    _, (markers, *_), (other_rig, *_) = of_cluster.values()
    clips = catalog.clips.to_arrow().select(TABLES["ingested"].names).to_pylist()
    clips = {clip["clip_id"]: clip for clip in clips}
    shown = dict(motions)
    shown[markers] = _as_markers(motions[markers])
    shown[other_rig] = _with_one_joint_more(motions[other_rig])
    for clip_id in (markers, other_rig):
        clips[clip_id]["skeleton"] = skeleton_record(shown[clip_id].skeleton)
    return {
        "motions": shown,
        "represented": represented,
        "ingested": [pa.Table.from_pylist([clips[one]], schema=TABLES["ingested"]) for one in shown],
        "aligned": [motion_rows(one, motion) for one, motion in shown.items()],
        "digests": {one: clips[one]["digest"] for one in shown},
    }


def _as_markers(motion):
    places = motion.positions() - motion.positions()[:, :1]
    return replace(motion, rotations=np.empty((motion.frames, 0, 4)), places=places)


def _with_one_joint_more(motion):
    skeleton = motion.skeleton
    more = replace(
        skeleton,
        names=(*skeleton.names, "hat"),
        parents=(*skeleton.parents, 0),
        offsets=np.vstack([skeleton.offsets, [0, 1, 0]]),
    )
    still = np.tile([0.0, 0, 0, 1], (motion.frames, 1, 1))
    return replace(motion, skeleton=more, rotations=np.concatenate([motion.rotations, still], axis=1))


def made(library, ingested=None, aligned=None, earlier=None, kept=None, room=LARGE):
    table = style(
        library["represented"], TABLES["styles"].empty_table() if earlier is None else earlier,
        ingested or Parts.of(*library["ingested"]), aligned or Parts.of(*library["aligned"]), kept or {},
        (), RATE, room,
    )["styles"]  # fmt: skip
    return table.combine_chunks()


def clusters_of(library):
    members, references = {}, {}
    for row in library["represented"].to_pylist():
        members.setdefault(row["cluster_id"], []).append(row["clip_id"])
        if row["is_reference"]:
            references[row["cluster_id"]] = row["clip_id"]
    return members, references


def as_stored(motion):
    """A motion as float32, which is what tables hold."""
    places = None if motion.places is None else motion.places.astype(np.float32)
    return replace(
        motion,
        root_position=motion.root_position.astype(np.float32),
        rotations=motion.rotations.astype(np.float32),
        places=places,
    )


def test_styles_are_those_of_the_clusters_one_by_one(library):
    table = made(library)
    rows = {row["clip_id"]: row for row in table.to_pylist()}
    assert [*rows] == library["represented"]["clip_id"].to_pylist()
    members, references = clusters_of(library)
    kinds = set()
    for cluster_id, ids in members.items():
        in_order = sorted(ids, key=library["digests"].get)
        clips = [as_stored(library["motions"][one]) for one in in_order]
        found = residuals(clips, clips[in_order.index(references[cluster_id])])
        space = StyleSpace.fit([one.vector() for one in found])
        kinds.add(found[0].kind)
        for clip_id, residual, scores in zip(in_order, found, space.scores, strict=True):
            row = rows[clip_id]
            assert (row["cluster_id"], row["reference_id"]) == (cluster_id, references[cluster_id])
            assert (row["kind"], row["joints"]) == (residual.kind, [*residual.names])
            by_region = [row[f"energy_{region}"] for region in REGIONS]
            assert by_region == [*residual.region_energy.values()]
            assert row["energy"] == sum(by_region)
            for column, expected in [
                ("scores", scores),
                ("explained", space.explained_variance_ratio),
                ("joint_energy", [*residual.joint_energy.values()]),
                ("travel_energy", [*residual.root_energy.values()]),
            ]:
                np.testing.assert_array_equal(np.float32(row[column]), np.float32(expected))
    assert kinds == {"rotations", "pose"}


@pytest.mark.parametrize("room", [0, 150_000, LARGE])
@pytest.mark.parametrize("seed", [0, 1])
def test_neither_room_nor_parts_change_a_bit(library, room, seed):
    generator = np.random.default_rng(seed)

    def divided(tables):
        order = generator.permutation(len(tables))
        borders = [0, *sorted(generator.integers(0, len(tables), 4).tolist()), len(tables)]
        empty = tables[0].slice(0, 0)
        return Parts.of(
            *(
                pa.concat_tables([empty, *(tables[i] for i in order[start:end])])
                for start, end in zip(borders, borders[1:], strict=False)
            )
        )

    parts = divided(library["ingested"]), divided(library["aligned"])
    assert made(library, *parts, room=room) == made(library)


def test_frames_are_read_twice_a_group_of_clusters(library):
    def reads(room):
        loads = []

        def load(key, columns):
            loads.append("rotations" in columns)
            return pa.concat_tables(library["aligned"]).select(columns)

        made(library, aligned=Parts(load, ["all"]), room=room)
        return sum(loads)

    clusters = len(clusters_of(library)[0])
    assert reads(0) == 2 * clusters
    assert reads(LARGE) == 2


def test_kept_clips_keep_their_rows_under_their_names(library):
    before = made(library)
    members, references = clusters_of(library)
    first, *others = members
    assert made(library, earlier=before, kept={one: one for one in members[first]}) == before
    everything = {one: one for ids in members.values() for one in ids}
    assert made(library, Parts.of(), Parts.of(), before, everything) == before
    # What was called x then is called by its own name now, in a cluster of another number.
    column = before["clip_id"].to_pylist()
    old = before.set_column(0, before.schema.field(0), [[f"x/{one}" for one in column]])
    old = old.set_column(1, before.schema.field(1), pa.array([77] * len(old), pa.int32()))
    old = old.set_column(2, before.schema.field(2), [["x/reference"] * len(old)])
    rest = [one for other in others for one in members[other]]
    own = [i for i, one in enumerate(library["motions"]) if one in rest]
    parts = (Parts.of(*(library[name][i] for i in own)) for name in ("ingested", "aligned"))
    assert made(library, *parts, old, {one: f"x/{one}" for one in members[first]}) == before


def test_no_clip_at_all():
    none = {name: schema.empty_table() for name, schema in TABLES.items()}
    table = style(none["represented"], none["styles"], Parts.of(), Parts.of(), {}, (), RATE, LARGE)["styles"]
    assert len(table) == 0
    assert table.schema == TABLES["styles"]
