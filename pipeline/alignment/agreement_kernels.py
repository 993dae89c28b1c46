"""The compiled kernels of the additive version of eq. 8: see `motionary.pipeline.alignment.likely_warps`."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from motionary.pipeline.motion import FloatArray

Integers = NDArray[np.int64]
_kernel = njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})


@_kernel
def fill_agreement(
    agreement: FloatArray,
    nodes: Integers,
    low: Integers,
    high: Integers,
    least_eta: Integers,
    most_eta: Integers,
    start: Integers,
    values: FloatArray,
) -> None:
    """Fill the tables of all segments with the agreement of input and reference summed along each.

    A table's cells stand as in `correlation_tables.TableLayout`. The frame of a node counts to the
    segment that begins there.
    """
    frames, segments = len(agreement), len(nodes) - 1
    for k in range(segments):
        span, places = nodes[k + 1] - nodes[k], high[k] - low[k] + 1
        for eta in range(least_eta[k], most_eta[k] + 1):
            out = span + eta
            begin = start[k] + (eta - least_eta[k]) * places
            row = values[begin : begin + places]
            first, last = max(low[k], low[k + 1] - out), min(high[k], high[k + 1] - out)
            for j in range(out + 1 if k == segments - 1 else out):
                time = nodes[k] + j * span / out
                before = min(int(time), frames - 1)
                share = time - before
                here, after = agreement[before], agreement[min(before + 1, frames - 1)]
                for place in range(max(first, -j), min(last, frames - 1 - j) + 1):
                    row[place - low[k]] += here[place + j] + share * (after[place + j] - here[place + j])


@_kernel
def add_distortion(
    values: FloatArray,
    start: Integers,
    least_eta: Integers,
    places: Integers,
    nodes: Integers,
    steepness: FloatArray,
    price: float,
    priced: FloatArray,
) -> None:
    """Fill `priced` with the tables less `price` times what each stretch adds to h."""
    for k in range(len(places)):
        span = nodes[k + 1] - nodes[k]
        for row in range((start[k + 1] - start[k]) // places[k]):
            added = price * steepness[k] * (span / (span + least_eta[k] + row) - 1.0)
            begin = start[k] + row * places[k]
            for cell in range(begin, begin + places[k]):
                priced[cell] = values[cell] - added
