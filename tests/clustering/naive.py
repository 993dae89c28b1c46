"""Slow, obvious references for clustering; clusters are sets of clips, keys follow their definitions."""

from fractions import Fraction
from itertools import combinations
from math import ceil, log2


def square(condensed, clips):
    """Exact distances by pair, either way round, and 0 from a clip to itself."""
    distance = {(i, i): Fraction(0) for i in range(clips)}
    for (i, j), value in zip(combinations(range(clips), 2), condensed, strict=True):
        distance[i, j] = distance[j, i] = Fraction(float(value))
    return distance


def between(distance, a, b):
    return [distance[i, j] for i in a for j in b]


def mean(values):
    return sum(values) / len(values)


def complete_key(distance):
    return lambda a, b: max(between(distance, a, b))


def average_key(distance):
    return lambda a, b: mean(between(distance, a, b))


def ward_key(distance):
    """Square of SciPy's height, from mean squared lengths between and inside the clusters."""

    def key(a, b):
        weight = Fraction(2 * len(a) * len(b), len(a) + len(b))
        inside = mean(between(distance, a, a)) + mean(between(distance, b, b))
        return weight * (mean(between(distance, a, b)) - inside / 2)

    return key


def fuzzy_key(low, high, tau):
    tau = Fraction(tau)

    def key(a, b):
        c, d = min(between(low, a, b)), max(between(high, a, b))
        return c + tau * (d - c)

    return key


def replay(linkage, key):
    """For every merge: its height, its key, and the least key of all pairs of clusters at that moment."""
    nodes = {clip: frozenset([clip]) for clip in range(len(linkage) + 1)}
    steps = []
    for row, (left, right, height, size) in enumerate(linkage):
        least = min(key(a, b) for a, b in combinations(nodes.values(), 2))
        a, b = nodes.pop(int(left)), nodes.pop(int(right))
        assert left < right
        assert size == len(a | b)
        steps.append((height, key(a, b), least))
        nodes[len(linkage) + 1 + row] = a | b
    return steps


def agglomerate(clips, key):
    """Every partition on the way from single clips to one cluster, and the key of the merge that made it."""
    clusters, steps = {frozenset([clip]) for clip in range(clips)}, []
    while len(clusters) > 1:
        height, a, b = min(
            ((key(a, b), a, b) for a, b in combinations(clusters, 2)), key=lambda step: step[0]
        )
        clusters = clusters - {a, b} | {a | b}
        steps.append((height, clusters))
    return steps


def chain(clips, key):
    """The merges of a nearest-neighbour chain, each by the last clips of its two clusters, sorted by height.

    Of equally near clusters the chain's last link comes first, then the one whose last clip comes first.
    """
    clusters, links, merges = {clip: frozenset([clip]) for clip in range(clips)}, [], []
    while len(clusters) > 1:
        links = links or [min(clusters)]
        tip, before = links[-1], links[-2] if len(links) > 1 else None
        nearest = min(
            (slot for slot in clusters if slot != tip),
            key=lambda slot: (key(clusters[tip], clusters[slot]), slot != before, slot),
        )
        if nearest != before:
            links.append(nearest)
            continue
        gone, kept = sorted((tip, nearest))
        merges.append((key(clusters[gone], clusters[kept]), gone, kept))
        clusters[kept] |= clusters.pop(gone)
        links = links[:-2]
    return sorted(merges, key=lambda merge: merge[0])


def partition(linkage, kappa):
    """The clusters, as a set of sets, that the first N - kappa merges leave."""
    clips = len(linkage) + 1
    nodes = {clip: frozenset([clip]) for clip in range(clips)}
    for row in range(clips - kappa):
        nodes[clips + row] = nodes.pop(int(linkage[row][0])) | nodes.pop(int(linkage[row][1]))
    return set(nodes.values())


def as_partition(labels):
    return {frozenset(i for i, c in enumerate(labels) if c == cluster) for cluster in set(labels)}


def cluster_count(linkage, threshold):
    return len(linkage) + 1 - sum(height <= threshold for height in linkage[:, 2])


def nearest(distance, clips):
    """For every clip the others that the nearest-neighbour graph joins it to, the nearest first."""
    count = min(ceil(log2(clips)), clips - 1)
    return [
        sorted(set(range(clips)) - {clip}, key=lambda other: (distance[clip, other], other))[:count]
        for clip in range(clips)
    ]


def neighbour_weights(distance, clips):
    """Weighted adjacency of the nearest-neighbour graph, as a dense table."""
    hoods = [{clip, *others} for clip, others in enumerate(nearest(distance, clips))]
    joined = [[i != j and (j in hoods[i] or i in hoods[j]) for j in range(clips)] for i in range(clips)]
    return [
        [len(hoods[i] & hoods[j]) / len(hoods[i] | hoods[j]) if joined[i][j] else 0.0 for j in range(clips)]
        for i in range(clips)
    ]


def modularity(weights, clusters):
    degree = [sum(row) for row in weights]
    twice = sum(degree)
    return sum(
        weights[i][j] / twice - degree[i] * degree[j] / twice**2 for c in clusters for i in c for j in c
    )


def reward_punish(clusters, classes):
    value = 0
    for cluster in clusters:
        for i in cluster:
            for j in cluster:
                if i != j and classes[i] is not None and classes[j] is not None:
                    value += 1 if classes[i] == classes[j] else -1
    return value
