"""The lists of names: the same as the registries', one line each, defaults as the commands have them, completed."""

from __future__ import annotations

import json
from importlib.metadata import EntryPoint

import pytest
from click.shell_completion import ShellComplete

from workbench import cli, registered_names
from workbench.beliefs.estimators import ESTIMATORS
from workbench.planning.scenarios.paper import SCENARIOS
from workbench.planning.solvers.registry import SOLVERS
from workbench.planning.strategies import STRATEGIES, VARIANTS
from workbench.registered_names import completions
from workbench.search.policies.registry import POLICIES


def test_the_names_are_those_of_the_registries() -> None:
    assert tuple(registered_names.STRATEGIES) == (*STRATEGIES, *VARIANTS)
    assert tuple(registered_names.POLICIES) == tuple(POLICIES)
    assert tuple(registered_names.ESTIMATORS) == tuple(ESTIMATORS)
    assert tuple(registered_names.SCENARIOS) == ("find", *SCENARIOS)
    assert tuple(registered_names.SOLVERS) == tuple(SOLVERS)


@pytest.mark.parametrize("kind", ["strategies", "policies", "estimators", "scenarios", "solvers"])
def test_each_command_lists_every_name_in_one_line(kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run([kind, "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["rows"]
    assert [row["name"] for row in rows] == [known.name for known in registered_names.registered_names(kind)]
    assert all(row["line"] and "\n" not in row["line"] for row in rows)


def test_defaults_are_those_of_the_commands(capsys: pytest.CaptureFixture[str]) -> None:
    cli.run(["strategies", "--json"])
    default_of = {row["name"]: row["default_of"] for row in json.loads(capsys.readouterr().out)["rows"]}
    assert {"record", "spot run"} <= set(default_of["conditioned-lios"])
    assert default_of["scout-lios"] == []
    assert default_of["opt-greedy"] == ["evaluate select"]


def test_an_installed_plug_in_is_listed_and_completed(monkeypatch: pytest.MonkeyPatch) -> None:
    entry = EntryPoint(name="rooms-first", value="own_planner:RoomsFirst", group="lios.strategies")
    monkeypatch.setattr(registered_names, "installed_entries", lambda kind, built_in: (entry,))
    assert registered_names.registered_names("strategies")[-1].line == "own_planner:RoomsFirst"
    assert completions(("--strategies", "-s"), "lios,roo") == ["lios,rooms-first"]


def test_completion_takes_the_last_of_a_list_and_leaves_out_what_is_given() -> None:
    assert completions(("--strategies",), "opt-greedy,opt-l") == ["opt-greedy,opt-lios"]
    assert completions(("--estimator",), "") == list(ESTIMATORS)
    assert completions(("--output", "-o"), "") == []


@pytest.mark.parametrize(
    ("words", "option", "begun", "wanted"),
    [
        (["record"], "--strategy", "scout", "scout-lios"),
        (["evaluate", "search"], "--policies", "most", "most-probable"),
        (["evaluate", "tasks"], "--scenarios", "any", "any-of-three"),
        (["plan"], "--solver", "sas-a", "sas-anytime"),
        (["replay"], "-s", "pes-l", "pes-lios"),
    ],
)
def test_tab_completes_values(words: list[str], option: str, begun: str, wanted: str) -> None:
    items = ShellComplete(cli.app(), {}, "lios", "_LIOS_COMPLETE").get_completions([*words, option], begun)
    assert [item.value for item in items] == [wanted]
