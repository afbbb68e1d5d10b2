"""Breakdown points: how many overlooked items a certain claim survives, from replays with more and more of them.

A folder may hold replays of one log and strategy for several numbers of overlooked items (lios replay --misses K).
The fewest are what comparisons are made of; the others say on which logs "a is cheaper in every world" still holds.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from replayers.batch.compare import LOSES, WINS, CostDifference, StrategyComparison, cost_difference
from replayers.batch.store import StoredReplay


@dataclass(frozen=True, slots=True, kw_only=True)
class Breakdown:
    """What becomes of "cheaper costs less than dearer in every world" once looks may have overlooked items.

    Attributes:
        overlooked: how many more items than where fewest are allowed.
        certain: logs on which the claim holds where fewest are.
        replayed: of them, those with replays of both for this many.
        still: of those, the ones on which it holds still.
        broken: the logs on which it does not.
    """

    cheaper: str
    dearer: str
    overlooked: int
    certain: int
    replayed: int
    still: int
    broken: tuple[str, ...]


def fewest_misses(records: Iterable[StoredReplay]) -> tuple[StoredReplay, ...]:
    """Of the replays of each log and strategy, the one that allows for the fewest overlooked items."""
    least: dict[tuple[str, str], StoredReplay] = {}
    for record in records:
        key = record.sha256, record.strategy
        if key not in least or record.misses < least[key].misses:
            least[key] = record
    return tuple(least.values())


def breakdowns(pairs: Sequence[StrategyComparison], records: Iterable[StoredReplay]) -> tuple[Breakdown, ...]:
    """For each pair and each of the two that is certainly cheaper on some log, one for each number overlooked.

    Args:
        pairs: comparisons of the replays that allow for the fewest overlooked items.
        records: all replays, those too.
    """
    found: dict[tuple[str, str], dict[int, StoredReplay]] = {}
    for record in records:
        if record.bounds is not None:
            found.setdefault((record.sha256, record.strategy), {})[record.misses] = record
    made: list[Breakdown] = []
    for pair in pairs:
        for cheaper, dearer, verdict in ((pair.a, pair.b, WINS), (pair.b, pair.a, LOSES)):
            certain = [d for d in pair.differences if d.verdict == verdict]
            further = _further([d.sha256 for d in certain], cheaper, dearer, found)
            made += [
                _breakdown(cheaper, dearer, overlooked, len(certain), apart)
                for overlooked, apart in sorted(further.items())
            ]
    return tuple(made)


def _further(
    logs: Iterable[str], cheaper: str, dearer: str, found: Mapping[tuple[str, str], Mapping[int, StoredReplay]]
) -> dict[int, list[CostDifference]]:
    """Cheaper minus dearer over each log, by how many more items may have been overlooked."""
    made: dict[int, list[CostDifference]] = {}
    for sha256 in logs:
        a, b = found.get((sha256, cheaper), {}), found.get((sha256, dearer), {})
        both = sorted(a.keys() & b.keys())
        for misses in both[1:]:
            made.setdefault(misses - both[0], []).append(cost_difference(a[misses], b[misses]))
    return made


def _breakdown(
    cheaper: str, dearer: str, overlooked: int, certain: int, apart: Sequence[CostDifference]
) -> Breakdown:
    return Breakdown(
        cheaper=cheaper,
        dearer=dearer,
        overlooked=overlooked,
        certain=certain,
        replayed=len(apart),
        still=sum(d.verdict == WINS for d in apart),
        broken=tuple(d.log for d in apart if d.verdict != WINS),
    )


def in_words(found: Sequence[Breakdown]) -> tuple[str, ...]:
    """One line for each claim: on how many logs it holds, and on how many still, up to where it holds on none."""
    lines: dict[tuple[str, str], str] = {}
    broken: set[tuple[str, str]] = set()
    for one in found:
        key = one.cheaper, one.dearer
        if key not in lines:
            logs = "1 log" if one.certain == 1 else f"{one.certain} logs"
            lines[key] = f"{one.cheaper} is certainly cheaper than {one.dearer} on {logs}"
        if key in broken:
            continue
        of = "of them" if one.replayed == one.certain else f"of the {one.replayed} replayed so"
        items = "1 item was" if one.overlooked == 1 else f"{one.overlooked} items were"
        lines[key] += f"; {f'on {one.still} {of} still' if one.still else f'on none {of}'} if {items} overlooked"
        if not one.still:
            broken.add(key)
    return tuple(lines.values())
