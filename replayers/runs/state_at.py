"""The robot's knowledge at a decision, rebuilt from the observations and actions before it in the log."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from replayers.runs.run import Run
from workbench.beliefs.belief import Belief
from workbench.errors import BadValue, NotFound
from workbench.log_schema.events import NANO, ActionFinished, BeliefUpdate, ItemSighting, SeenItem
from workbench.log_schema.sight_json import sight_from_settings
from workbench.log_schema.tags_in_passing_json import tags_from_settings
from workbench.planning.actions import BY_NAME, facts_after
from workbench.planning.plans import PlanStep
from workbench.planning.strategy import View
from workbench.tolerances import NEAR_SHOWN_S
from workbench.worlds.house import ContainerId, Item, ItemId, ItemType, LocationId
from workbench.worlds.knowledge import Knowledge
from workbench.worlds.sight.sightings import sight_paths


class NoSuchDecision(NotFound):
    """A log has no decision at that moment."""

    def __init__(self, run: Run, what: str) -> None:
        if not run.plans:
            super().__init__(
                f"{run.path}: it holds no decision: it records what a robot did, and no plan. "
                "Import the bag with --task TASK -s model-lios, which computes decisions after the fact."
            )
            return
        last = run.plans[-1].decision
        super().__init__(f"{run.path}: no decision {what}. It has decisions 1 to {last}; see lios info.")


@dataclass(frozen=True, slots=True, kw_only=True)
class Moment:
    """A decision of a run and the view that it was made with."""

    decision: int
    view: View


def decision_at(run: Run, seconds: float) -> int:
    """The last decision made by that many seconds after the run's first event; the first, where none was made yet.

    Raises:
        NoSuchDecision: the log has none.
        BadValue: a moment before the run, or after its end.
    """
    if not run.plans:
        raise NoSuchDecision(run, f"at {seconds:g} s")
    start = min(event.stamp.ns for event in (*run.observations, *run.beliefs, *run.plans))
    ends = () if run.outcome is None else (run.outcome,)
    lasts_s = (max(event.stamp.ns for event in (*run.plans, *run.actions, *ends)) - start) / NANO
    if not 0 <= seconds <= lasts_s + NEAR_SHOWN_S:
        raise BadValue("--at", f"{seconds:g}", f"within the run, 0 to {lasts_s:.1f} seconds")
    made = [plan.decision for plan in run.plans if plan.stamp.ns - start <= seconds * 1e9]
    return made[-1] if made else run.plans[0].decision


def moment_of(run: Run, decision: int) -> Moment:
    """The view of a decision.

    Raises:
        NoSuchDecision: the run has no such decision.
    """
    belief = next((b for b in run.beliefs if b.decision == decision), None)
    if belief is None:
        raise NoSuchDecision(run, str(decision))
    knowledge = _knowledge_before(run, decision)
    return Moment(
        decision=decision,
        view=View(
            knowledge=knowledge,
            belief=_belief(belief),
            task=run.task,
            costs=run.costs,
            budget_s=run.task.budget_s,
            seed=run.info.seed,
        ),
    )


def _knowledge_before(run: Run, decision: int) -> Knowledge:
    knowledge = Knowledge(plan=run.place.plan, travel=run.place.travel)
    place = run.place
    sees = sight_paths(place.plan, place.travel, place.paths(), sight_from_settings(run.settings))
    paths = sees or tags_from_settings(run.settings, place)
    for observation in run.observations:
        if observation.known_at_start:
            knowledge = knowledge.seen(ContainerId(observation.container), _items(observation.items), in_run=False)
    events = [(o.stamp.ns, 1, o) for o in run.observations if not o.known_at_start and o.decision < decision]
    events += [(s.stamp.ns, 1, s) for s in run.sightings if s.decision < decision]
    events += [(a.stamp.ns, 0, a) for a in run.actions if a.decision < decision]
    for _, _, event in sorted(events, key=lambda entry: entry[:2]):
        if isinstance(event, ActionFinished):
            knowledge = _after_action(knowledge, event)
            if paths is not None:
                knowledge = replace(knowledge, travel=paths.travel_from(knowledge.robot_at))
        elif isinstance(event, ItemSighting):
            (item,) = _items((event.item,))
            knowledge = knowledge.sighted(ContainerId(event.container), item)
        else:
            knowledge = knowledge.seen(ContainerId(event.container), _items(event.items))
    return knowledge


def _after_action(knowledge: Knowledge, action: ActionFinished) -> Knowledge:
    if not action.success:
        if action.action == "pick" and action.items and not action.item_remains:
            return knowledge.without_item(ItemId(action.items[0]))
        return knowledge.refuse_search(ContainerId(action.target)) if action.action == "search" else knowledge
    if action.action == "move":
        return knowledge.moved(LocationId(action.target))
    if action.action == "pick":
        return knowledge.picked(Item(id=ItemId(action.items[0]), type=ItemType(action.item_types[0])))
    if action.action == "place":
        return knowledge.placed()
    if action.action in BY_NAME:
        step = PlanStep(
            action=action.action,
            origin=LocationId(action.origin),
            target=LocationId(action.target),
            items=tuple(ItemId(item) for item in action.items),
        )
        return knowledge.with_facts(facts_after(step, knowledge.facts))
    return knowledge


def _items(seen: tuple[SeenItem, ...]) -> tuple[Item, ...]:
    return tuple(Item(id=ItemId(item.id), type=ItemType(item.type)) for item in seen)


def _belief(update: BeliefUpdate) -> Belief:
    shape = (len(update.item_types), len(update.containers))
    return Belief(
        item_types=tuple(ItemType(name) for name in update.item_types),
        containers=tuple(ContainerId(name) for name in update.containers),
        probability=np.array(update.probability, dtype=np.float64).reshape(shape),
        estimator=update.estimator,
    )
