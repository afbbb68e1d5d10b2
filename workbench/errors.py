"""The base classes of all errors, and the errors that several packages share.

The family:

    LiosError
      InputError            bad usage or bad input; the command line exits with 2
        NotFound            a file, an index or a name that does not exist
        Malformed           a file or value of the wrong form
        Unsupported         a request that this house, log or installation cannot serve
      Failed                the work itself failed; exits with 1

Every error composes its own message (what, where, what to do), so that a caller passes values and not prose. Each
package adds its own errors beside the code that raises them, as subclasses of these.
"""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path


def first_few(names: Iterable[object], most: int) -> str:
    """ "a, b and 3 more": so many of some names, and how many are left."""
    listed = [str(name) for name in names]
    return ", ".join(listed[:most]) + (f" and {len(listed) - most} more" if len(listed) > most else "")


class LiosError(Exception):
    """Base class of all errors that are reported to the user in one line.

    Pickling keeps the message and the attributes: calling the constructor again would compose the message twice.
    """

    exit_code = 1

    def __reduce__(self) -> tuple[object, ...]:
        return _unpickle_error, (type(self), self.args, self.__dict__)


class InputError(LiosError):
    """Bad usage or bad input."""

    exit_code = 2


class NotFound(InputError):
    """Something named does not exist."""


class Malformed(InputError):
    """A file or value has the wrong form."""


class Unsupported(InputError):
    """A valid request that this house, log or installation cannot serve."""


class Failed(LiosError):
    """The work itself failed."""


class FileMissing(NotFound):
    """A file does not exist."""

    def __init__(self, path: Path | str) -> None:
        super().__init__(f"{shortened(str(path), 300)}: no such file. Check the path.")


class OutputExists(InputError):
    """The output exists already."""

    def __init__(self, path: Path | str) -> None:
        super().__init__(f"{path} exists. Give another -o/--output, or --force to replace it.")


class CannotCreate(InputError):
    """A file cannot be created at this path."""

    def __init__(self, path: Path | str, reason: str) -> None:
        self.reason = reason
        super().__init__(f"{shortened(str(path), 300)}: cannot be written ({reason}). Choose another -o/--output.")


class WrongKind(InputError):
    """A file was given where a folder is needed, or the reverse."""

    def __init__(self, path: Path | str, *, needed: str) -> None:
        other = "file" if needed == "folder" else "folder"
        super().__init__(
            f"{shortened(str(path), 300)}: it is a {other}, and a {needed} is needed. Give another path."
        )


class MalformedFile(Malformed):
    """A file does not have the expected format.

    Args:
        path: the file.
        what: what is wrong with it, without a full stop.
        fix: what to do next, as a sentence without a full stop.
    """

    def __init__(self, path: Path | str, what: str, fix: str) -> None:
        super().__init__(f"{path}: {what}. {fix}.")


class BadValue(Malformed):
    """A value is not allowed.

    Args:
        where: the field, option or argument.
        value: the value given; None if missing.
        allowed: the allowed values, as a phrase that follows "must be".
    """

    def __init__(self, where: str, value: object, allowed: str) -> None:
        shown = "not given" if value is None else _shown(value)
        super().__init__(f"{where} is {shown}; it must be {allowed}.")


MAX_LISTED = 24
"""Most known names listed in one message; the name "?" lists all of them."""


class UnknownName(NotFound):
    """A name that is not in a table; the message suggests similar names, or lists the known ones.

    Args:
        kind: what the name should name ("strategy", "item type").
        name: the name given.
        known: all valid names.
        where: the house, file or table concerned, if that helps.
    """

    def __init__(self, kind: str, name: str, known: Iterable[str], where: str = "") -> None:
        names = sorted(known)
        near = get_close_matches(name.lower(), [n.lower() for n in names], n=3, cutoff=0.5)
        nearest = [n for lower in near for n in names if n.lower() == lower]
        shown = nearest or (names if name == "?" or len(names) <= MAX_LISTED else names[: MAX_LISTED // 2])
        more = len(names) - len(shown) if not nearest else 0
        listed = ", ".join(shown) + (f", and {more} more, which '?' lists" if more else "")
        place = f" in {shortened(where, 120)}" if where else ""
        hint = "Did you mean" if nearest else "Known are"
        super().__init__(f"no {kind} {shortened(name, 60)!r}{place}. {hint}: {listed or 'none'}.")


class MissingExtra(Unsupported):
    """A feature that needs an optional dependency.

    Args:
        what: what was asked for.
        extra: the extra of this distribution that installs it.
    """

    def __init__(self, what: str, extra: str) -> None:
        super().__init__(f"{what} needs an optional part. Install it: pip install 'lios-workbench[{extra}]'.")


def _unpickle_error(kind: type[LiosError], args: tuple[object, ...], attributes: dict[str, object]) -> LiosError:
    """Rebuild an error as it was in the process that raised it."""
    error = kind.__new__(kind, *args)
    error.args = args
    error.__dict__.update(attributes)
    return error


def _shown(value: object) -> str:
    """A value in a line; of a path, more is left, since its end says most."""
    return shortened(repr(str(value)), 300) if isinstance(value, Path) else shortened(repr(value), 80)


def shortened(text: str, limit: int) -> str:
    """The text, shortened to `limit` characters."""
    return text if len(text) <= limit else text[: limit - 3] + "..."
