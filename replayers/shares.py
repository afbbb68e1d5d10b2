"""Which strategies over one log does one process replay, where several share the log?

Strategies that come to the same states and ask for the same searches stay together (remembered.py): apart, each would
work them out again. The costly go first, so that the others fill what is left of the time.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from workbench.planning.strategies import canonical_name

FAMILIES: tuple[tuple[str, ...], ...] = (
    ("scout-lios",),
    ("opt-greedy", "pes-greedy"),
    ("opt-lios", "pes-lios"),
    ("model-lios", "conditioned-lios"),
)
"""By name, the costly first. What is not among them stands for itself and goes first: nobody knows its cost."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Share:
    """What one process does in one go: strategies over a log, in the order in which they were asked for."""

    log: Path
    strategies: tuple[str, ...]


def shares_of(wanted: Mapping[Path, tuple[str, ...]]) -> tuple[Share, ...]:
    """All that is to be done, in the order in which it is best begun.

    Args:
        wanted: the strategies to run over each log.
    """
    together: dict[tuple[int, str, Path], list[str]] = {}
    for log, strategies in wanted.items():
        for name in strategies:
            together.setdefault((*_family(name), log), []).append(name)
    begun = sorted(together, key=lambda family: family[:2])
    return tuple(Share(log=family[2], strategies=tuple(together[family])) for family in begun)


def _family(name: str) -> tuple[int, str]:
    """Its rank among the costly, and its name where it stands for itself. STRATEGY@SOLVER is of STRATEGY's family."""
    base = canonical_name(name.partition("@")[0])
    rank = next((i for i, members in enumerate(FAMILIES) if base in members), -1)
    return (rank, "" if rank >= 0 else name)
