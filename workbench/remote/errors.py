"""Errors of files at addresses, and what an error of fsspec or of the library below it means."""

from __future__ import annotations

import sys
from pathlib import Path

from workbench.errors import FileMissing, InputError, LiosError, MalformedFile, MissingExtra, NotFound, Unsupported

LIBRARY_ERRORS = (
    ("aiohttp", "ClientError"),
    ("botocore.exceptions", "BotoCoreError"),
    ("google.auth.exceptions", "GoogleAuthError"),
    ("gcsfs.retry", "HttpError"),
    ("fsspec.exceptions", "FSTimeoutError"),
)
"""What the libraries below fsspec raise, by module and class; each is asked for only where it is loaded."""
REFUSED = (401, 403)


class Unreachable(InputError):
    """A server that does not answer, or answers with an error."""

    def __init__(self, address: Path | str, why: str) -> None:
        super().__init__(f"{address}: cannot be reached ({why}). Check the address and the connection.")


class NoCredentials(InputError):
    """A server that refuses, or a store for which no credentials are set."""

    def __init__(self, address: Path | str, why: str) -> None:
        how = "Set them as its own tools expect (AWS_PROFILE, GOOGLE_APPLICATION_CREDENTIALS), or see docs/remote.md"
        super().__init__(f"{address}: credentials are missing or refused ({why}). {how}.")


class RangesUnsupported(Unsupported):
    """A server that sends whole files only."""

    def __init__(self, address: Path | str) -> None:
        super().__init__(f"{address}: its server does not support range requests. Download it and open the copy.")


class TransferInterrupted(InputError):
    """A transfer that ends before its end, again after a second try."""

    def __init__(self, address: Path | str, offset: int) -> None:
        super().__init__(f"{address}: the connection broke off at byte {offset}, twice. Try again, or download it.")


class NotAnAddress(NotFound):
    """An address that cannot be kept as a path, or of a protocol that is not known."""

    def __init__(self, address: str, why: str) -> None:
        super().__init__(f"{address}: {why}. Give one such as https://host/run.mcap or s3://bucket/runs/.")


class LocalFileRequired(Unsupported):
    """A file at an address where a local one is needed."""

    def __init__(self, where: str, address: Path | str) -> None:
        super().__init__(f"{where} is {address}; it must be a local path. To send a copy: lios upload FILE ADDRESS.")


class NotWritable(Unsupported):
    """An address to which nothing can be sent."""

    def __init__(self, address: Path | str, why: str) -> None:
        super().__init__(f"{address}: {why}. Give an address of a store, such as s3://bucket/runs/.")


def outside_errors() -> tuple[type[Exception], ...]:
    """What reading from an address may raise, apart from errors of ours."""
    loaded = [getattr(sys.modules.get(module), name, None) for module, name in LIBRARY_ERRORS]
    return (OSError, ValueError, ImportError, *(kind for kind in loaded if isinstance(kind, type)))


def in_words(error: Exception, address: Path | str) -> LiosError:
    """The error of ours that an error of outside_errors() means."""
    cause = error.__cause__
    if isinstance(error, FileNotFoundError) and isinstance(cause, outside_errors()) and cause is not error:
        return in_words(cause, address)  # so fsspec reports whatever a web server answers
    why = " ".join(str(error).split())[:160] or type(error).__name__
    kind, status = type(error).__name__, getattr(error, "status", None) or getattr(error, "code", None)
    if isinstance(error, LiosError):
        return error
    if isinstance(error, ImportError):
        return MissingExtra(f"reading {address}", "remote")
    if isinstance(error, FileNotFoundError) or status == 404:
        return FileMissing(address)
    if isinstance(error, IsADirectoryError):
        return MalformedFile(address, "it is a folder", "Give one log; lios list shows a folder")
    if isinstance(error, PermissionError) or "Credential" in kind or "Auth" in kind or status in REFUSED:
        return NoCredentials(address, why)
    if isinstance(error, ValueError) and ("range requests" in why or "seek" in why):
        return RangesUnsupported(address)
    if isinstance(error, ValueError) and "Protocol not known" in why:
        return NotAnAddress(str(address), "no such protocol is known")
    return Unreachable(address, why)
