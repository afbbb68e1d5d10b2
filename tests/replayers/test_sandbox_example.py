"""The example package of docs/replay.md: a plug-in planner does what the page says."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest
from toy_logs import Even, simulated_log, task_of, toy_evidence

from replayers.counterfactual.bounds.bounds import Budget
from replayers.counterfactual.bounds.branch_and_bound import bounds_of
from replayers.counterfactual.relevance import Assumptions, relevance_of
from replayers.counterfactual.replay import ReplaySettings, prepare_log, replay_on
from replayers.counterfactual.run_tree import RunTree
from replayers.counterfactual.sandbox import load_foreign
from replayers.runs.run import read
from workbench.execution.events import RunStatus
from workbench.planning.strategies import strategy_plugin
from workbench.planning.strategy import Strategy
from workbench.planning.tasks import AllOf
from workbench.plugins import NameOrigin

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "own_planner"


@pytest.fixture(autouse=True)
def _found_from_its_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(EXAMPLE / "src"))


def own(name: str) -> Strategy:
    return load_foreign(strategy_plugin(name, origin=NameOrigin.USER))


def test_it_is_replayed_by_module_and_class(tmp_path: Path) -> None:
    prepared = prepare_log(read(simulated_log(tmp_path / "run.mcap", name="opt-greedy")), ReplaySettings(worlds=20))
    made = replay_on(prepared, "own_planner:RoomsFirst", origin=NameOrigin.USER)
    assert made.strategy == "rooms-first"
    assert made.status in (RunStatus.DONE, RunStatus.UNDETERMINED)
    assert made.bounds is not None
    assert made.bounds.complete
    assert not made.bounds.can_fail


def test_it_searches_the_room_at_hand_first(tmp_path: Path) -> None:
    """From the start: table (1 m), then the kitchen's counter (3 m) with its mug, and back (2 m): 1 + 3 + 5 + 2."""
    planner, evidence = own("own_planner:RoomsFirst"), toy_evidence(tmp_path)
    relevance = relevance_of(evidence, planner.relevant_types(evidence.task), Assumptions())
    bounds = bounds_of(RunTree(evidence, planner, Even(), relevance), budget=Budget())
    assert (bounds.lower, bounds.upper) == (11.0, 11.0)


def test_what_it_does_not_do_is_a_failed_run_and_not_a_crash(tmp_path: Path) -> None:
    planner = own("own_planner:RoomsFirst")
    evidence = toy_evidence(tmp_path, task_of(AllOf(parts=())))
    relevance = relevance_of(evidence, planner.relevant_types(evidence.task), Assumptions())
    assert bounds_of(RunTree(evidence, planner, Even(), relevance), budget=Budget()).lower == 0.0


def test_its_entry_point_names_what_is_there() -> None:
    project = tomllib.loads((EXAMPLE / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    (name, target), *_ = project["entry-points"]["lios.strategies"].items()
    assert own(target).name == name == "rooms-first"


def test_the_page_shows_the_planner_as_it_is() -> None:
    page = (EXAMPLE.parents[1] / "docs" / "replay.md").read_text(encoding="utf-8")
    code = (EXAMPLE / "src" / "own_planner" / "__init__.py").read_text(encoding="utf-8")
    assert code[code.index("class RoomsFirst") :].strip() in page
