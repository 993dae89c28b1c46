"""`reproduce mutual`: its figures are those of the product and of counting, clip by clip."""

import json

import numpy as np
import pytest
from scipy.spatial.distance import squareform

from motionary.catalog import Catalog
from motionary.pipeline.stages.columns import condensed, condensed_places


@pytest.fixture
def catalog(demo_catalog):
    with Catalog.open(demo_catalog) as opened:
        yield opened


def counted_nearest(distances, place):
    """Return the clip that most others are further from, and further from it too."""
    clips = range(len(distances))

    def key(other):
        d = distances[place, other]
        further = sum(distances[place, one] > d and distances[other, one] > d for one in clips)
        return -further, d, other

    return min((other for other in clips if other != place), key=key)


def test_figures_are_those_of_asking_every_clip(motionary, catalog, demo_catalog):
    code, out, _ = motionary("reproduce", "mutual", demo_catalog, "--format", "json")
    assert code == 0
    rows = {(row["distance"], row["ranked_by"]): row["nearest_neighbour"] for row in json.loads(out)}
    clips = catalog.clips.to_pandas().set_index("clip_id")["action"]
    shares = {"distance": "distance", "mutual": "independent, gamma"}
    for rank, form in shares.items():
        nearest = [catalog.similar(one, 1, rank=rank).table["clip_id"][0].as_py() for one in clips.index]
        share = np.mean(clips[nearest].to_numpy() == clips.to_numpy())
        assert rows["weighted", form] == pytest.approx(share)
    pairs = catalog.pairs.to_arrow()
    places = condensed_places(pairs, catalog.clips.to_arrow()["clip_id"])
    distances = squareform(condensed(pairs, "dtw", places))
    nearest = [counted_nearest(distances, place) for place in range(len(clips))]
    share = np.mean(clips.to_numpy()[nearest] == clips.to_numpy())
    assert rows["dtw", "counted"] == pytest.approx(share)


def test_the_table_names_every_way_of_ranking(motionary, demo_catalog):
    code, out, _ = motionary("reproduce", "mutual", demo_catalog)
    assert code == 0
    assert out.count("independent, gamma") == 3
    assert "clips of 8 classes" in out
