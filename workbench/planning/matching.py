"""Bipartite matching of wants to different items, by augmenting paths (Kuhn 1955).

Enumerating assignments would take exponential time where many wants ask for the same type.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import TypeVar

T = TypeVar("T", bound=Hashable)


def has_perfect_matching(choices: Sequence[Sequence[T]]) -> bool:
    """Whether one item can be chosen from each set of choices, all different."""
    if not all(choices):
        return False
    taken: dict[T, int] = {}
    return all(_augment(want, choices, taken, set()) for want in range(len(choices)))


def _augment(want: int, choices: Sequence[Sequence[T]], taken: dict[T, int], asked: set[T]) -> bool:
    """Assign an item to a want, reassigning other wants along an augmenting path if needed."""
    for thing in choices[want]:
        if thing in asked:
            continue
        asked.add(thing)
        if thing not in taken or _augment(taken[thing], choices, taken, asked):
            taken[thing] = want
            return True
    return False
