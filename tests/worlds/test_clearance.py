"""Distances, the largest part and closed gaps of a grid are scipy's, ties included."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

from workbench.arrays import Bools
from workbench.worlds.maps.clearance import closed_gaps, distances_to, largest_part


@st.composite
def grids(draw: st.DrawFn) -> Bools:
    rows, columns = draw(st.integers(1, 12)), draw(st.integers(1, 12))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    return rng.random((rows, columns)) < draw(st.sampled_from([0.02, 0.3, 0.6, 0.98]))


@given(grids())
def test_distances_are_those_of_scipy(marked: Bools) -> None:
    if marked.any():
        assert np.array_equal(distances_to(marked), ndimage.distance_transform_edt(~marked))
    else:
        assert np.isinf(distances_to(marked)).all()


@given(grids())
def test_the_largest_part_is_that_of_scipy(free: Bools) -> None:
    labels = np.asarray(ndimage.label(free)[0])
    sizes = np.bincount(labels.ravel())
    sizes[0] = 0
    assert np.array_equal(largest_part(free), (labels == sizes.argmax()) & free)


@given(grids(), st.integers(0, 3))
def test_closed_gaps_are_those_of_scipy(marked: Bools, cells: int) -> None:
    expected = ndimage.binary_closing(marked, iterations=cells) if cells else marked
    assert np.array_equal(closed_gaps(marked, cells), expected)


@pytest.mark.parametrize("shape", [(300, 400)])
def test_of_a_large_grid_too(shape: tuple[int, int]) -> None:
    free = np.random.default_rng(3).random(shape) < 0.62
    labels = np.asarray(ndimage.label(free)[0])
    sizes = np.bincount(labels.ravel())
    sizes[0] = 0
    assert np.array_equal(largest_part(free), labels == sizes.argmax())
    assert np.array_equal(distances_to(~free), ndimage.distance_transform_edt(free))
