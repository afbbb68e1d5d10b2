"""Names that are taken: what another package installs under one of ours is left out, in one line that says whose."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from workbench import cli, plugins
from workbench.beliefs.estimators import estimator
from workbench.planning.solvers.registry import solver
from workbench.planning.strategies import strategy, strategy_names
from workbench.plugins import CommandEntries, NameOrigin, PluginNotLoaded
from workbench.search.policies.registry import policy, policy_names

LOG = str(Path(__file__).parents[1] / "logs" / "find-greedy.mcap")
THEIRS = """
[lios.commands]
log = named_like_ours:looks
spot = named_like_ours:looks
record = named_like_ours:looks
record.more = named_like_ours:looks
log.cat = named_like_ours:looks
log.looks = named_like_ours:looks
looks = named_like_ours:looks
looks.more = named_like_ours:looks

[lios.strategies]
greedy = named_like_ours:looks
ModelLIOS = named_like_ours:looks
theirs = named_like_ours:looks

[lios.policies]
conditioned-lios = named_like_ours:looks

[lios.estimators]
counts = named_like_ours:looks

[lios.solvers]
built-in = named_like_ours:looks

[lios.readers]
history = named_like_ours:looks
"""
MODULE = """
class Posing:
    name = "model-lios"

    def relevant_types(self, task):
        return ()

    def decide(self, view):
        raise RuntimeError

    def order(self, query):
        raise RuntimeError

    def believe(self, knowledge, item_types):
        raise RuntimeError

    def solve(self, problem, *, budget_s):
        raise RuntimeError


class AsPolicy(Posing):
    name = "lios"


class AsEstimator(Posing):
    name = "counts"


class AsSolver(Posing):
    name = "built-in"


class One(Posing):
    name = "mine"


class Two(One):
    pass


def picked(house):
    from workbench.planning.strategies import strategy

    return strategy("model-lios")


def looks():
    \"\"\"Count looks.

    Examples:

        lios looks
    \"\"\"
    print("theirs")
"""


@pytest.fixture(autouse=True)
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Two packages that another folder of the import path installs."""
    for name, entries in (("their-tools", THEIRS), ("zebra", "[lios.strategies]\ntheirs = named_like_ours:looks\n")):
        folder = tmp_path / "site" / f"{name.replace('-', '_')}-1.0.dist-info"
        folder.mkdir(parents=True)
        (folder / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
        (folder / "entry_points.txt").write_text(entries)
    (tmp_path / "site" / "named_like_ours.py").write_text(MODULE)
    monkeypatch.syspath_prepend(str(tmp_path / "site"))
    monkeypatch.chdir(tmp_path)
    plugins.tell_left_out.cache_clear()
    yield
    plugins.tell_left_out.cache_clear()
    sys.modules.pop("named_like_ours", None)


def test_our_groups_and_commands_win_and_one_line_says_whose_is_left_out(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert cli.run(["--help"]) == 0
    shown = capsys.readouterr()
    assert shown.err.splitlines() == [
        f'note: command "{words}" of their-tools is left out: {why}. It needs another name.'
        for words, why in (
            ("log", "lios has a group of that name"),
            ("log cat", "lios has a command of that name"),
            ("looks more", '"looks" of their-tools is no group'),
            ("record", "lios has a command of that name"),
            ("record more", '"record" of lios is no group'),
            ("spot", "lios has a group of that name"),
        )
    ]
    assert "Container tools: cat, filter" in shown.out
    assert "Count looks." in shown.out, "their free names are there"
    assert cli.run(["log", "cat", LOG, "--help"]) == 0
    assert "Print messages" in capsys.readouterr().out
    assert cli.run(["log", "looks"]) == 0
    assert "theirs" in capsys.readouterr().out
    assert cli.run(["log", "nothing"]) == 2
    assert "a group of that name" in capsys.readouterr().err


def test_our_reader_of_earlier_runs_wins() -> None:
    assert [entry.value for entry in plugins.own_entries("lios.readers")] == ["replayers.memory.collect:read_history"]


def test_the_lists_of_names_say_what_is_left_out(capsys: pytest.CaptureFixture[str]) -> None:
    built_in = "a built-in one has its name. It needs another one."
    wanted = {
        "strategies": [
            f"strategy 'ModelLIOS' of their-tools is left out: {built_in}",
            f"strategy 'greedy' of their-tools is left out: {built_in}",
            "strategy 'theirs' of zebra is left out: that of their-tools has its name. It needs another one.",
        ],
        "policies": [f"search policy 'conditioned-lios' of their-tools is left out: {built_in}"],
        "estimators": [f"estimator 'counts' of their-tools is left out: {built_in}"],
        "solvers": [f"solver 'built-in' of their-tools is left out: {built_in}"],
    }
    for kind, lines in wanted.items():
        assert cli.run([kind, "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["left_out"] == lines
        assert cli.run([kind]) == 0
        assert all(f"note: {line}" in capsys.readouterr().err for line in lines[:1])
    assert strategy_names(with_truth=False)[-1] == "theirs"
    assert "greedy" not in strategy_names(with_truth=False)
    assert policy_names().count("conditioned-lios") == 1


def test_who_gives_a_name_that_a_built_in_one_has_is_told_once(capsys: pytest.CaptureFixture[str]) -> None:
    for made, name in (
        (strategy, "greedy"),
        (policy, "conditioned-lios"),
        (estimator, "counts"),
        (solver, "built-in"),
    ):
        made(name, origin=NameOrigin.LOG)
        assert capsys.readouterr().err == ""
        made(name, origin=NameOrigin.USER)
        assert f"'{name}' of their-tools is left out" in capsys.readouterr().err
        made(name, origin=NameOrigin.USER)
        assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    ("made", "name"),
    [(strategy, "Posing"), (policy, "AsPolicy"), (estimator, "AsEstimator"), (solver, "AsSolver")],
    ids=lambda value: getattr(value, "__name__", value),
)
def test_one_that_calls_itself_as_a_built_in_one_does_is_refused(made: object, name: str) -> None:
    with pytest.raises(PluginNotLoaded, match="which is the name of a built-in one"):
        made(f"named_like_ours:{name}", origin=NameOrigin.USER)  # type: ignore[operator]


def test_what_picks_a_built_in_strategy_may_call_it_by_its_name() -> None:
    assert strategy("named_like_ours:picked", origin=NameOrigin.USER) == strategy("model-lios")


def test_replays_refuse_names_that_no_table_could_tell_apart(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["replay", LOG, "-s", "named_like_ours:One,named_like_ours:Two"]) == 2
    assert "named_like_ours:One too calls itself 'mine'" in capsys.readouterr().err
    assert cli.run(["certify", LOG, "-s", "named_like_ours:Posing", "-o", "claim.lios.zip"]) == 2
    assert "which is the name of a built-in one" in capsys.readouterr().err
    assert not Path("claim.lios.zip").exists()


def test_without_other_packages_there_is_nothing_to_say(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.undo()
    assert CommandEntries().left_out == {}
