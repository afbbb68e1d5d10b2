"""Rates of moving from intervals between looks: the most probable ones, by bisection of the score.

An item seen twice in one place after d days did not move in between, one that was gone did: likelihoods exp(-r d)
and 1 - exp(-r d). The prior of a rate is a Gamma distribution around a known one, worth so many moves; its mode over
log r is found, which always exists. An item that moved and came back counts as having stayed.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from workbench.beliefs.memory.move_rates import OTHERS, MoveRates, RateRow
from workbench.worlds.house import ItemType
from workbench.worlds.names import generic_type

PRIOR_MOVES = 2.0
"""What the known rates weigh, in observed moves."""
LOG_RANGE = math.log(1e4)
"""A rate is at most this factor from the known one, up or down."""
BISECTIONS = 60


@dataclass(frozen=True, slots=True, kw_only=True)
class RevisitInterval:
    """An item seen in a container, and whether it was still there when that was looked into again, days later."""

    item_type: ItemType
    days: float
    stayed: bool


def fit_pace(intervals: Iterable[RevisitInterval], rates: MoveRates, *, prior_moves: float = PRIOR_MOVES) -> float:
    """The factor on all rates under which the intervals are most probable, drawn to 1."""
    exposures = [(rates.of(i.item_type) * i.days, i.stayed) for i in intervals if i.days > 0]
    return _fit(exposures, known=1.0, prior_moves=prior_moves)


def fit_rates(
    intervals: Sequence[RevisitInterval], known: MoveRates, *, prior_moves: float = PRIOR_MOVES
) -> tuple[RateRow, ...]:
    """Rates by type: the known ones times the household's pace, each then moved by what its own type did.

    Returns:
        A row for each known or observed type, and one for all others.
    """
    pace = fit_pace(intervals, known, prior_moves=prior_moves)
    by_type: dict[ItemType, list[RevisitInterval]] = {}
    for interval in intervals:
        if interval.days > 0:
            by_type.setdefault(ItemType(generic_type(interval.item_type)), []).append(interval)
    rows = [_row(t, by_type.get(t, []), pace * known.of(t), prior_moves) for t in sorted({*known.by_type, *by_type})]
    everything = [i for found in by_type.values() for i in found]
    moves, days = _counted(everything)
    return (RateRow(item_type=OTHERS, rate=pace * known.others, moves=moves, days=days), *rows)


def _row(item_type: ItemType, found: list[RevisitInterval], expected: float, prior_moves: float) -> RateRow:
    moves, days = _counted(found)
    rate = _fit([(i.days, i.stayed) for i in found], known=expected, prior_moves=prior_moves)
    return RateRow(item_type=item_type, rate=rate, moves=moves, days=days)


def _counted(found: Iterable[RevisitInterval]) -> tuple[float, float]:
    observed = list(found)
    return float(sum(not i.stayed for i in observed)), sum(i.days for i in observed)


def _fit(exposures: Sequence[tuple[float, bool]], *, known: float, prior_moves: float) -> float:
    """The rate at which the derivative of the log posterior by log rate is 0; it falls as the rate rises."""
    if not exposures:
        return known

    def score(rate: float) -> float:
        total = prior_moves * (1.0 - rate / known)
        for days, stayed in exposures:
            x = rate * days
            total += -x if stayed else (x / math.expm1(x) if x < 700 else 0.0)
        return total

    low, high = math.log(known) - LOG_RANGE, math.log(known) + LOG_RANGE
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        low, high = (middle, high) if score(math.exp(middle)) > 0 else (low, middle)
    return math.exp((low + high) / 2)
