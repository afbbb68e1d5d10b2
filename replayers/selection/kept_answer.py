"""What `lios select -o FOLDER` answered from: which kept replays are its candidates, under which names, and how they
were judged. A folder may keep the replays of several calls; the dashboard shows the answer of the last one."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import msgspec

from replayers.batch.replays import Replays
from replayers.batch.store import StoredReplay
from replayers.selection.campaign_logs import GroupBy
from replayers.selection.verdict import SelectionSettings
from workbench.errors import MalformedFile
from workbench.files import write_atomically

FILE = "selection.json"
VERSION = 1


class KeptCandidate(msgspec.Struct, frozen=True, kw_only=True):
    """One replay of a candidate: the key under which it is stored, and what the candidate and the driven one are
    called in the answer."""

    key: str
    log: str
    strategy: str
    recorded_strategy: str


class KeptFailure(msgspec.Struct, frozen=True, kw_only=True):
    """A log, or a candidate over it, that could not be replayed."""

    log: str
    strategy: str
    reason: str


class KeptAnswer(msgspec.Struct, frozen=True, kw_only=True):
    """One call of `lios select`."""

    version: int = VERSION
    estimators: tuple[str, ...]
    group_by: GroupBy
    alpha: float
    horizon: int | None
    seed: int
    candidates: tuple[KeptCandidate, ...]
    failed: tuple[KeptFailure, ...]

    @property
    def settings(self) -> SelectionSettings:
        """How its answer was made."""
        return SelectionSettings(alpha=self.alpha, horizon=self.horizon, seed=self.seed)

    @property
    def names(self) -> tuple[str, ...]:
        """The candidates that were replayed."""
        return tuple(dict.fromkeys(c.strategy for c in self.candidates))

    def of(self, records: Iterable[StoredReplay]) -> tuple[StoredReplay, ...]:
        """Its replays among those of a folder, in its order and under its names."""
        by_key = {record.key: record for record in records}
        return tuple(
            msgspec.structs.replace(
                by_key[c.key], strategy=c.strategy, recorded_strategy=c.recorded_strategy, log=c.log
            )
            for c in self.candidates
            if c.key in by_key
        )


def keep_answer(
    folder: Path, made: Replays, settings: SelectionSettings, *, estimators: tuple[str, ...], group_by: GroupBy
) -> Path:
    """Writes into the folder of the replays from which ones an answer was made, and how."""
    answer = KeptAnswer(
        estimators=estimators,
        group_by=group_by,
        alpha=settings.alpha,
        horizon=settings.horizon,
        seed=settings.seed,
        candidates=tuple(
            KeptCandidate(key=r.key, log=r.log, strategy=r.strategy, recorded_strategy=r.recorded_strategy)
            for r in made
        ),
        failed=tuple(KeptFailure(log=f.log, strategy=f.strategy, reason=f.reason) for f in made.failed),
    )
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / FILE
    write_atomically(path, msgspec.json.format(msgspec.json.encode(answer), indent=1))
    return path


def read_answer(path: Path) -> KeptAnswer:
    """Reads it.

    Raises:
        MalformedFile: it is something else, or of another version.
    """
    try:
        answer = msgspec.json.decode(path.read_bytes(), type=KeptAnswer)
    except (OSError, msgspec.MsgspecError, UnicodeDecodeError) as error:
        raise MalformedFile(
            path, f"this is no answer of lios select ({error})", "Call lios select -o again"
        ) from None
    if answer.version != VERSION:
        raise MalformedFile(
            path, f"an answer of another release (version {answer.version})", "Call lios select again"
        )
    return answer
