"""The resolver of plug-in names: which code a strategy's, policy's, estimator's or solver's name may run; and the
commands of installed packages.

One rule holds for all four kinds. A built-in name is in its kind's own table and never comes here: an installed
plug-in of that name is left out, which is told. Other names are entry points of installed packages, or, only where a
user gives them, `module:Class` from the working folder or the installed packages. A log may come from anyone: a name
that it gives is built in or installed, or it is refused.
While such a name is resolved, the working folder is not on the import path, since it may have come with the log.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Generator, Iterable, Mapping
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property, lru_cache
from importlib import import_module
from importlib.machinery import ModuleSpec
from importlib.metadata import EntryPoint, PackageNotFoundError, distribution, entry_points
from importlib.util import find_spec
from pathlib import Path
from typing import final
from urllib.parse import urlsplit

import msgspec

from workbench.errors import UnknownName, Unsupported
from workbench.terminal import say


class NameOrigin(StrEnum):
    """Who gives a name; it decides what the name may run. A call that does not say means LOG, which may run least."""

    USER = "user"
    """Typed on the command line, or given by a caller who vouches for it: everything is allowed."""
    LOG = "log"
    """Read from a log or another file: built-in names and entry points of installed packages only."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class PluginKind:
    """A kind of plug-in.

    Attributes:
        noun: what messages call one.
        group: the entry-point group of installed ones.
        option: the command-line option by which a user names one.
    """

    noun: str
    group: str
    option: str


STRATEGY = PluginKind(noun="strategy", group="lios.strategies", option="--strategy")
POLICY = PluginKind(noun="search policy", group="lios.policies", option="--policies")
ESTIMATOR = PluginKind(noun="estimator", group="lios.estimators", option="--estimator")
SOLVER = PluginKind(noun="solver", group="lios.solvers", option="--solver")


class NotFromLog(Unsupported):
    """A name that only a user may give, and nobody said that a user did.

    Args:
        name: as the log has it.
    """

    def __init__(self, kind: PluginKind, name: str) -> None:
        super().__init__(
            f"{kind.noun} {quoted(name)} is neither built in nor installed, and a name that a log gives runs nothing "
            f"else. If you trust it, give it yourself with {kind.option} (in Python: origin=NameOrigin.USER)."
        )


class PluginNotLoaded(Unsupported):
    """A plug-in that cannot be imported or made, or is not of its kind.

    Args:
        name: as it was asked for.
        why: what went wrong, without a full stop.
    """

    def __init__(self, kind: PluginKind, name: str, why: str) -> None:
        facts = " ".join(why.split())
        super().__init__(
            f"{kind.noun} {name!r} cannot be loaded: {facts}. "
            "Correct the name or its module, or install what it imports."
        )


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Plugin:
    """What a name outside the built-in tables stands for; resolved, and not yet imported.

    Attributes:
        entry: the entry point of an installed package; None for `module:Class`.
    """

    kind: PluginKind
    name: str
    origin: NameOrigin
    entry: EntryPoint | None

    @property
    def module(self) -> str:
        """The dotted name of the module that is imported."""
        return self.entry.module if self.entry is not None else self.name.partition(":")[0]

    def load(self) -> object:
        """The object that the name stands for. Runs its module; raises whatever that raises."""
        with self.import_path():
            if self.entry is not None:
                return self.entry.load()
            return getattr(import_module(self.module), self.name.partition(":")[2])

    def import_path(self) -> AbstractContextManager[None]:
        """The import path on which its code is found and made: see import_path."""
        return import_path(self.origin, installed_from=_editable_folder(self.entry))


def plugin(kind: PluginKind, name: str, *, origin: NameOrigin, known: Iterable[str]) -> Plugin:
    """The plug-in of a name that is not built in. Runs none of its code.

    Args:
        known: the built-in names, for the error.

    Raises:
        NotFromLog: `module:Class` or a command line that a log gives.
        UnknownName: neither installed nor `module:Class`; lists what is known.
    """
    entry = next((entry for entry in _installed(kind) if entry.name == name), None)
    if entry is None and ":" not in name:
        raise UnknownName(kind.noun, name, (*known, *installed_names(kind)))
    if entry is None and origin is not NameOrigin.USER:
        raise NotFromLog(kind, name)
    return Plugin(kind=kind, name=name, origin=origin, entry=entry)


