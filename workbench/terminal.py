"""Terminal output of commands: results on standard output, messages on standard error, progress on a
terminal only."""

from __future__ import annotations

import os
import re
import sys
import threading
from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from typing import Any, TypeVar

import msgspec

T = TypeVar("T")
_wide: ContextVar[bool] = ContextVar("wide", default=False)
WIDE = "--wide"
COMPILING_MESSAGE = "Still working. The first use on a machine compiles the search once, which takes up to a minute."


def say(text: str) -> None:
    """Print a message on standard error. Markup in it is shown, never interpreted.

    If the reader has closed the pipe (2>&1 | head), the message is lost and the exit code does not change.
    """
    from rich.markup import escape

    from workbench.third_party.tables import PlainConsole

    with suppress(BrokenPipeError):
        PlainConsole(stderr=True, soft_wrap=True).print(escape(_as_text(text)), highlight=False)


def counted(number: int, thing: str) -> str:
    """ "1 container", "2 containers"."""
    return f"{number} {thing}" + ("" if number == 1 else "s")


def emit_json(answer: Any) -> None:
    """Print a result as one JSON document on standard output, keys in the given order.

    File names that are not valid UTF-8 are printed with replacement characters, since JSON cannot represent them.
    """
    try:
        document = msgspec.json.encode(answer)
    except UnicodeEncodeError:
        document = msgspec.json.encode(_as_text(msgspec.to_builtins(answer)))
    sys.stdout.buffer.write(msgspec.json.format(document, indent=2))
    sys.stdout.buffer.write(b"\n")
    sys.stdout.buffer.flush()


def emit_text(text: str) -> None:
    """Print a result as text on standard output."""
    sys.stdout.write(_as_text(text) + "\n")
    sys.stdout.flush()


@contextmanager
def wide_tables() -> Generator[None]:
    """Meanwhile tables leave no column out, however narrow the terminal."""
    token = _wide.set(True)
    try:
        yield
    finally:
        _wide.reset(token)


def emit_table(
    rows: Sequence[Mapping[str, Any]],
    *,
    columns: Sequence[str] | None = None,
    title: str = "",
    minor: Sequence[str] = (),
) -> None:
    """Print rows as a table on standard output; numbers right-aligned, missing values as a dash.

    On a narrow terminal, sentences wrap first, then the column separators are dropped, then columns are left out; a
    line on standard error names them, and --wide shows them. Names and numbers are not broken; paths only after a
    slash. In a pipe or file, nothing is left out.

    Args:
        minor: columns that are left out first, in this order; then those farthest to the right.
    """
    from workbench.third_party.tables import PrintedColumn, print_table

    names = list(columns or (rows[0].keys() if rows else ()))
    shown = [
        PrintedColumn(
            heading=name.replace("_", " "),
            cells=tuple(_shown(row.get(name)) for row in rows),
            numeric=any(_is_number(row.get(name)) for row in rows),
        )
        for name in names
    ]
    first_out = [shown[names.index(name)] for name in minor if name in names]
    left_out = print_table(shown, title=_as_text(title), first_out=first_out, keep_all=_wide.get())
    if left_out:
        say(
            f"Not shown, for lack of space: {', '.join(column.heading for column in left_out)}. "
            f"{WIDE} shows every column."
        )


def signed_percentage(share: float | None) -> str | None:
    """ "+13.7 %" for 0.137; None for None."""
    return None if share is None else f"{100 * share:+.1f} %"


def percentage(share: float | None) -> str | None:
    """A share as a percentage, "10.0 %"; None for none."""
    return None if share is None else f"{100 * share:.1f} %"


def progress(items: Iterable[T], *, title: str, total: int | None = None) -> Iterator[T]:
    """Iterate over the items, with a progress bar if standard error is a terminal."""
    if not _is_terminal():
        yield from items
        return
    from rich.markup import escape
    from rich.progress import track

    from workbench.third_party.tables import PlainConsole

    console = PlainConsole(stderr=True)
    yield from track(items, description=escape(title), total=total, console=console, transient=True)


@contextmanager
def patience(words: str = COMPILING_MESSAGE, *, after_s: float = 3.0) -> Generator[None]:
    """Print `words` if the body takes longer than `after_s` seconds and standard error is a terminal."""
    if not _is_terminal():
        yield
        return
    timer = threading.Timer(after_s, say, (words,))
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


def _is_terminal() -> bool:
    """Whether rich takes standard error for a terminal; it is not loaded where nothing speaks for one."""
    if not sys.stderr.isatty() and not {"FORCE_COLOR", "TTY_COMPATIBLE"} & os.environ.keys():
        return False
    from workbench.third_party.tables import PlainConsole

    return PlainConsole(stderr=True).is_terminal


def _as_text(value: Any) -> Any:
    if isinstance(value, str):
        return value.encode("utf-8", "surrogateescape").decode("utf-8", "replace")
    if isinstance(value, Mapping):
        return {_as_text(key): _as_text(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_as_text(part) for part in value]
    return value


def _is_number(value: object) -> bool:
    """Whether a value is a number, or a percentage as text."""
    is_percentage = isinstance(value, str) and re.fullmatch(r"[+-]?\d+(\.\d+)? %", value) is not None
    return is_percentage or isinstance(value, int | float)


def _shown(value: Any) -> str:
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.0f}" if abs(value) >= 10_000 else f"{value:.3g}" if abs(value) < 1 else f"{value:.2f}"
    return _as_text(str(value))
