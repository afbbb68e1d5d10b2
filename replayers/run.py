"""What happened in a recorded run? One log as one value: identity, place, task, and every event in order.

A log whose recorder died reads like any other, up to its last flush; `complete` says whether it has its end.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from mcap.records import Attachment, Channel, DataEnd, Metadata

from replayers.reader import (
    ChunkRecord,
    Damage,
    Raw,
    Record,
    Unreadable,
    open_log,
    records_in,
    scan,
    unpack,
)
from workbench.errors import MalformedFile
from workbench.planning.tasks import Task
from workbench.runs.codec import decode
from workbench.runs.place import PLACE_ATTACHMENT, TASK_ATTACHMENT, Place, place_from_json, task_from_json
from workbench.runs.run_info import INFO_METADATA, info_from_metadata
from workbench.runs.settings_json import SETTINGS_ATTACHMENT, settings_from_json
from workbench.runs.vocabulary import (
    TOPICS,
    ActionFinished,
    BeliefUpdate,
    DomainEvent,
    Dropped,
    FindCosts,
    GroundTruth,
    Observation,
    Outcome,
    PlanComputed,
    RunInfo,
    Timing,
)
from workbench.search.costs import ActionCosts

TRUTH_TOPIC = "/search/truth"


class HoldsNoRun(MalformedFile):
    """An MCAP file that no run was recorded to."""

    def __init__(self, path: Path, lacks: str) -> None:
        super().__init__(path, f"it holds no run (no {lacks})", "Give a log of lios record, or lios site from-log")


@dataclass(frozen=True, kw_only=True)
class Run:
    """One recorded run.

    Attributes:
        path: the log.
        truth: what every container held; None unless asked for with with_truth, or where it was not recorded.
        outcome: None where the recording stopped short of it.
        complete: the log was closed properly and holds its outcome.
        damage: places where the file could not be read; empty for a log that is whole or was merely cut off.
    """

    path: Path
    info: RunInfo
    place: Place
    task: Task
    costs: ActionCosts
    settings: dict[str, Any] = field(default_factory=dict)
    observations: tuple[Observation, ...] = ()
    beliefs: tuple[BeliefUpdate, ...] = ()
    find_costs: tuple[FindCosts, ...] = ()
    plans: tuple[PlanComputed, ...] = ()
    timings: tuple[Timing, ...] = ()
    actions: tuple[ActionFinished, ...] = ()
    outcome: Outcome | None = None
    truth: GroundTruth | None = None
    dropped: Dropped | None = None
    complete: bool = False
    damage: tuple[Damage, ...] = ()

    @cached_property
    def sha256(self) -> str:
        """Of the whole file, in hexadecimal."""
        digest = hashlib.sha256()
        with open(self.path, "rb") as stream:
            while block := stream.read(1 << 20):
                digest.update(block)
        return digest.hexdigest()


def read(path: Path | str, *, with_truth: bool = False) -> Run:
    """Reads a log.

    Args:
        with_truth: also what a simulated run recorded of the true contents; planners must not see it.

    Raises:
        FileMissing, NoMcap: no file, or no MCAP file.
        HoldsNoRun: an MCAP file without a run's identity, place or task.
        DamagedLog: a message inside an intact chunk that is not what its topic says.
        NewerSchema: recorded by a later release.
    """
    found = _Found(Path(path), with_truth)
    with open_log(path) as stream:
        closed = False
        for offset, record in scan(stream, on_damage=found.damage.append, path=path):
            if isinstance(record, DataEnd):
                closed = True
                break
            found.take(offset, record)
    return found.run(closed=closed)


@dataclass(slots=True)
class _Found:
    """What reading has come across so far."""

    path: Path
    with_truth: bool
    channels: dict[int, str] = field(default_factory=dict)
    damage: list[Damage] = field(default_factory=list)
    attachments: dict[str, bytes] = field(default_factory=dict)
    info: RunInfo | None = None
    events: dict[type[DomainEvent], list[DomainEvent]] = field(default_factory=dict)

    def take(self, offset: int, record: Record) -> None:
        if isinstance(record, ChunkRecord):
            try:
                for _, inner in records_in(unpack(record)):
                    self.take(offset, inner)
            except Unreadable as error:
                self.damage.append(Damage(offset, f"Chunk: {error}"))
        elif isinstance(record, Raw):
            topic = self.channels.get(record.channel_id, "")
            if topic in TOPICS and (self.with_truth or topic != TRUTH_TOPIC):
                event = decode(topic, record.data)
                self.events.setdefault(type(event), []).append(event)
        elif isinstance(record, Channel):
            self.channels[record.id] = record.topic
        elif isinstance(record, Metadata) and record.name == INFO_METADATA:
            self.info = info_from_metadata(record.metadata)
        elif isinstance(record, Attachment):
            self.attachments[record.name] = record.data

    def run(self, *, closed: bool) -> Run:
        if self.info is None:
            raise HoldsNoRun(self.path, f"metadata {INFO_METADATA}")
        settings = settings_from_json(self._attachment(SETTINGS_ATTACHMENT))
        outcome = self._last(Outcome)
        return Run(
            path=self.path,
            info=self.info,
            place=place_from_json(self._attachment(PLACE_ATTACHMENT)),
            task=task_from_json(self._attachment(TASK_ATTACHMENT)),
            costs=settings.costs,
            settings=settings.more,
            observations=self._all(Observation),
            beliefs=self._all(BeliefUpdate),
            find_costs=self._all(FindCosts),
            plans=self._all(PlanComputed),
            timings=self._all(Timing),
            actions=self._all(ActionFinished),
            outcome=outcome,
            truth=self._last(GroundTruth),
            dropped=self._last(Dropped),
            complete=closed and outcome is not None,
            damage=tuple(self.damage),
        )

    def _attachment(self, name: str) -> bytes:
        if name not in self.attachments:
            raise HoldsNoRun(self.path, f"attachment {name}")
        return self.attachments[name]

    def _all(self, cls: type[Any]) -> tuple[Any, ...]:
        return tuple(self.events.get(cls, ()))

    def _last(self, cls: type[Any]) -> Any:
        return (self.events.get(cls) or [None])[-1]
