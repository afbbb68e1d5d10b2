"""Events told from the first segment of a tree are those of the closed loop over the log alone."""

from __future__ import annotations

from pathlib import Path

import pytest
from toy import BED, DESK
from toy_logs import delivered, simulated_log, task_of

from replayers import read
from replayers.counterfactual import single_runs
from replayers.counterfactual.prepared_log import PreparedLog, ReplaySettings, prepare_log
from replayers.counterfactual.relevance import Assumptions
from replayers.counterfactual.replay import run_tree_of
from replayers.counterfactual.single_runs import over_log_alone, over_log_by_tree
from workbench.execution.events import ActionEnded, ContainerObserved, Event, RunEnded
from workbench.planning.strategies import strategy
from workbench.planning.strategy import Strategy
from workbench.planning.tasks import AllOf
from workbench.worlds.house import ItemType

LOGS = Path(__file__).parents[2] / "logs"


def prepared_for(log: str, *, misses: int | None = None) -> PreparedLog:
    settings = ReplaySettings(worlds=0, assumptions=Assumptions(misses=misses))
    return prepare_log(read(LOGS / f"{log}.mcap"), settings, with_paths=False)


def acts_of(events: tuple[Event, ...]) -> list[Event]:
    """The actions, looks and the end of a run."""
    return [event for event in events if isinstance(event, ActionEnded | ContainerObserved | RunEnded)]


@pytest.mark.parametrize("log", ["deliver-3", "find-lios", "spot-home-C", "cut-off"])
@pytest.mark.parametrize("name", ["opt-greedy", "model-lios", "conditioned-lios", "scout-lios"])
def test_every_action_and_look_is_that_of_the_closed_loop(
    log: str, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    prepared = prepared_for(log)
    tree = run_tree_of(prepared, strategy(name))
    looped = acts_of(over_log_alone(prepared, tree.planner))
    monkeypatch.setattr(single_runs, "over_log_alone", None)  # the loop is not run again
    told = over_log_by_tree(prepared, tree)
    assert list(told) == looped


def test_what_was_put_down_before_a_look_is_among_what_it_shows(tmp_path: Path) -> None:
    egg, book = ItemType("Egg"), ItemType("Book")
    task = task_of(AllOf(parts=(delivered(egg, BED), delivered(book, DESK))))
    log = simulated_log(tmp_path / "run.mcap", name="opt-greedy", task=task)
    prepared = prepare_log(read(log), ReplaySettings(worlds=0), with_paths=False)
    tree = run_tree_of(prepared, strategy("opt-greedy"))
    told, looped = over_log_by_tree(prepared, tree), acts_of(over_log_alone(prepared, tree.planner))
    assert list(told) == looped
    shown = next(e.items for e in told if isinstance(e, ContainerObserved) and e.container == BED)
    assert [item.type for item in shown] == ["Pillow", "Book", "Egg"]


def test_a_log_whose_looks_may_have_missed_is_left_to_the_closed_loop(monkeypatch: pytest.MonkeyPatch) -> None:
    prepared = prepared_for("find-lios", misses=1)
    tree = run_tree_of(prepared, strategy("opt-greedy"))
    looped = over_log_alone(prepared, tree.planner)

    def in_loop(prepared: PreparedLog, planner: Strategy) -> tuple[Event, ...]:
        return looped

    monkeypatch.setattr(single_runs, "over_log_alone", in_loop)
    assert over_log_by_tree(prepared, tree) is looped
