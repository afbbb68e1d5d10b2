"""Reading house files (.jsonl.gz, .jsonl and .json) line by line, with bounded memory."""

from __future__ import annotations

import gzip
import json
import zlib
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, NoReturn, cast

from workbench.errors import BadValue, FileMissing, MalformedFile, NotFound
from workbench.worlds.shipped import house_file, shipped_houses

MAX_LINE_BYTES = 64 * 1024 * 1024
"""Longest accepted house in bytes, decompressed; real houses take well under one MiB."""

SUFFIXES = (".jsonl.gz", ".jsonl", ".json.gz", ".json")

PROCTHOR_HINT = "Give a ProcTHOR file: .jsonl.gz or .jsonl with one house a line, or .json with one house"


class HouseIndexOutOfRange(NotFound):
    """A file has fewer houses than the index asks for."""

    def __init__(self, path: Path, index: int, count: int) -> None:
        super().__init__(
            f"{path} has no house {index}. It holds {count}: give {path.name}:0 to {path.name}:{count - 1}."
        )


class HouseIndexMissing(NotFound):
    """A file of several houses was given without an index where one house is needed."""

    def __init__(self, path: Path) -> None:
        super().__init__(f"{path} may hold many houses. Say which one, counted from 0: {path}:0.")


class NumberIsNoAddress(NotFound):
    """A house was named by a number alone."""

    def __init__(self, address: str) -> None:
        super().__init__(
            f"{address}: no such file. Of the shipped houses give houses:{address}, of others FILE:{address}."
        )


def split_address(address: str) -> tuple[Path, int | None]:
    """ "FILE:17" -> (FILE, 17); "house.json" -> (house.json, None); "houses:9", as logs name it, and "houses" of the
    shipped file.

    Raises:
        NumberIsNoAddress: a number alone.
        FileMissing: no such file.
        MalformedFile: a folder.
        BadValue: an index that is not a whole number.
    """
    if _is_file(address) or house_file(Path(address)) != Path(address):
        return house_file(Path(address)), None
    if address.isascii() and address.isdigit():
        raise NumberIsNoAddress(address)
    name, colon, index = address.rpartition(":")
    if colon and name == house_stem(shipped_houses()):
        name = str(shipped_houses())
    if not colon or not name.lower().endswith(SUFFIXES):
        if colon and _is_file(name) and name.lower().endswith((".yaml", ".yml")):
            raise BadValue("house", address, f"{name}, which holds one house and needs no index")
        if colon and _is_file(name):
            raise BadValue("house file", name, "a file that ends in " + ", ".join(SUFFIXES))
        if Path(address).is_dir():
            raise MalformedFile(address, "a folder", PROCTHOR_HINT)
        raise FileMissing(address)
    if not _is_file(name):
        raise FileMissing(name)
    if not index.isascii() or not index.isdigit() or len(index) > 9:
        raise BadValue(f"house index of {address}", index, "a whole number from 0")
    return Path(name), int(index)


def house_stem(path: Path) -> str:
    """ "multi_room_train.jsonl.gz" -> "multi_room_train"."""
    for suffix in SUFFIXES:
        if path.name.lower().endswith(suffix):
            return path.name[: -len(suffix)]
    return path.stem


def is_many(path: Path) -> bool:
    """Whether a file holds one house a line."""
    return path.name.lower().endswith((".jsonl.gz", ".jsonl"))


def house_lines(path: Path) -> Iterator[tuple[int, bytes]]:
    """Yield the index and the JSON text of every house of a file; a .json file is one house.

    Raises:
        FileMissing, MalformedFile: the file is missing; it is truncated, not text, or has a house longer than
            MAX_LINE_BYTES.
    """
    if not path.exists():
        raise FileMissing(path)
    if path.is_dir():
        raise MalformedFile(path, "a folder", PROCTHOR_HINT)
    if path.suffix in (".yaml", ".yml"):
        raise MalformedFile(path, "one place in YAML, which --house takes", "Here, give a ProcTHOR file")
    with _opened(path) as stream:
        if not is_many(path):
            yield 0, _bounded(stream.read(MAX_LINE_BYTES + 1), path, 0)
            return
        index = 0
        while line := _bounded(stream.readline(MAX_LINE_BYTES + 1), path, index):
            if line.strip():
                yield index, line
                index += 1
        if index == 0:
            raise MalformedFile(path, "it holds no house", PROCTHOR_HINT)


def house_line(path: Path, index: int) -> bytes:
    """The JSON text of the house with that index.

    Raises:
        HouseIndexOutOfRange: the file is shorter.
    """
    count = 0
    for found, line in house_lines(path):
        if found == index:
            return line
        count = found + 1
    raise HouseIndexOutOfRange(path, index, count)


def explain_bad_json(path: Path, index: int, line: bytes, reason: str) -> NoReturn:
    """Raise an error that explains why a line is not a valid house.

    Raises:
        MalformedFile: always; the message names NaN and Infinity, which JSON does not have.
    """
    where = f"house {index} " if is_many(path) else ""

    def not_finite(constant: str) -> NoReturn:
        raise MalformedFile(path, f"{where}holds {constant}", "Every coordinate must be a finite number of metres")

    if not line.strip():
        raise MalformedFile(path, f"{where}is empty", PROCTHOR_HINT)
    try:
        json.loads(line, parse_constant=not_finite)
    except RecursionError:
        reason = "it is nested too deeply"
    except UnicodeDecodeError:
        reason = "it is not text"
    except ValueError as error:
        reason = str(error)
    raise MalformedFile(path, f"{where}is no house: {reason}", PROCTHOR_HINT)


@contextmanager
def _opened(path: Path) -> Generator[IO[bytes]]:
    """Open a file, decompressed if its name ends in .gz; read errors become MalformedFile."""
    try:
        with path.open("rb") as raw:
            packed = path.name.lower().endswith(".gz")
            yield cast("IO[bytes]", gzip.GzipFile(fileobj=raw)) if packed else raw
    except EOFError:
        raise MalformedFile(path, "the gzip data ends too early", "Download or copy the file again") from None
    except (gzip.BadGzipFile, zlib.error) as error:
        raise MalformedFile(path, f"no valid gzip ({error})", "Download or copy the file again") from None
    except OSError as error:
        raise MalformedFile(path, f"it cannot be read ({error.strerror or error})", "Check the file") from None


def _is_file(name: str) -> bool:
    """Whether a name is an existing file; False for invalid file names."""
    try:
        return Path(name).is_file()
    except (OSError, ValueError):
        return False


def _bounded(data: bytes, path: Path, index: int) -> bytes:
    if len(data) > MAX_LINE_BYTES:
        raise MalformedFile(path, f"house {index} is longer than {MAX_LINE_BYTES // 2**20} MiB", PROCTHOR_HINT)
    return data
