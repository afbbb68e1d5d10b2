"""Paths of files at an address, such as https://host/run.mcap, s3://bucket/runs or memory://runs."""

from __future__ import annotations

import logging
import os
import re
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from fnmatch import fnmatch
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, final
from urllib.parse import unquote, urlsplit

from workbench.remote.errors import NotAnAddress, in_words, outside_errors

if TYPE_CHECKING:
    from fsspec import AbstractFileSystem

ADDRESS = re.compile(r"([a-z][a-z0-9+.-]+)://(.*)", re.DOTALL)
LOCAL = ("file", "local")
WEB = ("http", "https")
CHATTY = ("gcsfs",)
"""Loggers that print warnings and tracebacks of what is retried, beside the error that is raised in the end."""
PATTERN = re.compile(r"[*\[]")
"""What makes an address a pattern; a question mark begins the query of a web address."""


def path_of(text: str | Path) -> Path:
    """The path that a text means: a RemotePath for an address, and a local path for all others, also file://.

    Raises:
        NotAnAddress: one with an empty part, such as s3://bucket//key, which a path cannot keep.
    """
    if isinstance(text, Path):
        return text
    found = ADDRESS.fullmatch(text)
    if found is None:
        return Path(text)
    protocol, rest = found.groups()
    if protocol in LOCAL:
        return Path(unquote(urlsplit(text).path) if rest.startswith("/") else rest)
    plain = rest.strip("/") if protocol == "memory" else rest.rstrip("/")
    address = RemotePath(f"{protocol}://{plain}")
    if not plain or str(address) != f"{protocol}://{plain}":
        raise NotAnAddress(
            text, "it has an empty part, or a part that is only a dot" if plain else "it names no file"
        )
    return address


@final
class RemotePath(type(Path())):
    """A path at an fsspec address, with the methods of pathlib.Path that readers need; it cannot be written to.

    Its text is the address. Extra settings of a store, such as an endpoint, come from fsspec's own configuration.
    """

    @property
    def protocol(self) -> str:
        return self.parts[0].removesuffix(":")

    def __str__(self) -> str:
        first, *others = self.parts
        return f"{first}//{'/'.join(others)}"

    def __fspath__(self) -> str:
        return str(self)

    def __reduce__(self) -> tuple[type[Self], tuple[str, ...]]:
        return type(self), self.parts

    def filesystem(self) -> AbstractFileSystem:
        """The file system of its protocol, shared by all paths of one.

        Raises:
            MissingExtra, NotAnAddress: its parts are not installed; there is no such protocol.
        """
        with self._in_words():
            import fsspec

            for name in CHATTY:
                logging.getLogger(name).setLevel(logging.CRITICAL)
            return fsspec.filesystem(self.protocol)

    def details(self) -> dict[str, Any]:
        """What the store says of it: at least "size" (bytes, or None) and "type" ("file" or "directory").

        Raises:
            FileMissing, NoCredentials, Unreachable: as the store answers.
        """
        files = self.filesystem()
        with self._in_words():
            found: dict[str, Any] = files.info(str(self))
        if self.protocol in WEB and found.get("mimetype") == "text/html":
            found["type"] = "directory"
        return found

    def exists(self, *, follow_symlinks: bool = True) -> bool:
        """Whether something is there.

        Raises:
            NoCredentials, Unreachable: the store gives no answer.
        """
        from workbench.errors import FileMissing

        try:
            self.details()
        except FileMissing:
            return False
        return True

    def is_dir(self, *, follow_symlinks: bool = True) -> bool:
        return self.suffix != ".mcap" and self._type() == "directory"

    def is_file(self, *, follow_symlinks: bool = True) -> bool:
        return self._type() == "file"

    def _type(self) -> str | None:
        from workbench.errors import FileMissing

        try:
            return str(self.details().get("type", "file"))
        except FileMissing:
            # A bucket without an object is no key of a store, and still a place that can be listed.
            files = self.filesystem()
            with self._in_words():
                return "directory" if self.protocol not in WEB and files.isdir(str(self)) else None

    def stat(self, *, follow_symlinks: bool = True) -> os.stat_result:
        """Its size; the times are 0, since stores give them in many forms.

        Raises:
            FileMissing, NoCredentials, Unreachable: as the store answers.
        """
        return os.stat_result((0o100444, 0, 0, 1, 0, 0, self.details().get("size") or 0, 0, 0, 0))

    def read_bytes(self) -> bytes:
        """All of it.

        Raises:
            FileMissing, NoCredentials, Unreachable: as the store answers.
        """
        files = self.filesystem()
        with self._in_words():
            found: Any = files.cat_file(str(self))
            return bytes(found)

    def rglob(self, pattern: str, **_: Any) -> Iterator[Self]:  # pyright: ignore[reportIncompatibleMethodOverride]
        """The files below it whose names match, sorted.

        Raises:
            FileMissing, NoCredentials, Unreachable: as the store answers.
        """
        files = self.filesystem()
        with self._in_words():
            found: Any = files.find(f"{self}/" if self.protocol in WEB else str(self))
        yield from self._paths(name for name in found if fnmatch(name.rpartition("/")[2], pattern))

    def matching(self) -> Iterator[Self]:
        """The files that it means as a pattern with * and **, sorted.

        Raises:
            NoCredentials, Unreachable: as the store answers.
        """
        files = self.filesystem()
        with self._in_words():
            found: Any = files.glob(str(self))
        yield from self._paths(list(found))

    def is_pattern(self) -> bool:
        return PATTERN.search(str(self)) is not None

    def _paths(self, names: Iterator[str] | list[str]) -> Iterator[Self]:
        """Paths of names as a store lists them, with or without the protocol."""
        for name in sorted(names):
            rest = ADDRESS.fullmatch(name)
            yield type(self)(f"{self.protocol}://{(rest[2] if rest else name).lstrip('/')}")

    def resolve(self, strict: bool = False) -> Self:
        return self

    def absolute(self) -> Self:
        return self

    def samefile(self, other_path: str | os.PathLike[str]) -> bool:
        return str(self) == str(other_path)

    @contextmanager
    def _in_words(self) -> Generator[None]:
        try:
            yield
        except outside_errors() as error:
            raise in_words(error, self) from error
