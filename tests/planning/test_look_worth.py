"""What a look is worth agrees with the search done twice: with the container and without it."""

from __future__ import annotations

import numpy as np
import pytest
from toy import BED, toy_plan, toy_travel

from workbench.beliefs.belief import Belief
from workbench.planning.look_worth import search_of, worth_of_looks
from workbench.planning.plans import PlanStep
from workbench.planning.strategy import View
from workbench.planning.tasks import find_task
from workbench.search.costs import SIMULATION
from workbench.search.orders import along
from workbench.search.places import Places
from workbench.search.policies import policy
from workbench.worlds.house import START, ItemType, LocationId
from workbench.worlds.knowledge import knowledge_at_start

MUG = ItemType("Mug")
FIND = PlanStep(action="find", origin=START, target=LocationId(BED), item_types=(MUG,))


def view_of(probability: list[float]) -> View:
    knowledge = knowledge_at_start(toy_plan(), toy_travel(), {})
    belief = Belief(
        item_types=(MUG,), containers=knowledge.unsearched, probability=np.array([probability]), estimator="by hand"
    )
    task = find_task(MUG, LocationId(BED))
    return View(knowledge=knowledge, belief=belief, task=task, costs=SIMULATION, budget_s=10.0)


def with_chances(here: Places, chance: np.ndarray, *, empty: int | None = None) -> Places:
    """The places with these chances before it is known that an instance exists; `empty` is known not to hold one."""
    held = chance.copy()
    if empty is not None:
        held[empty] = 0.0
    return Places(
        containers=here.containers,
        probability=held[None],
        from_m=here.from_m,
        to_m=here.to_m,
        between_m=here.between_m,
    )


@pytest.mark.parametrize("probability", [[0.3, 0.2, 0.4, 0.1, 0.3], [0.9, 0.05, 0.6, 0.2, 0.0]])
def test_a_look_saves_what_the_search_costs_less_after_it(probability: list[float]) -> None:
    view = view_of(probability)
    search = search_of(FIND, view, policy("full-lios"))
    here, order, chance = search.here, search.order, search.chance
    plain = along(order, with_chances(here, chance), model="exists", costs=SIMULATION).cost
    worth = worth_of_looks([FIND], view, policy("full-lios"))
    exists = 1 - np.prod(1 - chance)
    for k, index in enumerate(order):
        rest = np.delete(order, k)
        later = along(rest, with_chances(here, chance, empty=int(index)), model="exists", costs=SIMULATION).cost
        p = chance[index] / exists
        fetched = here.from_m[0, index] + 5 + here.to_m[index, 0]
        by_hand = max(plain - p * fetched - (1 - p) * later, 0.0)
        assert worth[here.containers[index]] == pytest.approx(by_hand, abs=1e-9)


def test_where_nothing_can_be_a_look_is_worth_what_it_spares() -> None:
    worth = worth_of_looks([FIND], view_of([1.0, 0.0, 0.0, 0.0, 0.0]), policy("full-lios"))
    assert all(value >= 0 for value in worth.values())
    assert max(worth.values()) < 1e-6, "it is known where it is: no look tells anything"


def test_nothing_sought_is_worth_nothing() -> None:
    assert set(worth_of_looks([], view_of([0.2] * 5), policy("full-lios")).values()) == {0.0}