def installed_names(kind: PluginKind, built_in: Callable[[str], bool] = lambda _: False) -> tuple[str, ...]:
    """The names of a kind's installed plug-ins, sorted, without those that are built in."""
    return tuple(entry.name for entry in installed_entries(kind, built_in))


def installed_entries(kind: PluginKind, built_in: Callable[[str], bool] = lambda _: False) -> tuple[EntryPoint, ...]:
    """The entry points of a kind's group, one for each name, sorted by name, without those that are built in."""
    found: dict[str, EntryPoint] = {}
    for entry in _installed(kind):
        found.setdefault(entry.name, entry)
    return tuple(entry for name, entry in sorted(found.items()) if not built_in(name))


def left_out(kind: PluginKind, built_in: Callable[[str], bool]) -> tuple[str, ...]:
    """What is installed and cannot be named, since a built-in one or that of another package has the name; a line
    each."""
    first: dict[str, EntryPoint] = {}
    lines: list[str] = []
    for entry in _installed(kind):
        if built_in(entry.name):
            lines.append(_taken(kind, entry, "a built-in one has its name"))
        elif first.setdefault(entry.name, entry) is not entry:
            lines.append(_taken(kind, entry, f"that of {package_of(first[entry.name])} has its name"))
    return tuple(lines)


@lru_cache(maxsize=256)
def tell_left_out(kind: PluginKind, name: str) -> None:
    """Says, once a process, which installed plug-ins do not run although a user gave their name: the built-in one
    does."""
    for entry in _installed(kind):
        if entry.name == name:
            say(f"note: {_taken(kind, entry, 'a built-in one has its name')}")


def taken_name(name: str) -> str:
    """Why a plug-in of this own name is of no use, where a built-in one has it: tables and logs could not tell them
    apart."""
    return f"it calls itself {quoted(name)}, which is the name of a built-in one"


def package_of(entry: EntryPoint) -> str:
    """The package that an entry point is of."""
    return entry.dist.name if entry.dist is not None else "another package"


def _taken(kind: PluginKind, entry: EntryPoint, why: str) -> str:
    return f"{kind.noun} {entry.name!r} of {package_of(entry)} is left out: {why}. It needs another one."


class CommandEntries:
    """The entry points of commands by full name: this distribution's own, and then those of others.

    A name of ours, of a command or a group, is nobody else's, and nothing is put below one of our commands. The same
    holds for the packages among themselves, the first by name before the others.
    """

    GROUP = "lios.commands"

    @cached_property
    def own(self) -> dict[str, EntryPoint]:
        """Empty for a source tree that was never installed."""
        return {entry.name: entry for entry in own_entries(self.GROUP)}

    @cached_property
    def all(self) -> dict[str, EntryPoint]:
        """This reads a file of every installed distribution."""
        return self._others[0] | self.own

    @cached_property
    def left_out(self) -> dict[str, str]:
        """The lines that say whose commands are left out, by the full names of these commands."""
        return self._others[1]

    @cached_property
    def _others(self) -> tuple[dict[str, EntryPoint], dict[str, str]]:
        kept: dict[str, EntryPoint] = {}
        lines: dict[str, str] = {}
        ours = {(entry.name, entry.value) for entry in self.own.values()}
        found = (e for e in entry_points(group=self.GROUP) if (e.name, e.value) not in ours)
        for entry in sorted(found, key=lambda e: (package_of(e), e.name)):
            taken = _taken_by(entry.name, self.own | kept)
            if taken is None:
                kept[entry.name] = entry
                continue
            lines[entry.name] = (
                f"note: command {_words(entry.name)} of {package_of(entry)} is left out: "
                f"{_whose(taken, entry.name, self.own)}. It needs another name."
            )
        return kept, lines

    def get(self, name: str) -> EntryPoint | None:
        return self.own.get(name) or self.all.get(name)


def _words(name: str) -> str:
    """The full name of a command, as it is typed."""
    return f'"{name.replace(".", " ")}"'


def _whose(taken: EntryPoint, name: str, own: Mapping[str, EntryPoint]) -> str:
    """Who has a command's name, in words."""
    owner = "lios" if taken.name in own else package_of(taken)
    if name.startswith(f"{taken.name}."):
        return f"{_words(taken.name)} of {owner} is no group"
    return f"{owner} has a {'command' if taken.name == name else 'group'} of that name"


