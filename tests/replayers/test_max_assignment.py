"""The compiled assignment and clustering equal scipy's, ties included."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from scipy.cluster.hierarchy import linkage
from scipy.optimize import linear_sum_assignment

from replayers.counterfactual.bounds.max_assignment import max_assignment
from replayers.counterfactual.estimates.complete_linkage import merge_widths

Floats = npt.NDArray[np.float64]

FEW_DIFFERENT = st.sampled_from([0.0, 0.1, 0.2, 0.30000000000000004, 1.5, 2**0.5])
"""So that there are ties."""


@settings(deadline=None)
@given(arrays(np.float64, array_shapes(min_dims=2, max_dims=2, max_side=9), elements=FEW_DIFFERENT | st.floats(0, 9)))
def test_pairs_are_those_of_scipy(worth: Floats) -> None:
    rows, columns = linear_sum_assignment(worth, maximize=True)
    ours = max_assignment(worth)
    assert np.flatnonzero(ours >= 0).tolist() == rows.tolist()
    assert ours[rows].tolist() == columns.tolist()


def test_pairs_by_hand() -> None:
    """Row 0 leaves the most expensive column to row 1, to which it is worth more: 4 + 9."""
    assert max_assignment(np.array([[5.0, 4.0, 0.0], [9.0, 1.0, 1.0]])).tolist() == [1, 0]


@settings(deadline=None)
@given(st.integers(1, 12), st.data())
def test_widths_are_those_of_scipy(places: int, data: st.DataObject) -> None:
    between: Floats = data.draw(arrays(np.float64, (places, places), elements=FEW_DIFFERENT | st.floats(0, 9)))
    apart = np.maximum(between, between.T)
    if places == 1:
        assert merge_widths(apart).size == 0
        return
    scipys = linkage(apart[np.triu_indices(places, 1)], "complete")[:, 2]
    assert merge_widths(apart).tolist() == scipys.tolist()


def test_widths_by_hand() -> None:
    """At 0, 2 and 10: the first two are 2 apart, all three 10."""
    at = np.array([0.0, 2.0, 10.0])
    assert merge_widths(np.abs(at[:, None] - at[None, :])).tolist() == [2.0, 10.0]
