"""A tile of pairs is the same whatever of it earlier results held, under whatever names."""

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.pipeline.config import DistanceConfig
from motionary.pipeline.origins import Block, PairOrigin
from motionary.pipeline.stages.columns import vectors
from motionary.pipeline.stages.compare import compare
from motionary.pipeline.tables import TABLES

CONFIG = DistanceConfig()


def batch(contents: dict[str, int]) -> pa.Table:
    """Clips whose frames follow from a number; equal numbers are twins."""
    tables = [TABLES["resampled"].empty_table()]
    for clip_id, content in contents.items():
        frames = np.random.default_rng(content).normal(size=(3 + content % 4, 5)).astype(np.float32)
        count = np.arange(len(frames), dtype=np.int32)
        columns = {"frame": count, "first_frame": count, "last_frame": count, "feature": vectors(frames)}
        tables.append(
            pa.table({"clip_id": pa.repeat(clip_id, len(frames)), **columns}, schema=TABLES["resampled"])
        )
    return pa.concat_tables(tables)


def rows(made: dict[str, pa.Table]) -> list[tuple]:
    return sorted(tuple(map(str, row.values())) for row in made["pairs"].to_pylist())


CONTENTS = st.lists(st.integers(0, 5), min_size=1, max_size=5)


@settings(max_examples=60, deadline=None)
@given(first=CONTENTS, second=CONTENTS, data=st.data())
def test_what_was_known_changes_nothing(first, second, data):
    one = {f"m{place}": content for place, content in enumerate(first)}
    within = data.draw(st.booleans())
    other = (
        one if within else {f"{'az'[content % 2]}{place}": content for place, content in enumerate(second)}
    )
    whole = compare(batch(one), batch(other), CONFIG)
    far = sorted({*whole["pairs"]["weighted"].to_pylist()}) or [1.0]
    # At a distance that a pair has, or between two, or with all pairs wanted.
    most = data.draw(st.sampled_from([None, 0.0, *far, far[0] / 2 + far[-1] / 2]))

    carried = []
    for number in range(data.draw(st.integers(0, 2))):
        known, others = (
            {name: side[name] for name in data.draw(st.lists(st.sampled_from(sorted(side)), unique=True))}
            for side in (one, other)
        )
        # There, the clips have other names, and the batches stand in another order.
        names = {name: f"{data.draw(st.sampled_from('bxy'))}{number}-{name}" for name in {**known, **others}}
        earlier = compare(
            batch({names[name]: content for name, content in others.items()}),
            batch({names[name]: content for name, content in known.items()}),
            CONFIG,
            most,
        )
        block = Block(
            PairOrigin(True, (0, 1)),
            {name: names[name] for name in known},
            {name: names[name] for name in others},
        )
        carried.append((earlier, block))
    wanted = whole["pairs"].filter(
        pc.less_equal(whole["pairs"]["weighted"], np.inf if most is None else most)
    )
    assert rows(compare(batch(one), batch(other), CONFIG, most, carried)) == rows({"pairs": wanted})
