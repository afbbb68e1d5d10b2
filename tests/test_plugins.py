"""Names of plug-ins: a user's may come from the working folder, and a log's run built-in and installed code alone.

A folder as a stranger could send it: a log whose every name asks for code of its author, and beside it what these
names would run. All of that only writes a marker file. Every command and function that reads a log meets it.
"""

from __future__ import annotations

import ast
import os
import sys
import tomllib
from collections.abc import Callable, Iterator
from importlib.metadata import EntryPoint
from pathlib import Path

import msgspec
import pytest
from product_source import nodes
from sample_logs import record_run, toy_events, toy_info, toy_options

from dashboards.viser_app.serving import open_dashboard
from replayers.batch.recorded_strategy import UnknownRecordedStrategy
from replayers.batch.replan import replan
from replayers.batch.verify import verify
from replayers.counterfactual.evidence import evidence_of
from replayers.counterfactual.logged_belief import NoBelief, estimator_for
from replayers.counterfactual.replay import ReplaySettings, prepare_log, replay, replay_on
from replayers.runs.run import Run, read
from replayers.tables.frames import read_many
from workbench import cli, plugins
from workbench.beliefs.estimators import estimator
from workbench.errors import LiosError, UnknownName
from workbench.evaluation.tasks.experiment import TaskRequest
from workbench.evaluation.tasks.rows import SETTINGS_FILE, TRIALS_FILE, TaskRow
from workbench.evaluation.tasks.store import TrialStore
from workbench.planning.solvers.registry import installed_solver, solver
from workbench.planning.strategies import needs_truth, strategy, strategy_names
from workbench.plugins import NameOrigin, NotFromLog, PluginNotLoaded, installed_module, plugin
from workbench.search.policies.registry import policy
from workbench.worlds.house import ItemType

MUG = ItemType("Mug")

ROOT = Path(__file__).resolve().parents[1]

MODULE = """
from pathlib import Path

Path(r"{marker}").touch()


class Planner:
    name = "planned-by-a-stranger"

    def relevant_types(self, task):
        return ()

    def decide(self, view):
        raise RuntimeError

    def solve(self, problem, *, budget_s):
        raise RuntimeError

    def believe(self, knowledge, item_types):
        raise RuntimeError

    def order(self, query):
        raise RuntimeError
"""
"""A strategy, solver, estimator and policy in one; importing it leaves the marker."""

STRATEGIES = (
    "stranger:Planner",
    "model-lios@command:touch {marker} {{domain}} {{problem}} {{plan}}",
    "model-lios@stranger:Planner",
    "planted",
    "model-lios@planted",
)
"""As a log may name them. `planted` is an entry point of a package that merely lies in the folder."""

COMMANDS: dict[str, tuple[str, ...]] = {
    "plan": ("plan {log}", "plan {log} --solver built-in", "plan {log} -s opt-greedy", "plan {log} -o {out}/plan"),
    "replay": (
        "replay {log} --verify",
        "replay {log} --worlds 0",
        "replay {log} -s opt-greedy --worlds 5 --look-next -o {out}/replays --write best",
        "replay {log} -s opt-greedy --worlds 0 --estimator counts",
        "replay {log} -s opt-greedy --worlds 0 -o {out}/replays",
    ),
    "select": ("select {log} -s opt-greedy,pes-greedy --worlds 0",),
    "certify": ("certify {log} -o {out}/claim.lios.zip",),
    "learn-moves": ("learn-moves {folder} -o {out}/rates.csv",),
    "compare": ("replay {log} -s opt-greedy,pes-greedy --worlds 0 -o {out}/kept", "compare {out}/kept"),
    "figures": ("figures {log} -o {out}/figures --format png",),
    "capsule": ("capsule {log} -o {out}/run.html",),
    "report": ("report {tables}",),
    "info": ("info {log}", "info {log} --json"),
    "list": ("list {folder}",),
    "doctor": ("doctor {log}",),
    "recover": ("recover {log} -o {out}/recovered.mcap",),
    "export": ("export {log} -o {out}/tables --partition-by place,scenario,strategy,run_id",),
    "log.cat": ("log cat {log}",),
    "log.filter": ("log filter {log} -o {out}/filtered.mcap",),
    "log.merge": ("log merge {log} {log} -o {out}/merged.mcap",),
    "log.split": ("log split {log} -o {out}/part.mcap --every 5",),
    "log.compact": ("log compact {log} -o {out}/compact.mcap",),
    "log.convert": ("log convert {log} -o {out}/lines.jsonl",),
    "log.note": ("log note {log} noted",),
    "site.from-log": ("site from-log {log} -o {out}/site",),
}
"""Every command that reads a log or what was made of one. `view` is met through what it calls."""

