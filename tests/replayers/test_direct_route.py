"""The compiled longest legs are those of the same in numpy, with scipy's assignment, to the last digit."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from scipy.optimize import linear_sum_assignment

from replayers.counterfactual.bounds.direct_route import longest_legs

Floats = npt.NDArray[np.float64]


def in_numpy(
    metres: Floats,
    here: list[int],
    looks: list[int],
    ends: list[int],
    stand: list[list[int]],
    fetches: int,
    stood: bool,
) -> tuple[list[float], list[float], list[float]]:
    among = metres[[*here, *looks, *ends]]
    sites = sorted({at for places in stand for at in places}.difference(looks))
    if sites and stood:
        among = np.vstack([among, *[metres[sites].max(axis=0)] * fetches])
    into_looks = among[:, looks]
    to_looks = into_looks.max(axis=1, initial=0.0)
    to_items = [np.maximum(to_looks, among[:, at].max(axis=1)) if at else to_looks for at in stand]
    from_looks = metres[np.ix_(looks, ends)].max(axis=0, initial=0.0).tolist()
    brought = [
        max([far, *(float(metres[at, end]) for at in places)])
        for far, end, places in zip(from_looks, ends, stand, strict=True)
    ]
    rows = to_items if len(to_items) <= fetches else [np.max(to_items, axis=0)] * fetches
    worth = np.concatenate([into_looks.T, np.reshape(rows, (-1, len(among)))])
    pairs = worth[linear_sum_assignment(worth, maximize=True)] if worth.size else np.zeros(0)
    return pairs.tolist(), brought, [float(way.max(initial=0.0)) for way in to_items]


@pytest.mark.parametrize("seed", range(200))
def test_legs_are_those_of_numpy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 12))
    metres = rng.choice([0.5, 1.0, 2.0, 3.25, 7.0], size=(n, n)) + rng.random((n, n)) * rng.integers(0, 2)
    looks = rng.permutation(n)[: rng.integers(0, n)].tolist()
    ends = rng.integers(n, size=rng.integers(0, 4)).tolist()
    stand = [rng.permutation(n)[: rng.integers(0, 3)].tolist() for _ in ends]
    here = rng.integers(n, size=1 if not looks and not ends else rng.integers(0, 2)).tolist()
    fetches, stood = min(int(rng.integers(1, 4)), len(ends)), bool(rng.integers(0, 2))
    first = np.cumsum([0, *map(len, stand)])
    made = longest_legs(
        metres,
        here[0] if here else -1,
        np.array(looks, dtype=np.int64),
        np.array(ends, dtype=np.int64),
        np.array([at for places in stand for at in places], dtype=np.int64),
        first.astype(np.int64),
        fetches,
        stood,
    )
    assert tuple(legs.tolist() for legs in made) == in_numpy(metres, here, looks, ends, stand, fetches, stood)
