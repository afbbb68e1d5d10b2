"""A belief that notes which of its rows were read, so that a decision is known to rest on these alone.

A row counts as read once it was handed out, whether its numbers were used or not: by `of` and `only` the rows that
are asked for, by `probability` (and so by anything else that is done with a belief) all of them. The axes are free:
they say where one may look, and nothing of what is there.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, final

from workbench.arrays import Floats
from workbench.beliefs.belief import Belief
from workbench.planning.strategy import Decision, Strategy, View
from workbench.worlds.house import ItemType

Read = tuple[ItemType, ...]
"""Item types whose rows of a belief were read, sorted."""


@final
class WatchedBelief(Belief):
    """A belief as any other.

    Attributes:
        read: the item types whose rows were read.
    """

    __slots__ = ("read",)

    read: set[ItemType]

    def __post_init__(self) -> None:
        object.__setattr__(self, "read", set[ItemType]())
        super().__post_init__()
        self.read.clear()

    def __getattribute__(self, name: str) -> Any:
        if name == "probability":
            self.read.update(self.item_types)
        return super().__getattribute__(name)

    def of(self, item_type: ItemType) -> Floats:
        self.read.add(item_type)
        return self._rows[self.item_types.index(item_type)]

    def only(self, item_types: tuple[ItemType, ...]) -> Belief:
        self.read.update(t for t in item_types if t in self.item_types)
        plain = Belief(
            item_types=self.item_types,
            containers=self.containers,
            probability=self._rows,
            estimator=self.estimator,
            p_detect=self.p_detect,
        )
        return plain.only(item_types)

    @property
    def _rows(self) -> Floats:
        return super().__getattribute__("probability")


def watched(belief: Belief) -> WatchedBelief:
    """The same belief, none of whose rows was read yet."""
    return WatchedBelief(
        item_types=belief.item_types,
        containers=belief.containers,
        probability=belief.probability,
        estimator=belief.estimator,
        p_detect=belief.p_detect,
    )


def decide_watched(strategy: Strategy, view: View) -> tuple[Decision, Read]:
    """A strategy's decision, and which rows of the view's belief it read for it."""
    belief = watched(view.belief)
    made = strategy.decide(replace(view, belief=belief))
    return made, tuple(sorted(belief.read))