SLOW = ("figures", "report")
"""Met with one log of all names' kinds instead of each."""

LISTS_OF_NAMES = {"strategies", "policies", "estimators", "scenarios", "solvers"}
NO_LOGS = {"demo", "record", "train", "import", "upload", "view", "serve", "render", *LISTS_OF_NAMES}
NO_LOGS |= {"site.check", "site.from-graph-nav"}
"""Commands that read none, serve, which resolves no names, and view and render, which open the log as the test of the
dashboard does."""


class Stranger:
    """The folder, with a log for each of the names."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.out, self.marker = folder, folder / "out", folder / "MARKER"
        (folder / "stranger.py").write_text(MODULE.format(marker=self.marker), encoding="utf-8")
        for package in ("up_fast_downward", "planted_extra"):
            (folder / package).mkdir()
            (folder / package / "__init__.py").write_text(MODULE.format(marker=self.marker), encoding="utf-8")
        metadata = folder / "planted-1.0.dist-info"
        metadata.mkdir()
        (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: planted\nVersion: 1.0\n", encoding="utf-8")
        groups = ("strategies", "policies", "estimators", "solvers")
        entries = "".join(f"[lios.{group}]\nplanted = stranger:Planner\n" for group in groups)
        (metadata / "entry_points.txt").write_text(entries, encoding="utf-8")
        self.strategies = tuple(name.format(marker=self.marker) for name in STRATEGIES)
        weights = str(folder / "weights.safetensors")
        estimators = ("stranger:Planner", weights, "planted@1a2b3c4d", "planted", "stranger:Planner@1a2b3c4d")
        self.logs: list[Path] = []
        (folder / "logs").mkdir()
        for number, (name, believer) in enumerate(zip(self.strategies, estimators, strict=True)):
            info = toy_info(
                strategy=name,
                estimator=believer,
                place=str(folder / "site.yaml"),
                scenario=str(folder / "scenario.yaml"),
                run_id=f"../../escaped-{number}",
                title="stranger:Planner",
            )
            self.logs.append(folder / "logs" / f"run{number}.mcap")
            record_run(self.logs[-1], iter(toy_events()), **{**toy_options(), "info": info})  # type: ignore[arg-type]

    def assert_nothing_ran(self) -> None:
        assert not self.marker.exists(), "a name of the log ran code"
        assert "stranger" not in sys.modules
        assert not list(self.folder.parent.glob("escaped*"))
        assert not list(self.folder.glob("escaped*"))

    def tables(self) -> Path:
        """The folder of an evaluation of tasks with the names in its rows and settings."""
        made = self.folder / "tables"
        made.mkdir(exist_ok=True)
        rows = [_row(name, trial) for trial, name in enumerate((*self.strategies, "model-lios", "opt-greedy"))]
        (made / TRIALS_FILE).write_bytes(b"".join(msgspec.json.encode(row) + b"\n" for row in rows))
        (made / SETTINGS_FILE).write_bytes(msgspec.json.encode(_request(self.strategies)))
        return made


def _row(name: str, trial: int) -> TaskRow:
    return TaskRow(
        scenario="stranger.yaml", strategy=name, estimator="stranger:Planner", trial=trial, house="../../escaped",
        house_index=trial, seed=trial, status="done", success=True, cost=10.0, own_cost=10.0, searches=1,
        travel_m=1.0, decisions=1, predicted_cost=None, optimal=1.0, reason="", title="", containers=3, belief_s=(),
        planning_s=(),
    )  # fmt: skip


def _request(strategies: tuple[str, ...]) -> TaskRequest:
    return TaskRequest(
        houses="../../escaped.jsonl.gz", split="all", scenarios=("stranger.yaml",), strategies=strategies, trials=9,
        seed=0, estimator="stranger:Planner", paper_estimator="weights.safetensors",
    )  # fmt: skip


@pytest.fixture
def stranger(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Stranger]:
    """The folder as the working folder and, as with `python -m` and in notebooks, first on the import path."""
    folder = tmp_path / "a" / "b" / "sent"
    folder.mkdir(parents=True)
    made = Stranger(folder)
    monkeypatch.chdir(folder)
    monkeypatch.syspath_prepend("")
    yield made
    sys.modules.pop("stranger", None)


@pytest.mark.ci_but(6)
@pytest.mark.parametrize("command", sorted(COMMANDS))
def test_no_command_runs_what_a_log_names(
    command: str, stranger: Stranger, capsys: pytest.CaptureFixture[str]
) -> None:
    for log in stranger.logs[: 1 if command in SLOW else None]:
        for words in COMMANDS[command]:
            args = words.format(
                log=log, out=stranger.out / log.stem, folder=stranger.folder / "logs", tables=stranger.tables()
            ).split(" ")
            with pytest.raises(SystemExit) as ended:
                cli.main(args)
            said = capsys.readouterr().err
            assert not [word for word in ("Traceback", "Usage", "No such option") if word in said], (args, said)
            assert ended.value.code in (0, 1, 2, 3)
            stranger.assert_nothing_ran()


@pytest.mark.parametrize("words", ["plan {log}", "replay {log} --verify"])
def test_the_answer_is_one_line_with_the_name_and_what_to_give(
    words: str, stranger: Stranger, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, log in zip(stranger.strategies, stranger.logs, strict=True):
        with pytest.raises(SystemExit) as ended:
            cli.main(words.format(log=log).split(" "))
        said = capsys.readouterr()
        assert ended.value.code == 2
        assert said.out == ""
        assert said.err.count("\n") == 1
        assert repr(name)[:60] in said.err
        assert "--strategy" in said.err


def test_every_command_is_walked_or_reads_no_log() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    others = {name for name in project["entry-points"]["lios.commands"] if name.startswith(("evaluate.", "houses."))}
    others |= {name for name in project["entry-points"]["lios.commands"] if name.startswith(("spot.", "new."))}
    assert set(project["entry-points"]["lios.commands"]) == set(COMMANDS) | NO_LOGS | others


READERS: dict[str, Callable[[Run], object]] = {
    "verify": verify,
    "verify by the log's name": lambda run: verify(run, strategy_name=run.info.strategy),
    "plan_again": replan,
    "plan_again by the log's name": lambda run: replan(run, strategy=run.info.strategy),
    "plan_again with the log's solver": lambda run: replan(run, solver=run.info.strategy.partition("@")[2]),
    "replay": lambda run: replay(run, run.info.strategy, ReplaySettings(worlds=0)),
    "replay_on": lambda run: replay_on(prepare_log(run, ReplaySettings(worlds=0)), run.info.strategy),
    "estimator_for by the log's name": lambda run: estimator_for(evidence_of(run), (MUG,), name=run.info.estimator),
    "prepare_log by the log's estimator": lambda run: prepare_log(run, ReplaySettings(estimator=run.info.estimator)),
    "estimator_for": lambda run: estimator_for(evidence_of(run), (ItemType("Unheard"),)),
    "strategy": lambda run: strategy(run.info.strategy),
    "solver": lambda run: solver(run.info.strategy.partition("@")[2]),
    "installed_solver": lambda run: installed_solver(run.info.strategy.partition("@")[2]),
    "estimator": lambda run: estimator(run.info.estimator.partition("@")[0]),
    "policy": lambda run: policy(run.info.strategy),
}


@pytest.mark.ci_but(5)
@pytest.mark.parametrize("reader", sorted(READERS))
def test_no_function_runs_what_a_log_names(reader: str, stranger: Stranger) -> None:
    refused = 0
    for log in stranger.logs:
        run = read(log, with_truth=True)
        if "solver" in reader and "@" not in run.info.strategy:
            continue
        with pytest.raises((NotFromLog, UnknownRecordedStrategy, UnknownName, NoBelief)):
            READERS[reader](run)
        refused += 1
        stranger.assert_nothing_ran()
    assert refused


def test_tables_the_dashboard_and_a_resumed_evaluation_read_names_as_text(stranger: Stranger) -> None:
    assert set(read_many(stranger.folder / "logs" / "*.mcap").runs.strategy) == set(stranger.strategies)
    opened = open_dashboard(stranger.logs, port=0)
    opened.stop()
    folder = stranger.tables()
    ours = msgspec.structs.replace(_request(stranger.strategies), strategies=("opt-greedy",))
    with TrialStore(folder, ours) as store:
        assert len(store.rows) == len(stranger.strategies) + 2
    stranger.assert_nothing_ran()


def test_what_is_replayed_by_all_are_built_in_and_installed_strategies(stranger: Stranger) -> None:
    assert "planted" not in strategy_names(with_truth=True)
    found = installed_module("up_fast_downward")
    assert found is None or not Path(str(found.origin)).is_relative_to(stranger.folder)
    stranger.assert_nothing_ran()


def test_a_user_may_name_the_same_things(stranger: Stranger) -> None:
    """What is refused above is there and works: the tests meet the rule, not a mistake in the names."""
    assert strategy("stranger:Planner", origin=NameOrigin.USER).name == "planned-by-a-stranger"
    assert stranger.marker.exists()
    assert solver("stranger:Planner", origin=NameOrigin.USER).name == "planned-by-a-stranger"
    assert estimator("stranger:Planner", origin=NameOrigin.USER).name == "planned-by-a-stranger"
    assert policy("stranger:Planner", origin=NameOrigin.USER).name == "planned-by-a-stranger"
    assert strategy("opt-greedy@stranger:Planner", origin=NameOrigin.USER).name == "opt-greedy@stranger:Planner"
    with pytest.raises(PluginNotLoaded, match="no attribute"):
        solver("stranger:Missing", origin=NameOrigin.USER)
    with pytest.raises(PluginNotLoaded, match="an estimator has name"):
        estimator("stranger:__name__", origin=NameOrigin.USER)


def test_a_users_module_is_found_in_the_working_folder_without_python_s_help(
    stranger: Stranger, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As the `lios` command starts: its own folder is on the path, and the working folder is not."""
    monkeypatch.setattr(sys, "path", [entry for entry in sys.path if entry])
    assert strategy("stranger:Planner", origin=NameOrigin.USER).name == "planned-by-a-stranger"
    assert sys.path[-1] == str(stranger.folder)
    with plugins.import_path(NameOrigin.LOG):
        assert str(stranger.folder) not in sys.path
    assert sys.path[-1] == str(stranger.folder)


