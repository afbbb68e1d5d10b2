"""Results stored one by one in a file, so that a stopped evaluation can be resumed.

Each line of the file is a result with the key of its unit: a digest of all that the result depends on. What has
another key, or cannot be read, such as a line that a kill cut off, is computed again.
"""

from __future__ import annotations

import hashlib
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Generic, TypeVar

import msgspec

from workbench import __version__
from workbench.errors import InputError
from workbench.file_lock import locked
from workbench.files import naming
from workbench.plugins import NameOrigin, import_path

Unit = TypeVar("Unit")
Result = TypeVar("Result")


class EvaluationInProgress(InputError):
    """Another process writes to the folder."""

    def __init__(self, folder: Path) -> None:
        super().__init__(f"{folder} is being written by another evaluation. Wait for it, or give another -o.")


class _Line(msgspec.Struct, frozen=True, kw_only=True):
    key: str
    result: msgspec.Raw


class StoredResults(Generic[Result]):
    """The results in a file, and those that are added to it, each written out at once.

    Args:
        path: the file; made if needed.
        kind: the type of a result.

    Raises:
        EvaluationInProgress: another process writes it.
    """

    def __init__(self, path: Path, kind: type[Result]) -> None:
        self.path, self._kind = path, kind
        self._stream = path.open("ab")
        if not locked(self._stream):
            self._stream.close()
            raise EvaluationInProgress(path.parent)
        data = path.read_bytes()
        if data and not data.endswith(b"\n"):
            self._stream.write(b"\n")
        self._found = dict(_readable(data.splitlines(), kind))

    def __enter__(self) -> StoredResults[Result]:
        return self

    def __exit__(self, *_: object) -> None:
        with naming(self.path):
            self._stream.close()

    def __len__(self) -> int:
        return len(self._found)

    def find(self, key: str) -> Result | None:
        return self._found.get(key)

    def add(self, key: str, result: Result) -> None:
        self._found[key] = result
        line = _Line(key=key, result=msgspec.Raw(msgspec.json.encode(result)))
        with naming(self.path):
            self._stream.write(msgspec.json.encode(line) + b"\n")
            self._stream.flush()

    def discard(self) -> None:
        """Remove the file: the evaluation is complete, and its report holds everything."""
        self._stream.close()
        self.path.unlink(missing_ok=True)


def run_resumable(
    units: Iterable[Unit],
    kept: StoredResults[Result],
    *,
    key: Callable[[Unit], str],
    run: Callable[[Iterable[Unit]], Iterator[Result]],
) -> Iterator[Result]:
    """Yield the results of all units in their order: the kept ones, and those of the others as they are run.

    Args:
        key: of a unit.
        run: runs units, taken as they are needed, and yields their results in order.
    """
    order: deque[tuple[str, Result | None]] = deque()

    def missing() -> Iterator[Unit]:
        for unit in units:
            name = key(unit)
            found = kept.find(name)
            order.append((name, found))
            if found is None:
                yield unit

    for result in run(missing()):
        while (found := order[0][1]) is not None:
            order.popleft()
            yield found
        kept.add(order.popleft()[0], result)
        yield result
    yield from (found for _, found in order if found is not None)


def key_of(*parts: object) -> str:
    """The key of a unit with these parts, this version of the package included."""
    return hashlib.sha256(msgspec.json.encode([__version__, *parts])).hexdigest()


def content_of(name: str) -> str:
    """What stands behind a name that a user gives: a digest of a file, or of the file of a "module:Class".

    Of a name that is registered here, the name. What a module imports is not looked at.
    """
    file = Path(name)
    module, colon, _ = name.partition(":")
    if not file.is_file() and colon:
        with import_path(NameOrigin.USER):
            try:
                spec = find_spec(module)
            except (ImportError, ValueError):
                return name
        file = Path(spec.origin) if spec is not None and spec.origin else file
    return hashlib.sha256(file.read_bytes()).hexdigest() if file.is_file() else name


def _readable(lines: Iterable[bytes], kind: type[Result]) -> Iterator[tuple[str, Result]]:
    for line in lines:
        try:
            held = msgspec.json.decode(line, type=_Line)
            yield held.key, msgspec.json.decode(held.result, type=kind)
        except (msgspec.MsgspecError, UnicodeDecodeError):
            continue
