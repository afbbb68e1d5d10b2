"""The `lios` command: finds commands by entry point, groups them in its help, and turns errors into one line.

Exit codes: 0 fine, 1 failed, 2 bad usage or bad input, 3 finished with loss.
"""

from __future__ import annotations

import inspect
import logging
import os
import sys
from contextlib import ExitStack
from difflib import get_close_matches
from errno import EDQUOT, EFBIG, EINVAL, ELOOP, ENAMETOOLONG, ENODEV, ENOSPC, ENXIO, EROFS
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any, TextIO

import click
from click.shell_completion import get_completion_class

from workbench.debugging import debugging
from workbench.errors import LiosError, WrongKind, shortened
from workbench.parameters import command_of
from workbench.plugins import CommandEntries
from workbench.terminal import emit_text, say, wide_tables

PANELS: dict[str, tuple[str, ...]] = {
    "Run": ("demo", "record", "plan", "evaluate", "train", "learn-moves"),
    "Replay": ("replay", "compare", "select", "certify"),
    "View": ("view", "serve", "render", "figures", "capsule", "report"),
    "Logs": ("info", "list", "doctor", "recover", "export", "import", "upload", "log"),
    "Places": ("houses", "site", "spot"),
    "Extend": ("new", "strategies", "policies", "estimators", "scenarios", "solvers"),
}
"""The help group of each command; plug-in commands are listed under "More"."""

ORDER_WITHIN: dict[str, tuple[str, ...]] = {
    "evaluate": ("belief", "search", "tasks", "solvers", "replay", "select", "perception", "spot"),
    "log": ("cat", "filter", "merge", "split", "compact", "convert", "note"),
    "houses": ("generate", "info", "stats"),
    "site": ("check", "from-log", "from-graph-nav"),
    "new": ("planner", "policy", "estimator", "house", "site"),
    "spot": ("check", "simulate", "record", "run", "resume"),
}
"""The order of commands in a group's help: the order of use. Plug-in commands come last."""

GROUP_HELP = {
    "evaluate": "Measure beliefs, search policies, planners, solvers, replay, selection, perception, Spot runs.",
    "log": "Container tools: cat, filter, merge, split, compact, convert, note.",
    "houses": "Generate, inspect and compare houses.",
    "new": "Write a file to start from: planner, policy, estimator, house, site.",
    "site": "Check or draft the survey file of a real place.",
    "spot": "Simulate, check, record or run a Spot.",
}

EPILOG = """\b
Examples:
  lios demo                                  a complete example on the shipped data
  lios record --find mug -o run.mcap         one search, simulated
  lios replay run.mcap                       what the other strategies would have cost
  lios view run.mcap                         the run in 3D
  lios record --find mug --strategy '?'      an unknown name lists the known ones

\b
Exit codes:
  0  fine
  1  failed, or stopped
  2  bad usage or bad input: one line says what, where, and how to fix it
  3  finished with loss: some data was dropped

\b
Environment:
  LIOS_CACHE     folder of the cache; "off" keeps none; default ~/.cache/lios-workbench
  LIOS_CHROMIUM  the browser that lios render draws with
  LIOS_DASHBOARD_TOKEN
                 a token for the dashboard's address that stays the same; default: a new one each time
  BOSDYN_CLIENT_USERNAME, BOSDYN_CLIENT_PASSWORD, LIOS_SPOT_CERTIFICATE
                 for lios spot record and run
  NO_COLOR       plain tables

lios COMMAND --help shows examples of each. --json prints machine-readable output."""


LINKS_IN_A_CIRCLE = "Symlink loop from "
"""How Path.resolve begins to say so, before Python 3.13."""
BAD_PLACE = frozenset({EDQUOT, EFBIG, EINVAL, ELOOP, ENAMETOOLONG, ENODEV, ENOSPC, ENXIO, EROFS})
"""Errors that another path helps against."""


