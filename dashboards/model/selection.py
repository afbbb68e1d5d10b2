"""The strategy to drive next, from the replays stored in a folder, for the dashboard of that folder.

Where `lios select -o` wrote what it answered from (kept_answer.py), that is what is shown: the same candidates, under
the same names, judged alike. Otherwise all replays of the folder are candidates, as `lios replay -o` leaves them.
Their logs are in the folder, or where the replays say that they were read: `lios select LOGS -o FOLDER` keeps only
the replays.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType

import msgspec

from replayers.batch.breakdown import fewest_misses
from replayers.batch.replays import LogFailed, Replays
from replayers.batch.store import StoredReplay, replays_in
from replayers.counterfactual.prepared_log import ReplaySettings
from replayers.selection.campaign_logs import GroupBy, TrialGroup, trial_groups
from replayers.selection.kept_answer import FILE, KeptAnswer, read_answer
from replayers.selection.verdict import SelectionSettings, SelectionVerdict, history
from workbench.errors import MalformedFile


@dataclass(frozen=True, slots=True, kw_only=True)
class FolderSelection:
    """The campaigns of a folder.

    Attributes:
        groups: trials that can be compared, each with what is known after every trial.
        left_out: what counts for nothing, with the reason, one line each.
        not_replayed: candidates that could be replayed over no log, with the reason.
        alpha: the error of eliminations by sequence.
        estimators: whose beliefs the candidates follow, as `lios select` was told; empty where that is not known.
    """

    groups: tuple[tuple[TrialGroup, tuple[SelectionVerdict, ...]], ...] = ()
    left_out: tuple[str, ...] = ()
    not_replayed: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    alpha: float = SelectionSettings().alpha
    estimators: tuple[str, ...] = ()


def selection_in(folder: Path) -> FolderSelection:
    """The selection from the replays that are kept in a folder, over their logs; nothing is replayed."""
    skipped: list[str] = []
    answers = sorted(folder.rglob(FILE), key=lambda path: path.stat().st_mtime_ns, reverse=True)
    for place, path in enumerate(answers):
        try:
            answer = read_answer(path)
        except MalformedFile as error:
            skipped.append(str(error))
            continue
        others = [other for other in answers[place + 1 :] if other.parent != path.parent]
        skipped += [f"{other.relative_to(folder)}: an earlier answer of lios select" for other in others]
        return _of_answer(answer, path.parent, folder, skipped)
    stored = fewest_misses(replays_in(folder, on_skipped=lambda error: skipped.append(str(error))))
    kept, _ = _with_logs(stored, folder, skipped.append)  # a folder may keep the replays of several calls
    draws: dict[str, set[str]] = {}
    for record in kept:
        draws.setdefault(record.log, set()).add(record.draws)
    skipped += [
        f"{Path(log).name}: its replays were made with different beliefs or settings, and compare by bounds alone"
        for log, different in draws.items()
        if len(different) > 1
    ]
    names = tuple(dict.fromkeys(record.strategy for record in kept))
    return _selected(kept, (), names, GroupBy.SCENARIO, SelectionSettings(), skipped)


def _of_answer(answer: KeptAnswer, inside: Path, folder: Path, skipped: list[str]) -> FolderSelection:
    """The answer of `lios select` into the folder `inside`, from the replays as they are there now."""
    records = answer.of(replays_in(inside, on_skipped=lambda error: skipped.append(str(error))))
    gone = len({c.key for c in answer.candidates} - {r.key for r in records})
    if gone:
        of = len({c.key for c in answer.candidates})
        skipped.append(f"{gone} of the {of} replays of this answer were removed, or made again with other settings")
    kept, places = _with_logs(records, folder, skipped.append)
    failed = tuple(
        LogFailed(log=places.get(f.log, f.log), strategy=f.strategy, reason=f.reason) for f in answer.failed
    )
    found = _selected(kept, failed, answer.names, answer.group_by, answer.settings, skipped)
    return replace(found, estimators=answer.estimators)


def _selected(
    kept: tuple[StoredReplay, ...],
    failed: tuple[LogFailed, ...],
    names: tuple[str, ...],
    by: GroupBy,
    settings: SelectionSettings,
    skipped: list[str],
) -> FolderSelection:
    if len(names) < 2 or not kept:
        return FolderSelection(left_out=tuple(skipped))
    logs = tuple(dict.fromkeys(Path(record.log) for record in kept))
    made = Replays(outcomes=(*kept, *failed), logs=logs, settings=ReplaySettings())
    grouped = trial_groups(made, names, by)
    return FolderSelection(
        groups=tuple((group, tuple(history(group.trials, settings))) for group in grouped.groups),
        left_out=(*grouped.left_out, *skipped),
        not_replayed=grouped.not_replayed,
        alpha=settings.alpha,
    )


def _with_logs(
    records: Iterable[StoredReplay], folder: Path, tell: Callable[[str], None]
) -> tuple[tuple[StoredReplay, ...], dict[str, str]]:
    """The replays whose logs are there, with the paths at which they are; and these by the paths in the replays."""
    inside: dict[str, list[Path]] = {}
    for path in sorted(folder.rglob("*.mcap")):
        inside.setdefault(path.name, []).append(path)
    found: dict[str, Path | None] = {}
    kept: list[StoredReplay] = []
    at_now: dict[str, str] = {}
    for record in records:
        if record.sha256 not in found:
            given = Path(record.log)
            places = (*inside.get(given.name, ()), given, folder / given, folder.parent / given)
            found[record.sha256] = next((p for p in places if _is_log(p, record.sha256)), None)
            if found[record.sha256] is None:
                tell(f"{record.log}: the log of these replays is not there any more, or was changed")
        at = found[record.sha256]
        if at is not None:
            at_now[record.log] = str(at)
            kept.append(msgspec.structs.replace(record, log=str(at)))
    return tuple(kept), at_now


def _is_log(path: Path, sha256: str) -> bool:
    """Whether a file is the log with this hash."""
    try:
        with path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest() == sha256
    except OSError:
        return False
