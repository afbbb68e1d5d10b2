"""What do preparing actions bring about? One table: the property, and which of its items gets it."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from workbench.planning.plans import PlanStep
from workbench.worlds.knowledge import Fact

EFFECTS: Mapping[str, tuple[str, int]] = MappingProxyType(
    {
        "boil": ("boiled", 0),
        "peel": ("peeled", 0),
        "toast": ("toasted", 0),
        "pour-water": ("filled", 1),
        "make-coffee": ("brewed", 1),
        "pour-coffee": ("coffee", 1),
    }
)
"""action -> (property, index into the step's items of the item that gets it).

Items by action: boil (food, vessel); peel (food, knife); toast (bread, toaster); pour-water (bottle, vessel);
make-coffee (grinds, vessel); pour-coffee (vessel, cup).
"""


def facts_after(step: PlanStep, facts: frozenset[Fact]) -> frozenset[Fact]:
    """The facts after a preparing step. Raises KeyError for another kind of step."""
    prop, index = EFFECTS[step.action]
    return facts | {(prop, (step.items[index],))}
