"""Lengths along a graph are those of scipy's Dijkstra, and close pairs those of its k-d tree."""

from __future__ import annotations

from math import dist

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import KDTree

from replayers.sites.graph_lengths import lengths_between, near_pairs

POINTS = st.lists(st.tuples(st.floats(-3, 3), st.floats(-3, 3)), min_size=1, max_size=40, unique=True)


def test_the_shorter_of_two_ways_and_of_two_edges() -> None:
    """0 - 1 is 3 long, or 4; round by 2 it is 1 + 1.5; 3 is alone."""
    edges = [(0, 1, 4.0), (0, 1, 3.0), (2, 0, 1.0), (1, 2, 1.5)]
    inf = float("inf")
    assert lengths_between(edges, [0, 1, 3], nodes=4).tolist() == [[0, 2.5, inf], [2.5, 0, inf], [inf, inf, 0]]
    assert lengths_between([], [], nodes=0).shape == (0, 0)


@given(POINTS, st.floats(0.1, 2))
def test_they_are_those_of_scipy(points: list[tuple[float, float]], within_m: float) -> None:
    pairs = sorted(near_pairs(points, within_m))
    for a, b in set(pairs) ^ KDTree(points).query_pairs(within_m):
        assert abs(dist(points[a], points[b]) - within_m) < 1e-9, "they differ in more than the last digit"
    ends = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    lengths = np.random.default_rng(len(points)).uniform(0.1, 2, len(pairs))
    graph = csr_array((lengths, (ends[:, 0], ends[:, 1])), shape=(len(points), len(points)))
    edges = [(a, b, float(length)) for (a, b), length in zip(pairs, lengths, strict=True)]
    found = lengths_between(edges, range(len(points)), nodes=len(points))
    np.testing.assert_allclose(found, dijkstra(graph, directed=False), rtol=1e-12)
