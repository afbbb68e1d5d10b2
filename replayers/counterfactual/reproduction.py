"""Reproduction of a log: does the recorded strategy, with the beliefs of the replay, do what was recorded.

The guard of every claim: where it does not, something that the replay goes by is not what the run went by (beliefs,
weights, the strategy's code), and what it would say of other strategies is worth nothing either.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from replayers.counterfactual.bounds.search_cache import SearchCache
from replayers.counterfactual.evidence import Evidence
from replayers.counterfactual.fast_strategy import fast_strategy
from replayers.counterfactual.logged_belief import with_beliefs
from replayers.counterfactual.logged_world import LoggedWorld
from replayers.counterfactual.tree.options import zero_clock
from replayers.runs.run import Run
from workbench.beliefs.belief import Estimator
from workbench.execution.events import ActionEnded, ContainerObserved, Event, PlanMade, RunEnded, RunStatus
from workbench.execution.loop import LoopOptions, run_task
from workbench.log_schema.codec import to_wire
from workbench.log_schema.events import ActionFinished, Outcome, PlanComputed
from workbench.planning.plans import PlanStep
from workbench.planning.strategies import canonical_name, needs_truth, strategy
from workbench.planning.strategy import Strategy
from workbench.plugins import NameOrigin
from workbench.tolerances import NEAR_LOGGED_COST, NEAR_LOGGED_SUM

SIMULATED_SOURCES = ("simulation", "replay")

STOPPED = (RunStatus.ABORTED.value, RunStatus.OUT_OF_BUDGET.value)
"""Ends that no strategy decides: by an operator, a fault, or the clock. A replay goes on from there."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Reproduction:
    """What came of replaying the recorded strategy.

    Attributes:
        same: it did what was recorded; None where it cannot be replayed here.
        whole: it did so to the recorded end, and nothing else could have come: the run is what the log says, whatever
            is believed.
        why: where it did something else, what; where it cannot be replayed, why.
    """

    same: bool | None
    whole: bool = False
    why: str = ""


ByTree = Callable[[Strategy], tuple[Event, ...] | None]
"""The run of a strategy over the log alone by its tree of runs; None where only the closed loop can run it."""


def reproduce(
    run: Run,
    evidence: Evidence,
    estimator: Estimator,
    cache: SearchCache | None = None,
    *,
    by_tree: ByTree | None = None,
) -> Reproduction:
    """Replays the recorded strategy over its own log.

    Built-in strategies only: a log's name for another one is not looked up here, since it could be anybody's code.
    Of a robot's log only what the strategy decided is compared: it walked as it could, and people stepped in.

    Args:
        cache: the searches over this log; replays may share it.
        by_tree: tried first, since replays need it too: where it shows at every look what the log's look showed, and
            does all that was recorded to the recorded end, the closed loop would do the same.
    """
    name = canonical_name(run.info.strategy)
    if name is None or needs_truth(name):
        why = f"{run.info.strategy or 'no strategy'} cannot be replayed from the log alone"
        return Reproduction(same=None, why=why)
    if not _holds_every_action(run):
        return Reproduction(same=None, why="the log lacks some of the run's actions")
    planner = strategy(name, origin=NameOrigin.LOG)
    told = by_tree(planner) if by_tree is not None and evidence.perception.perfect else None
    if told is not None and _looks_as_logged(evidence, told):
        found = _compared(run, evidence, iter(told))
        if found.whole:
            return found
    planner = fast_strategy(planner, cache) if evidence.perception.perfect else planner
    return _compared(run, evidence, events_over(run, evidence, estimator, planner))


def events_over(run: Run, evidence: Evidence, estimator: Estimator, planner: Strategy) -> Iterator[Event]:
    """What a planner does over a run's own log, of which it sees what was recorded and when; nothing takes time."""
    events = run_task(
        LoggedWorld(evidence, with_paths=False, as_recorded=True),
        planner,
        estimator,
        evidence.task,
        costs=evidence.costs,
        seed=run.info.seed,
        options=LoopOptions(stopwatch=zero_clock),
        perception=evidence.perception,
    )
    return with_beliefs(events)


def _looks_as_logged(evidence: Evidence, events: tuple[Event, ...]) -> bool:
    """Whether every look of a run shows what the log's own look into that container showed, in the same order."""
    looks = (event for event in events if isinstance(event, ContainerObserved) and not event.known_at_start)
    return all(evidence.looks.get(look.container) == (look.items,) for look in looks)


