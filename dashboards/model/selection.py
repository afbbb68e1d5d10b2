"""The strategy to drive next, from the replays stored in a folder, for the dashboard of that folder.

Their logs are in the folder, or where the replays say that they were read: `lios select LOGS -o FOLDER` keeps only
the replays.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import msgspec

from replayers.batch.breakdown import fewest_misses
from replayers.batch.replays import Replays
from replayers.batch.store import StoredReplay, replays_in
from replayers.counterfactual.prepared_log import ReplaySettings
from replayers.selection.campaign_logs import GroupBy, TrialGroup, trial_groups
from replayers.selection.verdict import SelectionSettings, SelectionVerdict, history


@dataclass(frozen=True, slots=True, kw_only=True)
class FolderSelection:
    """The campaigns of a folder.

    Attributes:
        groups: trials that can be compared, each with what is known after every trial.
        left_out: what counts for nothing, with the reason, one line each.
        alpha: the error of eliminations by sequence.
    """

    groups: tuple[tuple[TrialGroup, tuple[SelectionVerdict, ...]], ...] = ()
    left_out: tuple[str, ...] = ()
    alpha: float = SelectionSettings().alpha


def selection_in(folder: Path) -> FolderSelection:
    """The selection from all replays that are kept in a folder, over their logs; nothing is replayed."""
    skipped: list[str] = []
    stored = fewest_misses(replays_in(folder, on_skipped=lambda error: skipped.append(str(error))))
    kept = _with_logs(stored, folder, skipped.append)  # a folder may keep the replays of several calls
    names = tuple(dict.fromkeys(record.strategy for record in kept))
    if len(names) < 2:
        return FolderSelection(left_out=tuple(skipped))
    logs = tuple(dict.fromkeys(Path(record.log) for record in kept))
    made = Replays(outcomes=kept, logs=logs, settings=ReplaySettings())
    grouped = trial_groups(made, names, GroupBy.SCENARIO)
    settings = SelectionSettings()
    return FolderSelection(
        groups=tuple((group, tuple(history(group.trials, settings))) for group in grouped.groups),
        left_out=(*grouped.left_out, *skipped),
        alpha=settings.alpha,
    )


def _with_logs(
    records: Iterable[StoredReplay], folder: Path, tell: Callable[[str], None]
) -> tuple[StoredReplay, ...]:
    """The replays whose logs are there, with the paths at which they are."""
    inside: dict[str, list[Path]] = {}
    for path in sorted(folder.rglob("*.mcap")):
        inside.setdefault(path.name, []).append(path)
    found: dict[str, Path | None] = {}
    kept: list[StoredReplay] = []
    for record in records:
        if record.sha256 not in found:
            given = Path(record.log)
            places = (*inside.get(given.name, ()), given, folder / given, folder.parent / given)
            found[record.sha256] = next((p for p in places if _is_log(p, record.sha256)), None)
            if found[record.sha256] is None:
                tell(f"{record.log}: the log of these replays is not there any more, or was changed")
        at = found[record.sha256]
        if at is not None:
            kept.append(msgspec.structs.replace(record, log=str(at)))
    return tuple(kept)


def _is_log(path: Path, sha256: str) -> bool:
    """Whether a file is the log with this hash."""
    try:
        with path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest() == sha256
    except OSError:
        return False
