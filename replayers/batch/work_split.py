"""Splits the strategies over one log into work packages for several processes.

Strategies that reach the same states and request the same searches stay together: in separate processes, each would
compute them again. The expensive ones go first, so that the others fill the remaining time.
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
"""Families by name, the most expensive first. Any other strategy is a family of its own and goes first: its cost is
unknown."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WorkPackage:
    """One work package: strategies over a log, in the order in which they were requested."""

    log: Path
    strategies: tuple[str, ...]


def work_packages(wanted: Mapping[Path, tuple[str, ...]]) -> tuple[WorkPackage, ...]:
    """All work packages, in the order in which they should be started.

    Args:
        wanted: the strategies to run over each log.
    """
    together: dict[tuple[int, str, Path], list[str]] = {}
    for log, strategies in wanted.items():
        for name in strategies:
            together.setdefault((*_family_rank(name), log), []).append(name)
    begun = sorted(together, key=lambda family: family[:2])
    return tuple(WorkPackage(log=family[2], strategies=tuple(together[family])) for family in begun)


def _family_rank(name: str) -> tuple[int, str]:
    """The rank of a strategy's family by expense, and its name if it is a family of its own. NAME@SOLVER belongs to
    NAME's."""
    base = canonical_name(name.partition("@")[0])
    rank = next((i for i, members in enumerate(FAMILIES) if base in members), -1)
    return (rank, "" if rank >= 0 else name)