def _holds_every_action(run: Run) -> bool:
    """Whether no action is missing before the log's end: messages may be damaged, dropped or left out."""
    actions = sorted(run.actions, key=lambda a: a.index)
    if [a.index for a in actions] != list(range(1, len(actions) + 1)):
        return False
    spent = sum(a.cost for a in actions)
    return run.outcome is None or not _simulated(run) or abs(spent - run.outcome.own_cost) <= NEAR_LOGGED_SUM


def _compared(run: Run, evidence: Evidence, events: Iterator[Event]) -> Reproduction:
    """Action by action in the log's order, then the end."""
    logged = sorted(run.actions, key=lambda a: a.index)
    plans = {plan.decision: plan for plan in run.plans}
    made: PlanMade | None = None
    done = 0
    for event in events:
        if isinstance(event, PlanMade):
            made = event
        elif isinstance(event, ActionEnded):
            if done == len(logged):
                return _beyond(run, event.step)
            was = logged[done]
            if (was.action, was.target, was.items, was.success) != _what(event):
                return _parted(run, was, event.step, made, plans)
            done += 1
        elif isinstance(event, RunEnded):
            return _at_end(run, evidence, event, logged[done:], made, plans)
    raise AssertionError("the loop always ends with Ended")


def _what(now: ActionEnded) -> tuple[object, ...]:
    return now.step.action, now.step.target, now.step.items, now.success


def _beyond(run: Run, now: PlanStep) -> Reproduction:
    """The log holds no more actions, and the strategy goes on."""
    if run.outcome is None or run.outcome.status in STOPPED or not _simulated(run):
        return Reproduction(same=True)
    return _other(run, f"it goes on with '{now.action} {now.target}' where the run ended ({run.outcome.status})")


def _parted(
    run: Run, was: ActionFinished, now: PlanStep, made: PlanMade | None, plans: dict[int, PlanComputed]
) -> Reproduction:
    if not _simulated(run) and _decided_alike(was, made, plans):
        return Reproduction(same=True)
    return _other(run, f"it does '{now.action} {now.target}' where the log has '{was.action} {was.target}'")


def _at_end(
    run: Run,
    evidence: Evidence,
    ended: RunEnded,
    left: Sequence[ActionFinished],
    made: PlanMade | None,
    plans: dict[int, PlanComputed],
) -> Reproduction:
    outcome = run.outcome
    if left:
        passed = evidence.passing is not None and left[0].action == "move" and ended.unseen is not None
        if passed or (left[0].action == "search" and left[0].target == ended.unseen):
            return Reproduction(same=None, why=f"the log lacks what was seen in {ended.unseen}")
        if not _simulated(run) and _decided_alike(left[0], made, plans):
            return Reproduction(same=True)
        where = f"looks into {ended.unseen}" if ended.unseen else f"ends ({ended.status.value})"
        return _other(run, f"it {where} where the log has '{left[0].action} {left[0].target}'")
    if outcome is None or outcome.status in STOPPED:
        return Reproduction(same=True)
    if not _simulated(run):
        return Reproduction(same=True, whole=ended.status.value == outcome.status)
    return _same_end(run, outcome, ended)


def _same_end(run: Run, outcome: Outcome, ended: RunEnded) -> Reproduction:
    if ended.status.value != outcome.status:
        return _other(run, f"it ends '{ended.status.value}' where the run ended '{outcome.status}'")
    if abs(ended.cost - outcome.cost) > NEAR_LOGGED_COST * max(1.0, abs(outcome.cost)):
        return _other(run, f"it costs {ended.cost:.2f} where the run cost {outcome.cost:.2f}")
    return Reproduction(same=True, whole=True)


def _simulated(run: Run) -> bool:
    return run.info.source in SIMULATED_SOURCES


def _decided_alike(was: ActionFinished, made: PlanMade | None, plans: dict[int, PlanComputed]) -> bool:
    """Whether the robot's plan began as the replay's, or is not in the log: then world or people made it differ."""
    logged = plans.get(was.decision)
    if made is None or logged is None or logged.decision != made.decision:
        return True
    return any(_beginning(logged) == _beginning(wire) for wire in to_wire(made) if isinstance(wire, PlanComputed))


def _beginning(plan: PlanComputed) -> tuple[object, ...]:
    """The first step, and where its find or the plan looks first."""
    step = plan.steps[0] if plan.steps else None
    look = plan.search_order[0].container if plan.search_order else None
    return (plan.look_on_the_way[:1], step.action, step.target, step.items, look) if step else ()


def _other(run: Run, how: str) -> Reproduction:
    why = (
        f"{run.info.strategy}, which drove this run, does not do here what was recorded: {how}. Other beliefs, "
        "weights or code decide it, so nothing is claimed of any strategy; lios replay --verify shows where they part"
    )
    return Reproduction(same=False, why=why)
