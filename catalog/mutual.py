"""Mutual proximity: how likely each of two clips would find the other near, of all the clips it might meet.

    P(x, y) = P(D_x > d(x, y)) P(D_y > d(x, y))

(Schnitzer, Flexer, Schedl and Widmer, *Local and global scaling reduce hubs in space*, JMLR 13, 2012, with
the two taken as independent). D_x is the distance of x to any clip, by a gamma distribution of the same mean
and variance. P is large where each is among the other's nearest. So a clip that is near to everything, being
still for example, is nobody's neighbour, and clips of libraries of different energy are ranked alike.

The rivals, by how often the nearest other clip of 270 from five sources mixed shows the same action, by the
weighted distance: the distance itself .870; this form with a normal distribution .867, with the gamma one
.885; the share of clips that are further from both, counted, .896. The last needs all distances of both
clips, and so for one question the whole of table `pairs`; this one two numbers a clip.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray
from scipy.special import gammaincc

from motionary.catalog.own_pairs import (
    pairs_with_side,
    refuse_without_all_pairs,
    side_count,
    side_of,
    sides_to_read,
)
from motionary.catalog.query import Catalog
from motionary.catalog.ranked_distance import RankedDistance

_PAIRS = 5_000_000


@dataclass(frozen=True, eq=False)
class UsualDistances:
    """What distances clips have to others.

    Parameters
    ----------
    others : array (M,) of int
        Those others, by their place in clip_id order.
    mean, variance : array (N,)
        Of every clip's distances to them, without itself.
    """

    others: NDArray[np.int64]
    mean: NDArray[np.float64]
    variance: NDArray[np.float64]


def usual_distances(catalog: Catalog, clip_ids: pa.Array, distance: RankedDistance) -> UsualDistances:
    """Read what distances every clip has to the clips of some sides of tiles, kept while the catalog is open.

    Parameters
    ----------
    catalog : Catalog
    clip_ids : array (N,)
        All clips, in order.
    distance : RankedDistance

    Returns
    -------
    UsualDistances
        To all clips, or to those of some sides evenly spread, five million distances: of 10,000 clips, to
        some 500.

    Raises
    ------
    CatalogError
        The run did not compare all pairs; or a file is damaged.
    """
    refuse_without_all_pairs(catalog, "mutual proximity")
    return catalog.keep(f"usual distances {distance}", lambda: _read(catalog, clip_ids, distance))


def mutual_proximity(
    places: NDArray[np.int64], distances: NDArray[np.floating], usual: UsualDistances
) -> NDArray[np.float64]:
    """Mutual proximity of one clip to others (M,), 0 to 1.

    Parameters
    ----------
    places : array (M,)
        Those others, by their place in clip_id order.
    distances : array (M,)
        Its distances to them.
    usual : UsualDistances
    """
    own = distances[np.isin(places, usual.others)].astype(np.float64)
    mean, variance = (own.mean(), own.var()) if len(own) else (0.0, 0.0)
    near_to_it = _further(distances, np.float64(mean), np.float64(variance))
    return near_to_it * _further(distances, usual.mean[places], usual.variance[places])


def _further(
    distance: NDArray[np.floating],
    mean: NDArray[np.float64] | np.float64,
    variance: NDArray[np.float64] | np.float64,
) -> NDArray[np.float64]:
    """How likely a clip of these distances is further away than that; without spread, 1 up to their mean."""
    with np.errstate(divide="ignore", invalid="ignore"):
        spread = gammaincc(mean**2 / variance, distance * mean / variance)
    return np.where(variance > 0, spread, distance <= mean)


def _read(catalog: Catalog, clip_ids: pa.Array, distance: RankedDistance) -> UsualDistances:
    most = sides_to_read(catalog, _PAIRS)
    sides = np.unique(np.linspace(0, side_count(catalog) - 1, most).round().astype(np.int64))
    side = side_of(catalog)
    here = np.array([side[one] for one in clip_ids.to_pylist()])
    chosen = np.isin(here, sides)
    asked, values = [], []
    for number in sides:
        pairs = pairs_with_side(catalog, int(number), distance.columns)
        a, b = (pc.index_in(pairs[end], clip_ids).to_numpy() for end in ("clip_a", "clip_b"))
        found = distance.of(pairs).astype(np.float64)
        for clip, other in ((a, b), (b, a)):
            counts = here[other] == number
            asked.append(clip[counts])
            values.append(found[counts])
    clips, distances = np.concatenate(asked), np.concatenate(values)
    count = np.bincount(clips, minlength=len(clip_ids))
    mean = np.bincount(clips, distances, len(clip_ids)) / np.maximum(count, 1)
    spread = np.bincount(clips, (distances - mean[clips]) ** 2, len(clip_ids))
    return UsualDistances(np.flatnonzero(chosen), mean, spread / np.maximum(count, 1))
