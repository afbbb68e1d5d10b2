"""The candidate containers of a find: the subset program is exact over a few per item type.

Two rankings:

- `probable`, the paper's: the two containers of least d(q, a) + d(a, q_to), then the most probable ones;
- `worth`, ours: by p / (1 + d(q, a) + d(a, q_to) / 2), probability against the walk (docs/search.md).

For a table over many origins and targets the distances are means over them, so that an item type has one
candidate set; for one query they are that query's own.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from workbench.arrays import Floats, Indices
from workbench.errors import BadValue, Unsupported
from workbench.search.find_costs import BeliefModel
from workbench.search.remaining import compiled_loops
from workbench.search.ties import ranked

Ranking = Literal["probable", "worth"]

PAPER_LIMIT = 8
MAX_LIMIT = 18

NEAREST_KEPT = 2


class TooManyCandidates(Unsupported):
    """A candidate limit whose subset table is too large."""

    def __init__(self, limit: int) -> None:
        super().__init__(
            f"a candidate limit of {limit} takes a table of 2^{limit} subsets an item type; "
            f"give at most {MAX_LIMIT}, or the policy full-lios, which looks at every container."
        )


def check_limit(limit: int) -> int:
    """The limit, if valid.

    Raises:
        BadValue: below 1.
        TooManyCandidates: above MAX_LIMIT.
    """
    if limit < 1:
        raise BadValue("candidate limit", limit, f"from 1 to {MAX_LIMIT}")
    if limit > MAX_LIMIT:
        raise TooManyCandidates(limit)
    return limit


def ranking_of(model: BeliefModel) -> Ranking:
    """The default ranking of a belief model: the paper's ranking for the paper's model."""
    return "probable" if model == "independent" else "worth"


def choose(
    probability: Floats,
    from_m: Floats,
    to_m: Floats,
    *,
    limit: int,
    ranking: Ranking,
) -> Indices:
    """The candidates of each item type, in the plan's order; of equally ranked containers (ties.py) the earlier.

    Args:
        probability: shape (item types, containers).
        from_m, to_m: metres from the origin and to the target, shape (containers,); means for a table.

    Returns:
        Indices of containers, shape (item types, min(limit, containers)).
    """
    count = min(check_limit(limit), probability.shape[1])
    if ranking == "worth":
        score = probability / (1.0 + from_m + to_m / 2.0)
    else:
        score = probability.copy()
        score[:, nearest(from_m, to_m, count=count)] = 2.0
    return greatest(score, count)


def choose_per_find(
    probability: Floats,
    from_m: Floats,
    to_m: Floats,
    *,
    limit: int,
    ranking: Ranking,
) -> Indices:
    """The same for every origin and target by themselves, as a find between the two is carried out.

    Args:
        probability: shape (item types, containers).
        from_m, to_m: shapes (origins, containers) and (containers, targets).

    Returns:
        Shape (item types, origins, targets, min(limit, containers)).
    """
    items, n = probability.shape
    count = min(check_limit(limit), n)
    shape = (items, len(from_m), to_m.shape[1], count)
    if ranking == "worth":
        detour = 1.0 + from_m[:, None, :] + to_m.T[None] / 2.0
        scores = probability[:, None, None, :] / detour[None]
        return greatest(scores.reshape(-1, n), count).reshape(shape)
    near = greatest(-(from_m[:, None, :] + to_m.T[None]).reshape(-1, n), min(NEAREST_KEPT, count))
    kept, of_pair = np.unique(near, axis=0, return_inverse=True)  # few: the nearest are the same for many pairs
    scores = np.repeat(probability[:, None], len(kept), axis=1)
    scores[:, np.arange(len(kept))[:, None], kept] = 2.0
    chosen = greatest(scores.reshape(-1, n), count).reshape(items, len(kept), count)
    return chosen[:, of_pair.reshape(-1)].reshape(shape)


def nearest(from_m: Floats, to_m: Floats, *, count: int) -> Indices:
    """The containers that the paper's ranking keeps in any case; of equally near ones (ties.py) the earlier.

    Every container on a shortest path from the origin to the target has the same sum, but for rounding.
    """
    return greatest(-(from_m + to_m)[None], min(NEAREST_KEPT, count))[0]


def greatest(scores: Floats, count: int) -> Indices:
    """The columns of the greatest scores of each row, in their order; of equal ones (ties.py) the earlier.

    Args:
        scores: finite, shape (rows, columns).

    Returns:
        Shape (rows, count).
    """
    program = compiled_loops()
    return np.sort(ranked(scores, count), axis=1) if program is None else program.greatest(scores, count)
