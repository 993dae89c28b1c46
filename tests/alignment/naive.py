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

    def __init__(self, moving, reference, segment_length, weights=None, nodes=None):
        self.frames = len(reference)
        self.nodes = nodes_of(self.frames, segment_length) if nodes is None else list(nodes)
        self.segments = len(self.nodes) - 1
        self.source = [length_matched(column, self.frames) for column in columns(moving)]
        self.target = columns(reference)
        self.levels = list(zip(constant_levels(moving), constant_levels(reference), strict=True))
        self.weights = [1.0] * len(self.target) if weights is None else list(weights)
        self.gain = cache(self.gain)

    def gain(self, k, start, eta):
        """Weighted correlation of what the segment shows within the reference."""
        first, length = self.nodes[k], self.nodes[k + 1] - self.nodes[k]
        out = length + eta
        shown = [j for j in range(out + 1) if 0 <= start + j < self.frames]
        times = [first + j * length / max(out, 1) for j in shown]
        total = 0.0
        for weight, source, target, levels in zip(
            self.weights, self.source, self.target, self.levels, strict=True
        ):
            x = [at(source, min(time, self.nodes[k + 1])) for time in times]
            total += weight * correlation(x, [target[start + j] for j in shown], *levels)
        return total

    def objective(self, etas, start=0):
        place, total = start, 0.0
        for k, eta in enumerate(etas):
            total += self.gain(k, place, eta)
            place += self.nodes[k + 1] - self.nodes[k] + eta
        return total

    def enumerate(self, slack):
        """Every admissible eta and its objective."""
        ranges = [range(-slack, slack + 1)] * self.segments
        return {etas: self.objective(etas) for etas in itertools.product(*ranges) if sum(etas) == 0}

    def best(self, slack, open_ends=False):
        """Greatest objective and one (first output frame, eta) that has it, by memoised recursion."""
        trim = slack if open_ends else 0
        last = self.frames - 1

        @cache
        def remaining(k, place):
            if k == self.segments:
                return (0.0, ()) if last <= place <= last + trim else (-math.inf, ())
            length = self.nodes[k + 1] - self.nodes[k]
            bound = min(slack, max(length - 3, 0))
            options = []
            for eta in range(-bound, bound + 1):
                end = place + length + eta
                if k + 1 < self.segments and trim and not 4 <= end <= last - 3:
                    continue
                if end > last + trim:
                    continue
                rest, etas = remaining(k + 1, end)
                if rest > -math.inf:
                    options.append((self.gain(k, place, eta) + rest, (eta, *etas)))
            return max(options, default=(-math.inf, ()))

        starts = {start: remaining(0, start) for start in range(-trim, 1)}
        start = max(starts, key=lambda one: starts[one][0])
        return starts[start][0], (start, starts[start][1])


def output(problem, nodes, moved):
    """The length-matched input with its nodes brought to output frames, linear between, (dofs, frames)."""
    times = []
    for frame in range(problem.frames):
        k = max(k for k in range(len(nodes) - 1) if moved[k] <= frame)
        share = (frame - moved[k]) / max(moved[k + 1] - moved[k], 1)
        times.append(nodes[k] + share * (nodes[k + 1] - nodes[k]))
    return [[at(column, min(time, problem.frames - 1)) for time in times] for column in problem.source]


def whole_output(problem, nodes, moved):
    """Equation 8's rho and |h|, by their definitions."""
    total = math.fsum(problem.weights)
    rho = h = 0.0
    shown = output(problem, nodes, moved)
    for weight, x, y, matched, levels in zip(
        problem.weights, shown, problem.target, problem.source, problem.levels, strict=True
    ):
        rho += weight * correlation(x, y, *levels)
        if correlation(matched, matched, levels[0], levels[0]) > 0:
            before, after = slope_norm(matched), slope_norm(x)
            h += weight * (after - before) / before
    return rho / total, abs(h / total)


def slope_norm(column):
    return math.sqrt(math.fsum((b - a) ** 2 for a, b in itertools.pairwise(column)))


def search(moving, reference, weights, alpha, shortest=8):
    """Equation 8's greatest value over the whole grid, every combination by itself."""
    frames = len(reference)
    problem = Problem(moving, reference, frames, weights)
    rho, h = whole_output(problem, problem.nodes, problem.nodes)
    values = {(frames, 0): rho - alpha * h}
    for length in range(shortest, frames // 2 + 1):
        problem = Problem(moving, reference, length, weights)
        for slack in range(1, length - 3):
            _, (_, etas) = problem.best(slack)
            moved = list(
                itertools.accumulate(
                    (
                        b - a + eta
                        for (a, b), eta in zip(itertools.pairwise(problem.nodes), etas, strict=True)
                    ),
                    initial=0,
                )
            )
            rho, h = whole_output(problem, problem.nodes, moved)
            values[length, slack] = rho - alpha * h
    return values


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
