"""Shortest lengths between nodes of a graph by Dijkstra's algorithm, and the pairs of points close to each other."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from heapq import heappop, heappush
from itertools import product
from math import floor, hypot, inf

import numpy as np

from workbench.arrays import Floats
from workbench.worlds.geometry import Point

Edge = tuple[int, int, float]
"""Two nodes and the length between them; edges lead both ways."""


def lengths_between(edges: Iterable[Edge], places: Sequence[int], *, nodes: int) -> Floats:
    """Shortest lengths along edges between some of the nodes, shape (places, places); inf where none connects.

    Args:
        nodes: how many there are; an edge names two of them, 0 to nodes - 1.
    """
    beside: list[list[tuple[int, float]]] = [[] for _ in range(nodes)]
    for a, b, length in edges:
        beside[a].append((b, length))
        beside[b].append((a, length))
    rows = [_lengths_from(place, beside) for place in places]
    return np.array([[row[place] for place in places] for row in rows]).reshape(len(places), len(places))


def near_pairs(points: Sequence[Point], within_m: float) -> Iterator[tuple[int, int]]:
    """The pairs of points, the smaller number first, that are at most so far apart."""
    cells: dict[tuple[int, int], list[int]] = {}
    for number, (x, y) in enumerate(points):
        column, row = floor(x / within_m), floor(y / within_m)
        for over, up in product((-1, 0, 1), repeat=2):
            for other in cells.get((column + over, row + up), ()):
                if hypot(x - points[other][0], y - points[other][1]) <= within_m:
                    yield other, number
        cells.setdefault((column, row), []).append(number)


def _lengths_from(source: int, beside: Sequence[Sequence[tuple[int, float]]]) -> list[float]:
    length_to = [inf] * len(beside)
    length_to[source] = 0.0
    queue = [(0.0, source)]
    while queue:
        so_far, node = heappop(queue)
        if so_far > length_to[node]:
            continue
        for other, length in beside[node]:
            if so_far + length < length_to[other]:
                length_to[other] = so_far + length
                heappush(queue, (so_far + length, other))
    return length_to
