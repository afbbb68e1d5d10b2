"""A recorded run as one value: identity, place, task, and every event in order.

A log whose recorder died reads like any other, up to its last flush; `complete` says whether it has its end.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, cast

import msgspec
from mcap.records import Attachment, DataEnd, Metadata

from replayers.log_tools.log_paths import shown
from replayers.log_tools.multi_run import NoRunInLog, SeveralRuns, run_and_name
from replayers.log_tools.recovered import RECOVERED_METADATA, Lost, Recovered
from replayers.mcap_io.messages import ChunkMessages, Message
from replayers.mcap_io.reader import wanted_chunks
from replayers.mcap_io.records import Record
from replayers.mcap_io.scan import Damage, open_log, record_at, scan
from replayers.mcap_io.summary import is_closed, read_index
from replayers.tables.html_tables import Cell, html_table
from workbench.log_schema.codec import decode
from workbench.log_schema.corrections import NOTE_SCHEMA, NOTE_TOPIC, Correction
from workbench.log_schema.events import (
    POSE_TOPIC,
    TOPICS,
    TRUTH_TOPIC,
    ActionFinished,
    BeliefUpdate,
    DomainEvent,
    Dropped,
    EstimatorAnswer,
    FindCosts,
    GroundTruth,
    ItemSighting,
    Observation,
    Outcome,
    PlanComputed,
    RunInfo,
    Timing,
    Wire,
)
from workbench.log_schema.place import PLACE_ATTACHMENT, TASK_ATTACHMENT, Place, place_from_json, task_from_json
from workbench.log_schema.run_info import (
    INFO_METADATA,
    PART_METADATA,
    ROBOT_METADATA,
    info_from_metadata,
    is_simulated,
)
from workbench.log_schema.settings_json import SETTINGS_ATTACHMENT, settings_from_json
from workbench.planning.tasks import Task
from workbench.remote.path import path_of
from workbench.search.costs import ActionCosts

if TYPE_CHECKING:
    from replayers.tables.frames import Tables


@dataclass(frozen=True, kw_only=True)
class Run:
    """One recorded run.

    Attributes:
        path: the log.
        truth: the contents of every container; None unless requested by with_truth, or where it was not recorded.
        outcome: None where the recording stopped short of it.
        closed: the file has its end, as a recorder that was not killed writes it.
        complete: the log was closed properly and holds its outcome.
        ended: its data were read to the record that ends them; a file that is cut off after it lost its index alone.
        damage: places where the file could not be read; empty for a log that is whole or was merely cut off.
        corrections: what people say was there although no look showed it (lios log note --seen).
        part: the number of this file among the parts of a recording, from 0; empty for a log that was not split.
        skipped: topics whose sequence numbers, which the recorder counts from 0, have gaps; how many are missing.
        robot: what the robot says of itself; empty for a run without one.
        recovered: what a copy of a damaged or cut-off log says of that log; None where it is no such copy.
    """

    path: Path
    info: RunInfo
    place: Place
    task: Task
    costs: ActionCosts
    settings: dict[str, Any] = field(default_factory=dict)
    observations: tuple[Observation, ...] = ()
    sightings: tuple[ItemSighting, ...] = ()
    answers: tuple[EstimatorAnswer, ...] = ()
    beliefs: tuple[BeliefUpdate, ...] = ()
    find_costs: tuple[FindCosts, ...] = ()
    plans: tuple[PlanComputed, ...] = ()
    timings: tuple[Timing, ...] = ()
    actions: tuple[ActionFinished, ...] = ()
    outcome: Outcome | None = None
    truth: GroundTruth | None = None
    dropped: Dropped | None = None
    raw_poses: tuple[tuple[int, bytes], ...] = ()
    """(log time, foxglove.PoseInFrame as bytes) of /robot/pose, decoded when a table asks for them."""
    closed: bool = False
    complete: bool = False
    ended: bool = False
    damage: tuple[Damage, ...] = ()
    corrections: tuple[Correction, ...] = ()
    part: str = ""
    skipped: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))
    robot: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    recovered: Recovered | None = None
    sha256_read: str = ""
    """Hash of the part of a growing file that was read; empty for a file that was read to its end."""

    @property
    def is_cut_off(self) -> bool:
        """Whether the log, or the one that it was recovered from, ends early."""
        copied = self.recovered is not None and self.recovered.lost is Lost.END
        return copied or not (self.closed or self.ended)

    @property
    def has_end(self) -> bool:
        """Whether it holds all of the run, perhaps in a file that was cut off after it, in its index."""
        return self.complete or (self.ended and self.outcome is not None)

    @property
    def source_words(self) -> str:
        """What made the run, for people: a simulated robot is called so."""
        if self.info.source != "spot":
            return self.info.source
        return "Spot (simulated)" if is_simulated(self.robot) else "Spot"

    def __repr__(self) -> str:
        """One line, as a notebook shows it; the whole content would be a hundred thousand characters."""
        end = f"{self.outcome.status}, cost {self.outcome.cost:.1f}" if self.outcome else "no outcome"
        counts = f"{len(self.plans)} decisions, {len(self.actions)} actions"
        info = self.info
        return f"<Run {self.path}: {info.title}, in {info.place} by {info.strategy}; {end}; {counts}>"

    def _repr_html_(self) -> str:
        """A short table, as a notebook shows it."""
        info, outcome = self.info, self.outcome
        rows: list[tuple[Cell, ...]] = [
            ("task", info.title),
            ("place", info.place),
            ("strategy", info.strategy),
            ("beliefs", info.estimator),
            ("seed", str(info.seed)),
            ("source", self.source_words),
            ("end", outcome.status if outcome else "no outcome"),
            ("cost", outcome.cost if outcome else None),
            ("decisions", len(self.plans)),
            ("actions", len(self.actions)),
        ]
        note = "" if self.complete else "The log was cut off."
        return html_table(f"Run {self.path.name}", (), rows, note=note)

    def show(self, *others: Run, height_px: int = 640) -> None:
        """Shows the run in a notebook, as the offline page that `lios capsule` writes.

        Args:
            others: runs of the same task laid over it.
            height_px: height of the frame.

        Raises:
            NoNotebook: no notebook is running.
        """
        # By name: the dashboards import this room, and nobody but who asks to see a run needs them.
        import_module("dashboards.capsule.embedded").show((self, *others), height_px=height_px)

    @cached_property
    def tables(self) -> Tables:
        """The run as data frames, each built when first requested."""
        from replayers.tables.frames import RunSource, Tables

        source = RunSource(
            log=shown(self.path),
            info=self.info,
            complete=self.complete,
            found={event_class: self.events(event_class) for event_class in _HELD_AS},
            raw_poses=self.raw_poses,
        )
        return Tables((source,))

    def events(self, event_class: type[Wire]) -> tuple[Wire, ...]:
        """All events of a class of the vocabulary, in order.

        Raises:
            KeyError: a class that is not an event of a run.
        """
        held = getattr(self, _HELD_AS[event_class])
        if isinstance(held, tuple):
            return held
        return () if held is None else (held,)

    @cached_property
    def sha256(self) -> str:
        """Hash of the whole file, or of the part that was read of one that still grows, in hexadecimal."""
        if self.sha256_read:
            return self.sha256_read
        digest = hashlib.sha256()
        with open_log(self.path) as stream:
            while block := stream.read(1 << 20):
                digest.update(block)
        return digest.hexdigest()


_HELD_AS: Mapping[type[msgspec.Struct], str] = MappingProxyType(
    {
        Observation: "observations",
        ItemSighting: "sightings",
        EstimatorAnswer: "answers",
        BeliefUpdate: "beliefs",
        FindCosts: "find_costs",
        PlanComputed: "plans",
        Timing: "timings",
        ActionFinished: "actions",
        Outcome: "outcome",
        GroundTruth: "truth",
        Dropped: "dropped",
    }
)
"""The attribute of a run that holds the events of a class."""


def read(path: Path | str, *, with_truth: bool = False, with_poses: bool = True) -> Run:
    """Reads a log.

    Args:
        with_truth: also read the true contents that a simulated run recorded; planners must not see them.
        with_poses: keep the robot's poses, most of a log's messages, which tables and views show and no replay needs.

    Raises:
        FileMissing, NoMcap: no file, or no MCAP file.
        SeveralRuns: several runs in one file.
        NoRunInLog: an MCAP file without a run's identity, place or task.
        UndecodableMessage: a message inside an intact chunk that is not what its topic says.
        NewerSchema: recorded by a later release.
    """
    found = RunBuilder(path_of(path), with_truth)

    def keeps(topic: str) -> bool:
        return found.wants(topic) and (with_poses or topic != POSE_TOPIC)

    content = ChunkMessages(topics=keeps, on_damage=found.damage.append)
    with open_log(path) as stream:
        index, closed = read_index(stream), is_closed(stream)
        ended = index is not None
        if index is None:
            for offset, record in scan(stream, path=path, on_damage=found.damage.append):
                if isinstance(record, DataEnd):
                    ended = True
                    break
                found.take(record)
                found.extend(content.messages_of(offset, record))
        else:
            content.schemas, content.channels = index.schemas, index.channels
            for entry in (*index.metadata, *index.attachments):
                found.take(record_at(stream, entry.offset, on_damage=found.damage.append))
            for offset in wanted_chunks(index, found.wants):
                chunk = record_at(stream, offset, on_damage=found.damage.append)
                found.extend(content.messages_of(offset, chunk))
    return found.run(closed=closed, ended=ended)


_place = lru_cache(maxsize=8)(place_from_json)
"""Runs of one place, which nobody can change, share it."""


@dataclass(slots=True)
class RunBuilder:
    """What has been read of a run so far: records are taken as they come, and `run` is what they hold.

    Attributes:
        damage: places that could not be read.
    """

    path: Path
    with_truth: bool
    damage: list[Damage] = field(default_factory=list)
    attachments: dict[str, bytes] = field(default_factory=dict)
    info: RunInfo | None = None
    events: dict[type[msgspec.Struct], list[DomainEvent]] = field(default_factory=dict)
    poses: list[tuple[int, bytes]] = field(default_factory=list)
    corrections: list[Correction] = field(default_factory=list)
    several: bool = False
    part: str = ""
    robot: dict[str, str] = field(default_factory=dict)
    recovered: Recovered | None = None
    skipped: dict[str, int] = field(default_factory=dict)
    expected: dict[str, int] = field(default_factory=dict)

    def wants(self, topic: str) -> bool:
        return topic in (POSE_TOPIC, NOTE_TOPIC) or (topic in TOPICS and (self.with_truth or topic != TRUTH_TOPIC))

    def take(self, record: Record | None) -> None:
        if isinstance(record, Metadata | Attachment) and run_and_name(record.name)[0] is not None:
            self.several = True
        elif isinstance(record, Metadata) and record.name == INFO_METADATA:
            self.info = info_from_metadata(record.metadata)
        elif isinstance(record, Metadata) and record.name == ROBOT_METADATA:
            self.robot = dict(record.metadata)
        elif isinstance(record, Metadata) and record.name == PART_METADATA:
            self.part = record.metadata.get("part", "0")
        elif isinstance(record, Metadata) and record.name == RECOVERED_METADATA:
            self.recovered = Recovered.from_facts(record.metadata)
        elif isinstance(record, Attachment):
            self.attachments[record.name] = record.data

    def extend(self, messages: Iterable[Message]) -> None:
        for message in messages:
            topic = message.channel.topic
            if topic in TOPICS:
                self._count(topic, message.sequence)
                event = decode(topic, message.data)
                self.events.setdefault(type(event), []).append(event)
            elif topic == NOTE_TOPIC:
                self._take_note(message)
            elif message.channel.message_encoding == "protobuf":
                self.poses.append((message.log_time, message.data))

    def _take_note(self, message: Message) -> None:
        if message.schema is not None and message.schema.name == NOTE_SCHEMA:
            from replayers.log_tools.notes import note_from

            correction = note_from(message).seen
            if correction is not None:
                self.corrections.append(correction)

    def _count(self, topic: str, sequence: int) -> None:
        """A number that is lower than expected begins the next file of a recording, or is of a writer without one."""
        expected = self.expected.get(topic, 0)
        if sequence > expected:
            self.skipped[topic] = self.skipped.get(topic, 0) + sequence - expected
        self.expected[topic] = sequence + 1

    def run(self, *, closed: bool, ended: bool = False, sha256_read: str = "") -> Run:
        """The run as far as it was read.

        Args:
            closed: whether the file has its end.
            ended: whether its data were read to their end.
            sha256_read: hash of what was read, of a file that still grows; empty to hash the file when asked.

        Raises:
            SeveralRuns: several runs in one file.
            NoRunInLog: the run's identity, place or task is not in it.
        """
        if self.info is None:
            if self.several:
                raise SeveralRuns(self.path)
            raise NoRunInLog(self.path, f"metadata {INFO_METADATA}")
        settings = settings_from_json(self._attachment(SETTINGS_ATTACHMENT))
        outcome = self._last(Outcome)
        return Run(
            path=self.path,
            info=self.info,
            place=_place(self._attachment(PLACE_ATTACHMENT)),
            task=task_from_json(self._attachment(TASK_ATTACHMENT)),
            costs=settings.costs,
            settings=settings.more,
            observations=self._all(Observation),
            sightings=self._all(ItemSighting),
            answers=self._all(EstimatorAnswer),
            beliefs=self._all(BeliefUpdate),
            find_costs=self._all(FindCosts),
            plans=self._all(PlanComputed),
            timings=self._all(Timing),
            actions=self._all(ActionFinished),
            outcome=outcome,
            truth=self._last(GroundTruth),
            dropped=self._last(Dropped),
            raw_poses=tuple(self.poses),
            corrections=tuple(self.corrections),
            closed=closed,
            complete=closed and outcome is not None,
            ended=ended,
            damage=tuple(self.damage),
            part=self.part,
            skipped=MappingProxyType({topic: count for topic, count in self.skipped.items() if count}),
            robot=MappingProxyType(self.robot),
            recovered=self.recovered,
            sha256_read=sha256_read,
        )

    def _attachment(self, name: str) -> bytes:
        if name not in self.attachments:
            raise NoRunInLog(self.path, f"attachment {name}")
        return self.attachments[name]

    def _all(self, cls: type[Wire]) -> tuple[Wire, ...]:
        return tuple(cast("list[Wire]", self.events.get(cls, [])))  # kept by their own class

    def _last(self, cls: type[Wire]) -> Wire | None:
        return next(reversed(self._all(cls)), None)
