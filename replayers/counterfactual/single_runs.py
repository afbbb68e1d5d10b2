"""Single runs of a strategy over a log: over what the log alone shows, and in the recorded truth."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

from replayers.counterfactual.decisions.memoized_strategy import MemoizedStrategy
from replayers.counterfactual.logged_belief import with_beliefs
from replayers.counterfactual.logged_world import LoggedWorld
from replayers.counterfactual.prepared_log import PreparedLog, run_by_tree
from replayers.counterfactual.run_tree import RunTree
from replayers.counterfactual.tree.options import MAX_STEPS, zero_clock
from workbench.execution.events import ActionEnded, ContainerObserved, Event, RunEnded
from workbench.execution.loop import LoopOptions, run_task
from workbench.planning.strategy import Strategy
from workbench.worlds.house import ContainerId, Item
from workbench.worlds.knowledge import Knowledge


def over_log_alone(prepared: PreparedLog, planner: Strategy) -> tuple[Event, ...]:
    """The run over what the log holds and nothing else; it ends undetermined at the first unopened container.

    Looks are believed, and tags in passing are seen where the log shows so; that looks may have missed something, and
    that a tag may not be seen, is in the bounds.
    """
    literal, again = replace(prepared.evidence, misses=0), prepared.is_driven_again(planner)
    world = LoggedWorld(literal, durations=prepared.durations, paths=prepared.paths, as_recorded=again, turns=True)
    return run_in(prepared, planner, world)


def over_log_by_tree(prepared: PreparedLog, tree: RunTree) -> tuple[Event, ...]:
    """The same run of a tree's strategy, from the tree's first segment where that needed no closed loop."""
    if prepared.is_plain and isinstance(tree.planner, MemoizedStrategy):
        told = run_by_tree(prepared, tree)
        if told is not None:
            return told
    return over_log_alone(prepared, tree.planner)


def in_truth(prepared: PreparedLog, planner: Strategy) -> tuple[Event, ...]:
    """The run in the recorded truth."""
    assert prepared.truth is not None, "asked for the truth of a log without one"
    contents, shown = prepared.truth.contents, prepared.evidence.contents
    in_all = sum(len(items) for items in contents.values())

    def true_contents(container: ContainerId, knowledge: Knowledge) -> tuple[Item, ...]:
        seen = {item.id for item in shown.get(container, ())}
        return tuple(item for item in contents[container] if item.id not in seen)

    evidence, again = replace(prepared.evidence, misses=in_all), prepared.is_driven_again(planner)
    world = LoggedWorld(
        evidence, filling=true_contents, durations=prepared.durations, paths=prepared.paths, as_recorded=again
    )
    return run_in(prepared, planner, world)


def support_of(events: tuple[Event, ...]) -> dict[str, int]:
    """How many steps have which support: logged, implied, imputed."""
    counted = Counter(e.support for e in events if isinstance(e, ActionEnded | ContainerObserved) and e.support)
    return dict(sorted(counted.items()))


def run_in(prepared: PreparedLog, planner: Strategy, world: LoggedWorld) -> tuple[Event, ...]:
    """The run in a world of the log.

    Raises:
        BeliefMissing: the estimator gave none.
    """
    evidence = prepared.evidence
    events = run_task(
        world,
        planner,
        prepared.estimator_of(planner),
        evidence.task,
        costs=evidence.costs,
        seed=evidence.info.seed,
        options=LoopOptions(max_steps=MAX_STEPS, stopwatch=zero_clock),
    )
    return tuple(with_beliefs(events))


def end_of(events: tuple[Event, ...]) -> RunEnded:
    """The end of a run."""
    ended = events[-1]
    assert isinstance(ended, RunEnded), "the loop always ends with Ended"
    return ended