def _taken_by(name: str, found: dict[str, EntryPoint]) -> EntryPoint | None:
    """The command that has a name, is in a group of that name, or stands above it; None where it is free."""
    dotted = f"{name}."
    return next(
        (e for full, e in found.items() if f"{full}.".startswith(dotted) or dotted.startswith(f"{full}.")), None
    )


def own_entries(group: str) -> tuple[EntryPoint, ...]:
    """This distribution's own entry points of a group; none for a source tree that was never installed."""
    try:
        found = distribution("lios-workbench").entry_points
    except PackageNotFoundError:
        return ()
    return tuple(entry for entry in found if entry.group == group)


def installed_module(name: str) -> ModuleSpec | None:
    """Where a top-level module is installed, as find_spec, but never in the working folder."""
    with import_path(NameOrigin.LOG):
        return find_spec(name)


def quoted(name: str) -> str:
    """An untrusted name as one short line: escaped, quoted, and cut after 80 characters."""
    return repr(name if len(name) <= 80 else f"{name[:77]}...")


@contextmanager
def import_path(origin: NameOrigin, *, installed_from: Path | None = None) -> Generator[None]:
    """The import path for names of an origin.

    For a user's names the working folder comes first, and stays on the path, last, for what they import later. For a
    log's names it is taken off, unless Python itself found this package, or the plug-in, installed from there.

    Args:
        installed_from: the folder from which the plug-in is installed in editable mode.
    """
    here = _working_folder()
    if here is None:
        yield
    elif origin is NameOrigin.USER:
        with _first_and_then_last(here):
            yield
    elif here in (Path(__file__).resolve().parents[1], installed_from):
        yield
    else:
        with _without(here):
            yield


@contextmanager
def _first_and_then_last(folder: Path) -> Generator[None]:
    if any(_means(entry, folder) for entry in sys.path[:1]):
        yield
        return
    before = [entry for entry in sys.path if _means(entry, folder)]
    sys.path.insert(0, str(folder))
    try:
        yield
    finally:
        with suppress(ValueError):
            sys.path.remove(str(folder))
        if not before:
            sys.path.append(str(folder))


@contextmanager
def _without(folder: Path) -> Generator[None]:
    before = list(sys.path)
    sys.path[:] = [entry for entry in before if not _means(entry, folder)]
    rest = list(sys.path)
    try:
        yield
    finally:
        sys.path[:] = before + [entry for entry in sys.path if entry not in rest]


def _installed(kind: PluginKind) -> tuple[EntryPoint, ...]:
    """By name and package. A package whose metadata is merely in the working folder is not installed."""
    with import_path(NameOrigin.LOG):
        return _entries(kind.group, tuple((entry, _changed_ns(entry)) for entry in sys.path))


@lru_cache(maxsize=64)
def _entries(group: str, folders: tuple[tuple[str, int | None], ...]) -> tuple[EntryPoint, ...]:
    """A group's entry points. This reads a file of every installed distribution, once.

    Args:
        folders: the import path, with the time at which each folder changed: a package may be installed meanwhile.
    """
    return tuple(sorted(entry_points(group=group), key=lambda entry: (entry.name, package_of(entry))))


def _changed_ns(entry: str) -> int | None:
    try:
        return os.stat(entry or ".").st_mtime_ns
    except (OSError, ValueError):
        return None


def _editable_folder(entry: EntryPoint | None) -> Path | None:
    """The folder from which an entry point's package is installed in editable mode (PEP 610), or None."""
    stored = entry.dist.read_text("direct_url.json") if entry is not None and entry.dist is not None else None
    if not stored:
        return None
    from urllib.request import url2pathname

    try:
        origin = msgspec.json.decode(stored, type=_DirectUrl)
        return Path(url2pathname(urlsplit(origin.url).path)).resolve() if origin.dir_info.editable else None
    except (msgspec.MsgspecError, ValueError, OSError):
        return None


class _DirInfo(msgspec.Struct, frozen=True):
    editable: bool = False


class _DirectUrl(msgspec.Struct, frozen=True):
    url: str
    dir_info: _DirInfo = _DirInfo()


def _working_folder() -> Path | None:
    """Resolved; None where it was removed."""
    try:
        return Path.cwd().resolve()
    except OSError:
        return None


def _means(entry: str, folder: Path) -> bool:
    """Whether an entry of the import path is that folder; an empty one is the working folder."""
    try:
        return Path(entry or ".").resolve() == folder
    except (OSError, RuntimeError, ValueError):
        return False
