"""Stored replays: one JSON file for each log and strategy, complete enough to compare without running again.

The file's key covers everything that the result depends on; a replay with the same key is not repeated.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from replayers.counterfactual.durations import Durations
from replayers.counterfactual.results import BoundFigures, Estimate, WorldGroup
from replayers.tables.html_tables import html_table
from workbench import __version__
from workbench.beliefs.memory.memory_estimator import without_memory
from workbench.errors import FileMissing, MalformedFile, WrongKind
from workbench.execution.events import ActionEnded
from workbench.files import file_name_of, write_atomically
from workbench.terminal import counted

if TYPE_CHECKING:  # stored replays are read without importing what makes them
    from replayers.counterfactual.prepared_log import PreparedLog, ReplaySettings
    from replayers.counterfactual.replay import Replay

RECORD_VERSION = 6
SUFFIX = ".replay.json"


class StepRow(msgspec.Struct, frozen=True, kw_only=True):
    """One action of the run over the log alone."""

    index: int
    decision: int
    action: str
    origin: str
    target: str
    items: tuple[str, ...]
    cost: float
    success: bool
    support: str
    seconds: float


class _OfLog(msgspec.Struct, frozen=True):
    log: str


class _Versioned(msgspec.Struct, frozen=True):
    version: int = 0


class StoredReplay(msgspec.Struct, frozen=True, kw_only=True):
    """One replay as it is kept.

    Attributes:
        key: everything that the answer depends on, hashed.
        log, run_id, sha256, complete_log: which log.
        place, place_sha256: which house, and its plan and travel costs hashed: two houses of one name that differ
            are two houses.
        source: simulation, spot, import: what was driven; a robot's seconds are predicted by its own speeds.
        recorded_strategy, recorded_status, recorded_cost: what was driven.
        reproduced: whether the recorded strategy, replayed, does what was recorded; None where it cannot be replayed
            here. Where it does not, status is "not-reproduced" and nothing is claimed, unless other beliefs than the
            run's were asked for.
        seconds, seconds_rms, durations: predicted duration of the run over the log alone; for a robot's log by its
            own speeds, with the root mean square error that their residuals leave.
        steady_beliefs: the other contents of an open container cannot change the beliefs (docs/replay.md, Whose
            beliefs).
        groups: what is known of the cost in each group of worlds; all groups together are every consistent world.
        if_beliefs_stand: bounds that hold as if open containers held nothing but the task's types; None where the
            bounds hold without that.
        imputed: containers whose contents the log only imagines: it is of a replay in an imagined world.
        lost: what is missing from the log, one line each.
        misses: how many items the recorded looks may have overlooked; may_have_missed names the containers.
        contradicting: types that the inventory lists and no look found, though nothing was left to open.
        corrections: what people say was there although no look showed it, taken as certain; one line each.
        drawn: costs in the drawn worlds; draws names them, so that only the same worlds are compared.
        prior_drawn: costs in worlds drawn from what was known and believed at the start (selection/prior_costs.py);
            empty where nobody asked for them.
        estimator: whose beliefs the strategy followed, with the hash of its weights and without that of a memory,
            which differs from run to run; empty in replays that were stored without it.
    """

    version: int = RECORD_VERSION
    key: str
    log: str
    run_id: str
    sha256: str
    complete_log: bool
    place: str
    place_sha256: str
    scenario: str
    source: str
    recorded_strategy: str
    recorded_status: str
    recorded_cost: float | None
    reproduced: bool | None
    strategy: str
    status: str
    reason: str
    unseen: str | None
    exact: bool
    cost: float | None
    bounds: BoundFigures | None
    estimate: Estimate | None
    support: dict[str, int]
    searches: int
    seconds: float
    seconds_rms: float | None
    durations: Durations | None
    true_cost: float | None
    true_status: str | None
    groups: tuple[WorldGroup, ...] = msgspec.field(name="told")
    if_beliefs_stand: BoundFigures | None
    drawn: tuple[float, ...]
    draws: str
    asked: tuple[str, ...]
    steady_beliefs: bool
    steps: tuple[StepRow, ...]
    notes: tuple[str, ...]
    lost: tuple[str, ...] = ()
    imputed: tuple[str, ...] = ()
    misses: int = 0
    may_have_missed: tuple[str, ...] = ()
    contradicting: tuple[str, ...] = ()
    corrections: tuple[str, ...] = ()
    prior_drawn: tuple[float, ...] = ()
    estimator: str = ""

    def _repr_html_(self) -> str:
        """A table of one row, as a notebook shows it."""
        return replays_html((self,))


def replays_html(replays: Iterable[StoredReplay], *, note: str = "") -> str:
    """A table with one row for each replay: its cost, as far as the log shows, and how its run ended.

    Args:
        note: a line below it.
    """
    listed = tuple(replays)
    head = ("log", "driven", "strategy", "at least", "at most", "estimate", "exact", "status")
    rows = (
        (
            Path(r.log).name,
            r.recorded_strategy,
            r.strategy,
            r.bounds.lower if r.bounds else None,
            r.bounds.upper if r.bounds else None,
            r.estimate.mean if r.estimate else None,
            r.exact,
            r.status,
        )
        for r in listed
    )
    return html_table(counted(len(listed), "replay"), head, rows, note=note)


def to_stored(prepared: PreparedLog, made: Replay, *, key: str) -> StoredReplay:
    """A replay in the form in which it is stored."""
    evidence = prepared.evidence
    outcome = prepared.recorded
    bounds = made.bounds
    return StoredReplay(
        key=key,
        log=evidence.path,
        run_id=evidence.info.run_id,
        sha256=evidence.sha256,
        complete_log=evidence.complete,
        place=evidence.info.place,
        place_sha256=prepared.place_sha256,
        scenario=evidence.info.scenario,
        source=evidence.info.source,
        recorded_strategy=evidence.info.strategy,
        recorded_status=outcome.status if outcome else "cut off",
        recorded_cost=outcome.cost if outcome else None,
        reproduced=prepared.reproduction.same,
        strategy=made.strategy,
        status=made.status.value,
        reason=made.reason,
        unseen=made.unseen,
        exact=made.exact,
        cost=made.cost,
        bounds=bounds.figures if bounds else None,
        estimate=made.estimate,
        support=dict(made.support),
        searches=made.searches,
        seconds=made.seconds,
        seconds_rms=prepared.durations.spread_s(made.events) if prepared.is_fitted else None,
        durations=prepared.durations if prepared.is_fitted else None,
        true_cost=made.true_cost,
        true_status=made.true_status,
        groups=bounds.groups if bounds else (),
        if_beliefs_stand=made.if_beliefs_stand.figures if made.if_beliefs_stand else None,
        drawn=tuple(made.drawn.tolist()) if made.drawn is not None else (),
        draws=prepared.draws,
        asked=made.asked,
        steady_beliefs=prepared.static_beliefs,
        steps=tuple(_step(e) for e in made.events if isinstance(e, ActionEnded)),
        notes=made.notes,
        lost=evidence.gaps.dropped,
        imputed=evidence.imputed,
        misses=evidence.misses,
        may_have_missed=evidence.doubtful,
        contradicting=prepared.contradicting,
        corrections=tuple(correction.words for correction in evidence.corrections),
        estimator=without_memory(prepared.estimator.name),
    )


def replay_key(sha256: str, strategy: str, settings: ReplaySettings) -> str:
    """Hash of everything that a result depends on: the log's bytes, the strategy, the settings, the version.

    Settings are hashed under the name that their budget had first, so that earlier replays stay valid.
    """
    as_hashed_before = repr(settings).replace("Budget(segments=", "Budget(stretches=")
    as_hashed_before = as_hashed_before.replace(", segments_if_shortest=None", "")
    parts = (__version__, RECORD_VERSION, sha256, strategy, as_hashed_before)
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:16]


def replay_path(folder: Path, sha256: str, run_id: str, strategy: str, *, misses: int | None = None) -> Path:
    """Where a replay is stored: one folder for each log, one file for each strategy.

    Args:
        misses: how many items the looks may have overlooked, where that was asked for: those replays stand apart.
    """
    of_log = folder / f"{file_name_of(run_id)}-{sha256[:8]}"
    return (of_log / f"misses-{misses}" if misses else of_log) / f"{file_name_of(strategy)}{SUFFIX}"


def write_replay(path: Path, record: StoredReplay) -> None:
    """Writes a replay atomically: concurrent readers see the old file or the new one."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(path, msgspec.json.format(msgspec.json.encode(record), indent=1))


