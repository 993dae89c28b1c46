"""Slow, obvious versions of the alignment methods, in plain Python; nothing here comes from the product."""

import itertools
import math
from functools import cache

EPSILON = {"float32": 2.0**-23, "float64": 2.0**-52}


def at(column, time):
    """Value of a column at a fractional frame, linearly."""
    before = min(int(math.floor(time)), len(column) - 1)
    after = min(before + 1, len(column) - 1)
    return column[before] * (1 - (time - before)) + column[after] * (time - before)


def columns(array):
    return [[float(value) for value in array[:, dof]] for dof in range(array.shape[1])]


def length_matched(column, frames):
    if frames == 1:
        return [column[0]]
    return [at(column, k * (len(column) - 1) / (frames - 1)) for k in range(frames)]


def constant_levels(array):
    """Standard deviations up to which each DOF counts as constant."""
    largest = [max(abs(value) for value in column) for column in columns(array)]
    return [max(4 * EPSILON[str(array.dtype)] * one, 1e-12 * max(largest)) for one in largest]


def correlation(x, y, x_level=0.0, y_level=0.0):
    """Pearson's, by its definition; 0 where either is constant."""
    n = len(x)
    x_mean, y_mean = math.fsum(x) / n, math.fsum(y) / n
    x_var = math.fsum((value - x_mean) ** 2 for value in x) / n
    y_var = math.fsum((value - y_mean) ** 2 for value in y) / n
    if x_var <= x_level**2 or y_var <= y_level**2:
        return 0.0
    covariance = math.fsum((p - x_mean) * (q - y_mean) for p, q in zip(x, y, strict=True)) / n
    return covariance / math.sqrt(x_var * y_var)


def nodes_of(frames, segment_length):
    segments = max(1, frames // segment_length)
    return [k * segment_length for k in range(segments)] + [frames - 1]


class Problem:
    """One alignment: the gain of a segment stretched by eta from an output frame on."""

    def __init__(self, moving, reference, segment_length, weights=None):
        self.frames = len(reference)
        self.nodes = nodes_of(self.frames, segment_length)
        self.segments = len(self.nodes) - 1
        self.source = [length_matched(column, self.frames) for column in columns(moving)]
        self.target = columns(reference)
        self.levels = list(zip(constant_levels(moving), constant_levels(reference), strict=True))
        self.weights = [1.0] * len(self.target) if weights is None else list(weights)
        self.gain = cache(self.gain)

    def gain(self, k, start, eta):
        first, length = self.nodes[k], self.nodes[k + 1] - self.nodes[k]
        out = length + eta
        times = [first + j * length / out for j in range(out + 1)]
        total = 0.0
        for weight, source, target, levels in zip(
            self.weights, self.source, self.target, self.levels, strict=True
        ):
            x = [at(source, min(time, self.nodes[k + 1])) for time in times]
            total += weight * correlation(x, target[start : start + out + 1], *levels)
        return total

    def objective(self, etas):
        place, total = 0, 0.0
        for k, eta in enumerate(etas):
            total += self.gain(k, place, eta)
            place += self.nodes[k + 1] - self.nodes[k] + eta
        return total

    def enumerate(self, slack):
        """Every admissible eta and its objective."""
        ranges = [range(-slack, slack + 1)] * self.segments
        return {etas: self.objective(etas) for etas in itertools.product(*ranges) if sum(etas) == 0}

    def best(self, slack):
        """Greatest objective and one eta that has it, by recursion over the remaining segments."""

        @cache
        def remaining(k, place):
            if k == self.segments:
                return (0.0, ()) if place == self.frames - 1 else (-math.inf, ())
            options = []
            for eta in range(-slack, slack + 1):
                end = place + self.nodes[k + 1] - self.nodes[k] + eta
                if end > self.frames - 1:
                    continue
                rest, etas = remaining(k + 1, end)
                if rest > -math.inf:
                    options.append((self.gain(k, place, eta) + rest, (eta, *etas)))
            return max(options, default=(-math.inf, ()))

        return remaining(0, 0)


def similarity_products(clips, weights=None):
    """Equation 9 with p = 1, as it is printed: a product of correlations for each DOF, summed."""
    count, _, dofs = clips.shape
    weights = [1.0] * dofs if weights is None else weights
    series = [columns(clip) for clip in clips]
    levels = [constant_levels(clip) for clip in clips]
    return [
        math.fsum(
            weights[i]
            * math.prod(
                abs(correlation(series[r][i], series[j][i], levels[r][i], levels[j][i]))
                for j in range(count)
                if j != r
            )
            for i in range(dofs)
        )
        for r in range(count)
    ]
