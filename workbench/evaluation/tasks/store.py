"""The folder of a task evaluation, which stores rows as they come so that a stopped evaluation can be resumed.

Rows go to OUTPUT/trials.jsonl as they come, flushed one by one; after a kill, only missing trials are run.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import BinaryIO

import msgspec

from workbench.errors import InputError, MalformedFile
from workbench.evaluation.stored_results import EvaluationInProgress
from workbench.evaluation.tasks.experiment import TaskRequest
from workbench.evaluation.tasks.rows import SETTINGS_FILE, TRIALS_FILE, TaskRow, read_rows
from workbench.file_lock import locked
from workbench.files import write_atomically

LOCK_FILE = ".lock"


class DifferentEvaluation(InputError):
    """The folder holds the trials of another evaluation."""

    def __init__(self, folder: Path, field: str, theirs: object, ours: object) -> None:
        super().__init__(
            f"{folder} holds another evaluation: its {field} is {theirs!r}, not {ours!r}. "
            "Give another -o, or --force."
        )


class TrialStore:
    """The folder of an evaluation, with its settings and the rows so far.

    Attributes:
        rows: the stored rows.

    Raises:
        EvaluationInProgress: another process writes there.
        DifferentEvaluation: the folder holds rows of another request.
        MalformedFile: its files are invalid.
    """

    def __init__(self, folder: Path, request: TaskRequest, *, force: bool = False) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        self._lock = _locked_folder(folder)
        try:
            self.rows = self._begun(request, force=force)
            self._stream = (folder / TRIALS_FILE).open("ab")
        except BaseException:
            self._lock.close()
            raise

    def _begun(self, request: TaskRequest, *, force: bool) -> list[TaskRow]:
        """Write the settings and return the stored rows."""
        settings, trials = self.folder / SETTINGS_FILE, self.folder / TRIALS_FILE
        if force:
            trials.unlink(missing_ok=True)
        elif settings.exists() and trials.exists() and trials.stat().st_size:
            _same_request(self.folder, read_request(settings), request)
        write_atomically(settings, msgspec.json.format(msgspec.json.encode(request), indent=2) + b"\n")
        rows = read_rows(trials, torn_is_fine=True) if trials.exists() else []
        # drops only an incomplete last row
        write_atomically(trials, b"".join(msgspec.json.encode(row) + b"\n" for row in rows))
        return rows

    def __enter__(self) -> TrialStore:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def add(self, rows: Iterable[TaskRow]) -> None:
        for row in rows:
            self.rows.append(row)
            self._stream.write(msgspec.json.encode(row) + b"\n")
        self._stream.flush()

    def close(self) -> None:
        self._stream.close()
        self._lock.close()


def _locked_folder(folder: Path) -> BinaryIO:
    """Lock the folder against other evaluations until closed, where the system supports it."""
    lock = (folder / LOCK_FILE).open("ab")
    if not locked(lock):
        lock.close()
        raise EvaluationInProgress(folder)
    return lock


SAME_FIELDS = (
    "houses",
    "split",
    "seed",
    "estimator",
    "paper_estimator",
    "assets",
    "folds",
    "also",
    "miss_rate",
    "sees_m",
)
"""What an evaluation has in common with the one that it extends."""


def _same_request(folder: Path, theirs: TaskRequest, ours: TaskRequest) -> None:
    """Check that only trials, scenarios or strategies differ, which extend the evaluation."""
    for field in SAME_FIELDS:
        if getattr(theirs, field) != getattr(ours, field):
            raise DifferentEvaluation(folder, field, getattr(theirs, field), getattr(ours, field))


def read_request(path: Path) -> TaskRequest:
    try:
        return msgspec.json.decode(path.read_bytes(), type=TaskRequest)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise MalformedFile(path, f"not the settings of an evaluation: {error}", "Give another folder") from error