def read_replay(path: Path) -> StoredReplay:
    """Reads a stored replay.

    Raises:
        FileMissing: no such file.
        MalformedFile: not a replay, or one of another version.
    """
    try:
        data = path.read_bytes()
        version = msgspec.json.decode(data, type=_Versioned).version
        if version != RECORD_VERSION:
            raise MalformedFile(
                path,
                f"a replay stored by another release (version {version}, this one writes {RECORD_VERSION})",
                "Make it again: lios replay LOG -o DIR",
            )
        return msgspec.convert(_with_infinities(msgspec.json.decode(data)), StoredReplay)
    except FileNotFoundError:
        raise FileMissing(path) from None
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise MalformedFile(
            path, f"this is not a stored replay ({error})", "Make it again: lios replay -o DIR"
        ) from error


def log_replayed(replay: Path) -> Path | None:
    """The log that a replay kept in a folder is of, as it was given; None where nothing beside it says."""
    for path in sorted(replay.parent.glob(f"*{SUFFIX}")):  # one folder holds the replays over one log
        try:
            return Path(msgspec.json.decode(path.read_bytes(), type=_OfLog).log)
        except (OSError, msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
            continue
    return None


def replays_in(folder: Path, *, on_skipped: Callable[[MalformedFile], None] | None = None) -> Iterator[StoredReplay]:
    """All replays stored in a folder, in the order of their paths.

    Args:
        on_skipped: called for a file that is not a replay or of another version; the others are read.

    Raises:
        FileMissing, WrongKind: no such folder, or a file.
        MalformedFile: such a file, and on_skipped is not given.
    """
    if not folder.is_dir():
        raise WrongKind(folder, needed="folder") if folder.exists() else FileMissing(folder)
    for path in sorted(folder.rglob(f"*{SUFFIX}")):
        try:
            yield read_replay(path)
        except MalformedFile as error:
            if on_skipped is None:
                raise
            on_skipped(error)


def _with_infinities(record: dict[str, Any]) -> dict[str, Any]:
    """JSON has no infinite numbers: where no bound is known, null is stored."""
    for name in ("bounds", "if_beliefs_stand"):
        for figure, unknown in (("upper", inf), ("least_found", inf), ("largest_found", -inf)):
            _replace_null(record.get(name), figure, unknown)
    groups = record.get("told")
    for group in groups if isinstance(groups, list) else ():
        _replace_null(group, "most", inf)
    return record


def _replace_null(part: Any, name: str, value: float) -> None:
    if isinstance(part, dict) and name in part and part[name] is None:
        part[name] = value


def _step(event: ActionEnded) -> StepRow:
    return StepRow(
        index=event.index,
        decision=event.decision,
        action=event.step.action,
        origin=event.step.origin,
        target=event.step.target,
        items=event.items,
        cost=event.cost,
        success=event.success,
        support=event.support,
        seconds=(event.stamp_ns - event.start_ns) / 1e9,
    )
