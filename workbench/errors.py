"""What can go wrong, said in one line: what, where, what to do next.

The family:

    LiosError
      InputError            bad usage or bad input; the command line exits with 2
        NotFound            a file, an index, a name that is not there
        Malformed           a file or value that is not what it should be
        Unsupported         a request that this house, log or install cannot serve
      Lossy                 finished, but something was lost; exits with 3
      Failed                the work itself failed; exits with 1

Every error composes its own message from facts, so that a caller passes values and not prose.
Each room adds its own errors beside the code that raises them, as a subclass of one of these.
"""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path


class LiosError(Exception):
    """Any mistake that this project reports to a person in one line.

    It travels between processes as its message and attributes; made again, it would compose a message of a message.
    """

    exit_code = 1

    def __reduce__(self) -> tuple[object, ...]:
        return _arrived, (type(self), self.args, self.__dict__)


class InputError(LiosError):
    """Bad usage or bad input."""

    exit_code = 2


class NotFound(InputError):
    """Something named does not exist."""


class Malformed(InputError):
    """Something is not what it should be."""


class Unsupported(InputError):
    """A request that cannot be served here."""


class Lossy(LiosError):
    """The work finished with loss."""

    exit_code = 3


class Failed(LiosError):
    """The work itself failed."""


class FileMissing(NotFound):
    """There is no such file."""

    def __init__(self, path: Path | str) -> None:
        super().__init__(f"{_short(str(path), 300)}: no such file. Check the path.")


class OutputExists(InputError):
    """An output would overwrite something."""

    def __init__(self, path: Path | str) -> None:
        super().__init__(f"{path} exists. Give another -o/--output, or --force to replace it.")


class WrongKind(InputError):
    """A file where a folder is needed, or a folder where a file is."""

    def __init__(self, path: Path | str, *, needed: str) -> None:
        other = "file" if needed == "folder" else "folder"
        super().__init__(f"{_short(str(path), 300)}: it is a {other}, and a {needed} is needed. Give another path.")


class MalformedFile(Malformed):
    """A file cannot be read as what it should be.

    Args:
        path: the file.
        what: what is wrong with it, without a full stop.
        fix: what to do next, as a sentence without a full stop.
    """

    def __init__(self, path: Path | str, what: str, fix: str) -> None:
        super().__init__(f"{path}: {what}. {fix}.")


class BadValue(Malformed):
    """A value is outside what it may be.

    Args:
        where: the field, option or argument.
        value: what was given; None for nothing.
        allowed: what may be given.
    """

    def __init__(self, where: str, value: object, allowed: str) -> None:
        shown = "not given" if value is None else _short(repr(value), 80)
        super().__init__(f"{where} is {shown}; it must be {allowed}.")


MOST_LISTED = 24
"""Known names in one line; "?" as a name lists all, however many."""


class UnknownName(NotFound):
    """A name that is not in a table; lists the nearest, or else the known ones.

    Args:
        kind: what the name should name ("strategy", "item type").
        name: the name given.
        known: all names that would do.
        where: in which house, file or table, if that helps.
    """

    def __init__(self, kind: str, name: str, known: Iterable[str], where: str = "") -> None:
        names = sorted(known)
        near = get_close_matches(name.lower(), [n.lower() for n in names], n=3, cutoff=0.5)
        nearest = [n for lower in near for n in names if n.lower() == lower]
        shown = nearest or (names if name == "?" or len(names) <= MOST_LISTED else names[: MOST_LISTED // 2])
        more = len(names) - len(shown) if not nearest else 0
        listed = ", ".join(shown) + (f", and {more} more, which '?' lists" if more else "")
        place = f" in {_short(where, 120)}" if where else ""
        hint = "Did you mean" if nearest else "Known are"
        super().__init__(f"no {kind} {_short(name, 60)!r}{place}. {hint}: {listed or 'none'}.")


class MissingExtra(Unsupported):
    """A part that needs an optional install.

    Args:
        what: what was asked for.
        extra: the extra of this distribution that brings it.
    """

    def __init__(self, what: str, extra: str) -> None:
        super().__init__(f"{what} needs an optional part. Install it: pip install 'lios-workbench[{extra}]'.")


def _arrived(kind: type[LiosError], args: tuple[object, ...], attributes: dict[str, object]) -> LiosError:
    """An error as it was in the process that raised it."""
    error = kind.__new__(kind, *args)
    error.args = args
    error.__dict__.update(attributes)
    return error


def _short(text: str, limit: int) -> str:
    """The text, cut where it would fill a screen."""
    return text if len(text) <= limit else text[: limit - 3] + "..."