class Commands(click.Group):
    """A command group whose commands are entry points, each imported only when needed.

    Args:
        prefix: what the full names of its commands begin with.
    """

    def __init__(self, name: str | None, found: CommandEntries, prefix: str = "", **kwargs: Any) -> None:
        super().__init__(name, **kwargs)
        self._found = found
        self._prefix = prefix

    def list_commands(self, ctx: click.Context) -> list[str]:
        panels = PANELS if ctx.parent is None else {"": ORDER_WITHIN.get(self.name or "", ())}
        order = [n for names in panels.values() for n in names]
        below = (full.removeprefix(self._prefix) for full in self._found.all if full.startswith(self._prefix))
        names = {name.split(".")[0] for name in below}
        return sorted(names, key=lambda n: (order.index(n) if n in order else len(order), n))

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        entry = self._found.get(self._prefix + cmd_name)
        if entry is not None:
            return _load(cmd_name, entry)
        prefix = f"{self._prefix}{cmd_name}."
        if not any(full.startswith(prefix) for full in self._found.all):
            return None
        return Commands(cmd_name, self._found, prefix, help=GROUP_HELP.get(cmd_name, ""), no_args_is_help=True)

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except BrokenPipeError:
            # The reader closed the pipe (| head).
            raise click.exceptions.Exit(0) from None

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        shown = self.list_commands(ctx)
        groups = {} if ctx.parent else PANELS
        panels = {title: [n for n in names if n in shown] for title, names in groups.items()}
        rest = [n for n in shown if not any(n in names for names in panels.values())]
        panels["Commands" if ctx.parent else "More"] = rest
        for title, names in panels.items():
            if not names:
                continue
            with formatter.section(title):
                commands = [(n, self.get_command(ctx, n)) for n in names]
                formatter.write_dl([(n, c.get_short_help_str(120)) for n, c in commands if c is not None])

        self._tell_left_out()

    def _tell_left_out(self) -> None:
        """Says which commands that a user may look for here are not."""
        for full, line in self._found.left_out.items():
            if f"{full}.".startswith(self._prefix):
                say(line)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        try:
            return super().resolve_command(ctx, args)
        except click.UsageError as error:
            self._tell_left_out()
            near = get_close_matches(args[0], self.list_commands(ctx), n=2)
            if "Did you mean" in error.message or not near:
                raise
            raise click.UsageError(f"{error.message} Did you mean {' or '.join(near)}?", ctx) from error


def _load(name: str, entry: EntryPoint) -> click.Command:
    try:
        function = entry.load()
    except ImportError as error:
        reason = str(error)

        def unavailable() -> None:
            raise click.ClickException(f"this command cannot be loaded: {reason}")

        return click.Command(name, callback=unavailable, help="(cannot be loaded here)")
    if isinstance(function, click.Command):
        return function
    return command_of(name, function, help=_examples_unwrapped(inspect.getdoc(function) or ""))


def _examples_unwrapped(text: str) -> str:
    """Help text whose example lines are never wrapped, so that each can be copied."""
    words, found, examples = text.partition("Examples:")
    if not found:
        return text
    # click does not rewrap a paragraph that starts with a backspace character.
    paragraphs = [f"\b\n{paragraph.strip()}" for paragraph in examples.split("\n\n") if paragraph.strip()]
    return "\n\n".join([words + found, *(p.replace("\n", "\n  ", 1) for p in paragraphs)])


def _print_completion(ctx: click.Context, _: click.Parameter, shell: str | None) -> None:
    if shell is None or ctx.resilient_parsing:
        return
    made = get_completion_class(shell)
    assert made is not None, "the option allows only click's own shells"
    emit_text(made(ctx.command, {}, "lios", "_LIOS_COMPLETE").source())
    ctx.exit()


def _print_version(ctx: click.Context, _: click.Parameter, asked: bool) -> None:
    if not asked or ctx.resilient_parsing:
        return
    from workbench import __version__

    emit_text(f"lios-workbench, version {__version__}")
    ctx.exit()


def app() -> Commands:
    """The command tree."""
    return Commands(
        "lios",
        CommandEntries(),
        help="Record, replay, inspect and evaluate robot object search and task planning.",
        epilog=EPILOG,
        no_args_is_help=True,
        context_settings={"max_content_width": 100, "help_option_names": ["-h", "--help"]},
        params=[
            click.Option(
                ["--completion"],
                type=click.Choice(["bash", "zsh", "fish"]),
                callback=_print_completion,
                is_eager=True,
                expose_value=False,
                help='Print what makes Tab complete commands and options: eval "$(lios --completion bash)"',
            ),
            click.Option(["--wide"], is_flag=True, expose_value=False, help="Show every column of a table."),
            click.Option(["--debug"], is_flag=True, expose_value=False, help="Show tracebacks."),
            click.Option(
                ["--version"],
                is_flag=True,
                callback=_print_version,
                is_eager=True,
                expose_value=False,
                help="Show the version and exit.",
            ),
        ],
    )


