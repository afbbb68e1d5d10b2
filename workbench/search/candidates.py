"""The choice of candidate containers per item type over which Eq. 1 is exact.

Two rankings:

- `probable`, the paper's: the two containers of least d(q, a) + d(a, q_to), then the most probable ones;
- `worth`, ours: by p / (1 + d(q, a) + d(a, q_to) / 2), probability per distance (docs/search.md).

For a table over many origins and targets the distances are means over them, so that each item type has one
candidate set; for a single query they are exact.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
import numpy.typing as npt

from workbench.errors import BadValue, Unsupported
from workbench.search.find_costs import BeliefModel

Ranking = Literal["probable", "worth"]

PAPER_LIMIT = 8
MAX_LIMIT = 18

NEAREST_KEPT = 2


class TooManyCandidates(Unsupported):
    """A candidate limit whose subset table is too large."""

    def __init__(self, limit: int) -> None:
        size = table_bytes(limit)
        shown = f"{size / 2**30:.3g} GiB" if size < 2**60 else f"2^{size.bit_length() - 1} bytes"
        super().__init__(
            f"a candidate limit of {limit} takes a table of {shown} an item type; "
            f"give at most {MAX_LIMIT}, or the policy full-lios, which looks at every container."
        )


def table_bytes(limit: int, *, targets: int = 8) -> int:
    """Memory of the subset table: one float64 per subset, last container and target of a tile, in bytes."""
    return (1 << limit) * limit * targets * 8


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
    probability: npt.NDArray[np.float64],
    from_m: npt.NDArray[np.float64],
    to_m: npt.NDArray[np.float64],
    *,
    limit: int,
    ranking: Ranking,
) -> npt.NDArray[np.intp]:
    """The candidates of each item type, in the plan's order; ties go to the earlier container.

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
        near = np.argsort(from_m + to_m, kind="stable")[: min(NEAREST_KEPT, count)]
        score[:, near] = 2.0
    return np.sort(np.argsort(-score, axis=1, kind="stable")[:, :count], axis=1)
