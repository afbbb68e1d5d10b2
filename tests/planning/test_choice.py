"""The compiled choice of a first step agrees with the same in numpy, on states drawn at random."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from toy import BED, COUNTER, DESK, TABLE, item, toy_plan, toy_travel

from replayers.counterfactual.decisions.watched_belief import watched
from workbench.arrays import Floats
from workbench.beliefs.belief import Belief
from workbench.planning.rollouts import choice, kernels
from workbench.planning.rollouts.delivery_state import DeliveryState
from workbench.planning.rollouts.situations import Delivery, delivery_of
from workbench.planning.strategy import View
from workbench.planning.tasks import AllOf, Delivered, Task
from workbench.search.costs import ROBOT_COSTS
from workbench.search.ties import first_least, ranked, tolerance
from workbench.worlds.house import ItemType, LocationId
from workbench.worlds.knowledge import Knowledge, knowledge_at_start

WANTS = tuple(
    Delivered(item_type=ItemType(t), at=LocationId(at)) for t, at in (("Mug", BED), ("Book", DESK), ("Egg", TABLE))
)
WORLDS, LOOKS = 30, 3


def drawn_state(rng: np.random.Generator) -> Delivery:
    """Three wants, one of which may be known or in hand; several containers are as good as one another."""
    knowledge = knowledge_at_start(toy_plan(), toy_travel(), {})
    if rng.random() < 0.7:
        knowledge = knowledge.seen(COUNTER, (item("Mug|1"), item("Mug|2")))
        if rng.random() < 0.4:
            knowledge = knowledge.moved(LocationId(COUNTER)).picked(item("Mug|1"))
    chances = rng.choice([0.0, 0.1, 0.3, 0.3 + 1e-12], size=(len(WANTS), len(knowledge.unsearched)))
    made = delivery_of(view_of(chances, knowledge))
    assert made is not None
    return made


def view_of(chances: Floats, knowledge: Knowledge) -> View:
    task = Task(scenario="own", goal=AllOf(parts=WANTS), failure_cost=400.0, budget_s=60.0)
    types = tuple(want.item_type for want in WANTS)
    belief = Belief(item_types=types, containers=knowledge.unsearched, probability=chances, estimator="by hand")
    return View(knowledge=knowledge, belief=belief, task=task, costs=ROBOT_COSTS, budget_s=60.0)


def steps_in_numpy(own: int, of: Delivery) -> list[int]:
    here, n = of.situation, len(of.containers)
    errands = [n + k for k in of.open if here.known[k] > 0] if here.hand < 0 else []
    chance = here.chance[list(of.open)]
    everything = chance.sum(axis=0)
    if not everything.any():
        return [own]
    from_m = here.metres[here.robot, here.containers]
    to_m = here.metres[here.containers[:, None], here.targets[list(of.open)]]
    onward = choice.leads_to(own, here)
    detour = from_m + here.metres[here.containers, onward] - here.metres[here.robot, onward]
    worths = np.stack(
        [
            (chance / (1.0 + from_m + to_m.T / 2.0)).max(axis=0),
            everything / (1.0 + from_m),
            everything / (choice.NEGLIGIBLE_DETOUR_M + detour),
        ]
    )
    mixed = dict.fromkeys(ranked(worths, min_scale=0.0).T.ravel().tolist())
    looks = islice((a for a in mixed if everything[a] > 0), LOOKS)
    return [own, *(step for step in (*errands, *looks) if step != own)]


def best_in_numpy(steps: list[int], here: DeliveryState, shows: np.ndarray) -> int:
    few = WORLDS // choice.SCREENING_FRACTION
    costs: Floats = kernels.rollout_costs(np.array(steps), here, shows)
    means = costs[:, :few].mean(axis=1)
    behind = costs[:, :few] - costs[first_least(means), :few]
    apart = choice.REJECT_STANDARD_ERRORS * behind.std(axis=1) / np.sqrt(few)
    kept = np.flatnonzero(behind.mean(axis=1) <= apart + tolerance(float(means.min())))
    return steps[kept[first_least(costs[kept].mean(axis=1))]]


@pytest.mark.parametrize("seed", range(40))
def test_the_choice_is_that_of_numpy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    of = drawn_state(rng)
    here, n = of.situation, len(of.containers)
    own = n + here.hand if here.hand >= 0 else int(rng.integers(n))
    steps = steps_in_numpy(own, of)
    assert choice.candidate_steps(own, LOOKS, here).tolist() == steps
    even, uniform = rng.random((len(of.open), WORLDS)), rng.random((len(of.open), WORLDS, n))
    shows = np.zeros((WORLDS, n), dtype=np.uint8)
    for i, want in enumerate(of.open):
        choice.sample_worlds(here.chance[want], bool(here.find[want] >= 0), even[i], uniform[i], want, shows)
    best = best_in_numpy(steps, here, shows) if len(steps) > 1 else own
    assert choice.best_first_step(own, LOOKS, here, even, uniform) == (best, choice.leads_to(best, here))


def test_only_the_rows_of_what_is_left_are_read() -> None:
    """A replay takes a decision to be the same in worlds that differ in rows which it did not read."""
    view = view_of(np.full((3, 4), 0.3), knowledge_at_start(toy_plan(), toy_travel(), {}).seen(BED, (item("Mug|1"),)))
    belief = watched(view.belief)
    assert delivery_of(replace(view, belief=belief)) is not None
    assert belief.read == {"Book", "Egg"}, "the mug is where it is wanted"


def test_every_state_is_of_one_type_for_the_compiler() -> None:
    """Another order of memory, or an array that may not be written, would be compiled, or loaded, once more."""
    for seed in range(20):
        of = drawn_state(np.random.default_rng(seed))
        choice.candidate_steps(0, LOOKS, of.situation)
    assert len(choice.candidate_steps.signatures) == 1  # type: ignore[attr-defined]