def test_an_installed_plug_in_serves_a_log_too(stranger: Stranger, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its module is looked for where packages are installed, and not in the working folder."""
    installed = stranger.folder.parent / "site"
    installed.mkdir()
    (installed / "theirs.py").write_text(
        MODULE.replace('Path(r"{marker}").touch()', "").replace("planned-by-a-stranger", "theirs"), encoding="utf-8"
    )
    (stranger.folder / "theirs.py").write_text(MODULE.format(marker=stranger.marker), encoding="utf-8")
    monkeypatch.setattr(sys, "path", [*sys.path, str(installed)])
    entries = [EntryPoint(name="theirs", value="theirs:Planner", group=kind.group) for kind in _kinds()]
    monkeypatch.setattr(plugins, "_entries", lambda group, _: tuple(e for e in entries if e.group == group))
    for origin in NameOrigin:
        for kind in _kinds():
            assert plugin(kind, "theirs", origin=origin, known=()).entry is not None
    assert strategy("theirs").name == solver("theirs").name == policy("theirs").name == "theirs"
    assert estimator("theirs").name == "theirs"
    assert "theirs" in strategy_names(with_truth=False)
    stranger.assert_nothing_ran()
    sys.modules.pop("theirs", None)


def test_installed_packages_are_read_once_and_again_where_one_is_added(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    read: list[str] = []
    monkeypatch.setattr(plugins, "entry_points", lambda group: read.append(group) or [])
    monkeypatch.syspath_prepend(tmp_path)
    os.utime(tmp_path, (0, 0))  # changed long ago
    for _ in range(2):
        assert strategy_names(with_truth=False)
    assert read == [plugins.STRATEGY.group]
    (tmp_path / "added-1.0.dist-info").mkdir()
    assert strategy_names(with_truth=False)
    assert read == [plugins.STRATEGY.group] * 2


def _kinds() -> tuple[plugins.PluginKind, ...]:
    return (plugins.STRATEGY, plugins.POLICY, plugins.ESTIMATOR, plugins.SOLVER)


def test_names_that_a_log_may_give_are_unchanged() -> None:
    for name in strategy_names(with_truth=False):
        assert strategy(name).name == strategy(name, origin=NameOrigin.USER).name
    assert strategy("model-lios@sas-lmcut").name == "model-lios@sas-lmcut"
    assert needs_truth("oracle@everywhere")


RESOLVERS = ("strategy", "policy", "estimator", "solver", "strategy_named", "estimator_named", "solver_named",
             "installed_solver", "replay", "replay_on", "verify", "is_foreign", "Sandboxed")  # fmt: skip


def test_every_call_with_a_name_says_who_gives_it() -> None:
    """In the product itself; a literal name is its own."""
    silent = {
        name
        for name, call in nodes(ast.Call)
        if isinstance(call.func, ast.Name)
        and call.func.id in RESOLVERS
        and _gives_a_name(call)
        and not {"origin", "weights"} & {keyword.arg for keyword in call.keywords}
    }
    assert silent == {"workbench/planning/strategies.py"}, "the table itself, whose policies are built in"


def _gives_a_name(call: ast.Call) -> bool:
    given = call.args[1] if getattr(call.func, "id", "") in ("replay", "replay_on") else call.args[0]
    return not isinstance(given, ast.Constant)


def test_errors_of_the_resolver_are_bad_input(stranger: Stranger) -> None:
    for error in (NotFromLog, PluginNotLoaded):
        assert issubclass(error, LiosError)
        assert error.exit_code == 2
    with pytest.raises(NotFromLog) as caught:
        strategy("stranger:" + "x" * 500 + "\n\x1b[31m")
    assert "\n" not in str(caught.value)
    assert "\x1b" not in str(caught.value)
    assert len(str(caught.value)) < 400
