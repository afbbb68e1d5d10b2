"""Sends copies of finished files and folders to an address."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path

from workbench.errors import BadValue, FileMissing, OutputExists
from workbench.remote.errors import NotWritable, TransferInterrupted, in_words, outside_errors
from workbench.remote.path import WEB, RemotePath, path_of
from workbench.terminal import counted, say

Pair = tuple[Path, RemotePath]
Progress = Callable[[Sequence[Pair]], Iterable[Pair]]


def upload_target(address: str) -> RemotePath:
    """The address that copies can go to; ask before a long work whose result is to be sent there.

    Raises:
        NotWritable: a path of this machine, or a web address.
        MissingExtra, NotAnAddress: the parts of its protocol are not installed; there is no such protocol.
    """
    path = path_of(address)
    if not isinstance(path, RemotePath):
        raise NotWritable(address, "this is a local path")
    if path.protocol in WEB:
        raise NotWritable(address, "web addresses cannot be written to")
    path.filesystem()
    return path


def upload(
    sources: Sequence[Path], address: str, *, force: bool = False, progress: Progress = iter
) -> Iterator[RemotePath]:
    """Copies files, and folders with all that is below them, and gives the address of each copy once it is there.

    One file takes the address as its name, unless that ends with a slash or is a folder already. What one folder
    holds goes below the address; several sources go below it under their names.

    Args:
        force: replace what is there.
        progress: wraps the pairs of file and address, for a progress bar.

    Raises:
        FileMissing: a source does not exist.
        OutputExists: something is there already; nothing has been sent then.
        NotWritable, NoCredentials, Unreachable: as the store answers.
        TransferInterrupted: a copy has another size than its file.
    """
    target = upload_target(address)
    pairs = _pairs(sources, target, inside=address.endswith("/"))
    if not force:
        for _, there in pairs:
            if there.exists():
                raise OutputExists(there)
    files = target.filesystem()
    for local, there in progress(pairs):
        try:
            files.put_file(str(local), str(there))
            files.invalidate_cache()
            size = files.size(str(there))
        except outside_errors() as error:
            raise in_words(error, there) from error
        if size != local.stat().st_size:
            raise TransferInterrupted(there, int(size or 0))
        yield there


def require_upload(address: str, output: Path | None) -> None:
    """Refuses a request to send on what will not be written, or to where nothing can be sent.

    Raises:
        BadValue: there is no output. And as upload_target.
    """
    if output is None:
        raise BadValue("--upload", address, "given together with -o, which says what is written")
    upload_target(address)


def send(output: Path, address: str, *, force: bool = True) -> None:
    """Sends what a command wrote, and says so."""
    sent = list(upload([output], address, force=force))
    say(f"Sent {sent[0]}" if len(sent) == 1 else f"Sent {counted(len(sent), 'file')} to {address}")


def _pairs(sources: Sequence[Path], target: RemotePath, *, inside: bool) -> list[Pair]:
    """Every file with the address of its copy."""
    alone = len(sources) == 1
    pairs: list[Pair] = []
    for source in sources:
        if source.is_dir():
            below = target if alone else target / source.name
            pairs += [(p, below / p.relative_to(source)) for p in sorted(source.rglob("*")) if p.is_file()]
        elif source.is_file():
            named = alone and not inside and not target.is_dir()
            pairs.append((source, target if named else target / source.name))
        else:
            raise FileMissing(source)
    return pairs
