"""Parameters as annotations: every type that a command may have, what is not given, and what is refused."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import entry_points
from pathlib import Path
from typing import Annotated, Any, get_type_hints

import click
import pytest
from click.testing import CliRunner

from workbench import cli
from workbench.cli import run
from workbench.parameters import Argument, Option, command_of

GIVEN: list[dict[str, Any]] = []


def everything(
    logs: Annotated[list[Path], Argument(help="Logs.")],
    much: Annotated[float, Option("--much", "-m", min=0.0, max=2.0)] = 1.0,
    at: Annotated[float | None, Option("--at")] = None,
    seed: Annotated[int, Option("--seed")] = 0,
    topics: Annotated[list[str] | None, Option("--topic", "-t")] = None,
    figures: Annotated[bool, Option("--figures/--no-figures")] = True,
    force: Annotated[bool, Option("--force")] = False,
    raw: Annotated[bool, Option()] = True,
) -> None:
    GIVEN.append(dict(locals()))


def given(*words: str) -> dict[str, Any]:
    GIVEN.clear()
    done = CliRunner().invoke(command_of("everything", everything, help="All."), words, catch_exceptions=False)
    assert done.exit_code == 0, done.output
    (arguments,) = GIVEN
    return arguments


def test_what_is_not_given_is_what_the_function_has() -> None:
    assert given("a.mcap", "b.mcap") == {
        "logs": [Path("a.mcap"), Path("b.mcap")],
        "much": 1.0,
        "at": None,
        "seed": 0,
        "topics": None,
        "figures": True,
        "force": False,
        "raw": True,
    }


def test_what_is_given_has_the_type_of_the_annotation() -> None:
    words = "a -m 2 --at 1e3 --seed 7 -t x --topic y --no-figures --force --no-raw"
    assert given(*words.split()) == {
        "logs": [Path("a")],
        "much": 2.0,
        "at": 1000.0,
        "seed": 7,
        "topics": ["x", "y"],
        "figures": False,
        "force": True,
        "raw": False,
    }


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "Missing argument"),
        (["a", "--much", "3"], "0.0<=x<=2.0"),
        (["a", "--much", "nan"], "not a finite number"),
        (["a", "--at", "inf"], "not a finite number"),
        (["a", "--seed", "-1"], "x>=0"),
        (["a", "--no-force"], "No such option"),
    ],
)
def test_what_is_out_of_range_is_refused(words: list[str], said: str) -> None:
    done = CliRunner().invoke(command_of("everything", everything, help="All."), words)
    assert done.exit_code == 2
    assert said in done.output


def test_a_parameter_without_an_annotation_is_a_programmer_s_mistake() -> None:
    def bare(log: Path) -> None: ...

    def odd(log: Annotated[complex, Option("--log")] = 0j) -> None: ...

    for function, said in ((bare, "no Option or Argument"), (odd, "no command line gives")):
        with pytest.raises(TypeError, match=said):
            command_of("it", function, help="")


def test_a_plug_in_may_be_click_s(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """Beside functions with annotations: whoever knows click writes click."""

    class Entry:
        name, value, dist = "mine", "mine:mine", None

        def load(self) -> click.Command:
            return click.Command("mine", callback=lambda: click.echo("mine was called"))

    monkeypatch.setattr("workbench.plugins.entry_points", lambda group: [Entry()])
    assert run(["mine"]) == 0
    assert capsys.readouterr().out == "mine was called\n"


def _two_options(
    one: Annotated[str, Option("--one", "-o", help="A name.")] = "",
    names: Annotated[str, Option("--names", help="Names separated by commas.")] = "",
    many: Annotated[list[str] | None, Option("--many", help="Repeat for several.")] = None,
    flag: Annotated[bool, Option("--flag", help="A switch.")] = False,
) -> tuple[str, str, list[str] | None, bool]:
    return one, names, many, flag


@pytest.mark.parametrize("line", [["--one", "a", "--one", "b"], ["-oa", "--one=b"], ["-o", "a", "-o", "a"]])
def test_a_second_value_of_an_option_that_takes_one_is_refused(line: list[str]) -> None:
    command = command_of("two", _two_options, help="")
    with pytest.raises(click.UsageError, match=r"--one is given twice\. It takes one value\."):
        command.main(line, standalone_mode=False)


def test_it_says_how_a_list_is_given() -> None:
    with pytest.raises(click.UsageError, match="with commas between them"):
        command_of("two", _two_options, help="").main(["--names", "a", "--names", "b"], standalone_mode=False)


@pytest.mark.parametrize(
    "line",
    [["--one", ""], ["--names", " "], ["--many", "a", "--many", ""], ["--one="]],
    ids=["text", "blank", "one of several", "="],
)
def test_an_empty_text_is_refused(line: list[str]) -> None:
    """That of a shell variable that is not set would mean the default, or this folder."""
    with pytest.raises(click.BadParameter, match="it is empty"):
        command_of("two", _two_options, help="").main(line, standalone_mode=False)


def test_an_empty_path_is_not_this_folder() -> None:
    with pytest.raises(click.BadParameter, match=r"it is empty\. Give a value, or omit the argument\."):
        command_of("everything", everything, help="").main([""], standalone_mode=False)


def test_what_takes_several_still_does() -> None:
    line = ["--many", "a", "--many", "b", "--flag", "--flag", "--one", "x"]
    assert command_of("two", _two_options, help="").main(line, standalone_mode=False) == ("x", "", ["a", "b"], True)


@dataclass(frozen=True, slots=True, kw_only=True)
class Shared:
    size: Annotated[int, Option("--size", help="How large.", min=1)] = 3
    names: Annotated[list[str] | None, Option("--name", help="Repeat for several.")] = None


def _with_shared(own: Annotated[str, Option("--own", help="Its own.")] = "", shared: Shared = Shared()) -> Any:
    return own, shared


@pytest.mark.parametrize(
    ("line", "given"),
    [
        ([], ("", Shared())),
        (["--size", "5", "--own", "x"], ("x", Shared(size=5))),
        (["--name", "a", "--name", "b"], ("", Shared(names=["a", "b"]))),
    ],
)
def test_the_fields_of_a_dataclass_are_options(line: list[str], given: tuple[str, Shared]) -> None:
    command = command_of("it", _with_shared, help="")
    assert [param.name for param in command.params] == ["own", "size", "names"]
    assert command.main(line, standalone_mode=False) == given
    with pytest.raises(click.BadParameter, match="0 is not in the range"):
        command.main(["--size", "0"], standalone_mode=False)


def _leaves(group: click.Group, path: tuple[str, ...] = ()) -> Iterator[tuple[str, click.Command]]:
    """Every command below a group, by its whole name."""
    context = click.Context(group)
    for name in group.list_commands(context):
        found = group.get_command(context, name)
        if isinstance(found, click.Group):
            yield from _leaves(found, (*path, name))
        elif found is not None:
            yield " ".join((*path, name)), found


def test_every_option_of_every_command_takes_a_second_value_or_refuses_it() -> None:
    """All commands are walked; what takes several hands all of them on."""
    taken: list[str] = []
    for name, command in _leaves(cli.app()):
        for option in (p for p in command.params if isinstance(p, click.Option) and not p.is_flag):
            line = [option.opts[0], "1", option.opts[0], "2"]
            if not option.multiple:
                with pytest.raises(click.UsageError, match="given twice"):
                    command.parse_args(click.Context(command), list(line))
                continue
            context = click.Context(command, resilient_parsing=True)
            command.parse_args(context, list(line))
            assert [str(value) for value in context.params[option.name or ""]] == ["1", "2"], (
                f"{name} {option.opts[0]}"
            )
            taken.append(f"{name} {option.opts[0]}")
    assert "train --houses" in taken


def test_no_command_uses_one_of_several_values_alone() -> None:
    """Of a list that a command takes, no code of it reads the first or the last alone."""
    read: list[str] = []
    for entry in entry_points(group="lios.commands"):
        made = entry.load()
        function = made if not isinstance(made, click.Command) else made.callback
        hints = get_type_hints(function, include_extras=True)
        lists = {name for name, hint in hints.items() if "list[" in str(hint)}
        tree = ast.parse(inspect.getsource(inspect.unwrap(function)).lstrip())
        read += [
            f"{entry.name}: {ast.unparse(node)}"
            for node in ast.walk(tree)
            if isinstance(node, ast.Subscript)
            and isinstance(node.value, ast.Name)
            and node.value.id in lists
            and isinstance(node.slice, ast.Constant | ast.UnaryOp)
        ]
    assert not read


@pytest.mark.parametrize("words", ["--seed 9223372036854775808", "--most -9223372036854775809"])
def test_whole_numbers_beyond_64_bits_are_refused(words: str) -> None:
    def command(seed: Annotated[int, Option()] = 0, most: Annotated[int, Option()] = 0) -> None:
        """Takes two numbers."""

    refused = CliRunner().invoke(command_of("command", command, help="Numbers."), words.split())
    assert refused.exit_code == 2
    assert "is beyond 64 bits" in refused.output
    allowed = CliRunner().invoke(command_of("command", command, help="Numbers."), ["--seed", str((1 << 63) - 1)])
    assert allowed.exit_code == 0


@pytest.mark.parametrize(
    "words",
    [
        ["replay", "run.mcap", "--worlds"],
        ["select", "run.mcap", "--worlds"],
        ["evaluate", "tasks", "--trials"],
        ["evaluate", "select", "--pool"],
        ["evaluate", "replay", "--counterfactuals"],
    ],
)
def test_counts_that_no_memory_holds_are_refused_before_anything_is_read(
    words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert run([*words, "1000001"]) == 2
    assert "1000001 is not in the range" in capsys.readouterr().err


def test_want_of_memory_is_one_line(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def full(*_: object, **__: object) -> None:
        raise MemoryError("Unable to allocate 89.4 GiB")

    monkeypatch.setattr(cli, "app", full)
    assert run(["info", "run.mcap"]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "more memory than there is" in line
