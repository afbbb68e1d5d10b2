"""Can every want have a thing of its own? Bipartite matching by augmenting paths (Kuhn 1955).

Trying every assignment takes forever where many wants ask for the same type.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import TypeVar

T = TypeVar("T", bound=Hashable)


def each_has_its_own(choices: Sequence[Sequence[T]]) -> bool:
    """Whether different things can be chosen, one from each of the choices."""
    if not all(choices):
        return False
    taken: dict[T, int] = {}
    return all(_finds(want, choices, taken, set()) for want in range(len(choices)))


def _finds(want: int, choices: Sequence[Sequence[T]], taken: dict[T, int], asked: set[T]) -> bool:
    """Takes a thing for a want, moving others to other things where that helps."""
    for thing in choices[want]:
        if thing in asked:
            continue
        asked.add(thing)
        if thing not in taken or _finds(taken[thing], choices, taken, asked):
            taken[thing] = want
            return True
    return False
