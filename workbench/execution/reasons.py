"""Why a robot decides anew, in words: the reason of its next decision."""

from __future__ import annotations

from collections.abc import Iterable

from workbench.planning.strategy import Decision
from workbench.worlds.house import ContainerId, Item, ItemType

ON_THE_WAY = "a look on the way"


def after_plan(made: Decision) -> str:
    """The reason once the steps of a decision were carried out."""
    return "the plan is done" if made.steps_now is None else "the next steps are decided anew"


def after_look(
    container: ContainerId, items: Iterable[Item], sought: tuple[ItemType, ...], *, again: bool = False, why: str = ""
) -> str:
    """The reason after a look.

    Args:
        items: what it showed.
        sought: the types that it was for.
        again: whether the container was looked into before.
        why: what the look was, where it was no step of a find.
    """
    found = sorted({item.type for item in items if item.type in sought})
    searched = f"searched {container}{' again' if again else ''}"
    seen = f"found {', '.join(found)} in {container}" if found else searched
    return f"{seen} ({why})" if why else seen