def main(argv: list[str] | None = None) -> None:
    """Run a command and exit with its code. No traceback reaches a user unless --debug is given."""
    args = list(sys.argv[1:] if argv is None else argv)
    with ExitStack() as stack:
        for name in ("stdout", "stderr"):
            if getattr(sys, name) is None:  # the parent process closed the stream
                setattr(sys, name, stack.enter_context(open(os.devnull, "w", encoding="utf-8")))
        if "--debug" in args:
            logging.basicConfig(format="%(message)s")
            logging.getLogger("lios").setLevel(logging.DEBUG)
            stack.enter_context(debugging())
        if "--wide" in args:
            stack.enter_context(wide_tables())
        code = run([a for a in args if a not in ("--debug", "--wide")], debug="--debug" in args)
        sys.exit(_flush_output(code))


def _flush_output(code: int) -> int:
    """Flush all output and return the exit code.

    Output that cannot be written is discarded, since the interpreter would otherwise report an error at shutdown.
    """
    lost = _flush_error(sys.stdout)
    if code == 0 and lost is not None and not isinstance(lost, BrokenPipeError):
        say(_os_error_line(lost))
        code = 1
    _flush_error(sys.stderr)
    return code


def _flush_error(stream: TextIO) -> OSError | None:
    """Flush a stream and return the error if that fails; the unwritten rest is then discarded."""
    try:
        stream.flush()
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
        return error
    return None


def run(args: list[str], *, debug: bool = False) -> int:
    """Run a command line and return its exit code. `lios help record` is `lios record --help`."""
    if args[:1] == ["help"]:
        args = [*args[1:], "--help"]
    try:
        code = app().main(args=args, prog_name="lios", standalone_mode=False)
    except click.exceptions.Exit as error:
        return error.exit_code
    except click.exceptions.Abort:
        say("Stopped.")
        return 1
    except click.exceptions.NoArgsIsHelpError as error:
        emit_text(error.format_message())
        return 0
    except click.ClickException as error:
        say(f"lios: {error.format_message()}")
        return 2
    except LiosError as error:
        if debug:
            raise
        say(f"lios: {' '.join(str(error).splitlines())}")  # a name in a file may hold line breaks
        return error.exit_code
    except OSError as error:
        if debug:
            raise
        wrong = _path_kind_error(error)
        say(f"lios: {wrong}" if wrong else _os_error_line(error))
        return wrong.exit_code if wrong else 2 if _is_bad_path(error) else 1
    except KeyboardInterrupt:
        say("Stopped.")
        return 1
    except MemoryError:
        if debug:
            raise
        say("lios: this takes more memory than there is. Ask for less: fewer worlds, trials, houses or workers.")
        return 1
    except Exception as error:
        if debug:
            raise
        if isinstance(error, RuntimeError) and str(error).startswith(LINKS_IN_A_CIRCLE):
            path = str(error).removeprefix(LINKS_IN_A_CIRCLE).strip("'")
            say(f"lios: {path}: links lead in a circle. Give another path.")
            return 2
        words = " ".join(str(error).split())
        say(f"lios: an error that should not happen: {type(error).__name__}: {words}. Run with --debug.")
        return 1
    return code if isinstance(code, int) else 0


def _path_kind_error(error: OSError) -> WrongKind | None:
    """The error for a path of the wrong kind: a file in place of a folder, or the reverse."""
    if error.filename is None:
        return None
    if isinstance(error, IsADirectoryError):
        return WrongKind(error.filename, needed="file")
    if isinstance(error, FileExistsError | NotADirectoryError):
        return WrongKind(_blocking_file(error.filename), needed="folder")
    return None


def _is_bad_path(error: OSError) -> bool:
    """Whether a path cannot be used, or what was to be written there as a whole finds no room."""
    refused = isinstance(error, FileNotFoundError | PermissionError) or error.errno in BAD_PLACE
    return refused and error.filename is not None


def _blocking_file(path: str | bytes) -> Path:
    """The first component of a path that is a file although a folder is needed there."""
    whole = Path(os.fsdecode(path))
    return next((part for part in reversed(whole.parents) if part.is_file()), whole)


def _os_error_line(error: OSError) -> str:
    where = f"{shortened(str(error.filename), 300)}: " if error.filename else ""
    return f"lios: {where}{error.strerror or error}. Check the path, the rights and the space on the disk."
