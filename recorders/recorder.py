"""How is a run recorded? Every event of the loop to its topic, the viewer's channels beside it, on disk at once.

The file explains itself: the run's identity as metadata, place, task and settings as attachments, schemas for every
topic. Every decision, and at least every second, is flushed and synced; a crash loses what came after that.
In simulation `log_time` is the event's own stamp, so that the same seed gives the same bytes.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self, final

import msgspec
from google.protobuf.message import Message
from mcap_protobuf.schema import build_file_descriptor_set

from recorders.narrator import Narrator
from recorders.writer import CHUNK_BYTES, Compression, McapWriter
from workbench.execution.events import Ended, Event, Planned
from workbench.planning.tasks import Task
from workbench.runs.codec import encode, ground_truth, to_wire
from workbench.runs.place import PLACE_ATTACHMENT, TASK_ATTACHMENT, Place, place_to_json, task_to_json
from workbench.runs.run_info import INFO_METADATA, info_to_metadata
from workbench.runs.settings_json import SETTINGS_ATTACHMENT, settings_to_json
from workbench.runs.vocabulary import TOPIC_OF, DomainEvent, RunInfo, schema_name
from workbench.search.costs import ActionCosts
from workbench.worlds.house import Contents
from workbench.worlds.travel import Paths

SYNC_S = 1.0
"""At least this often what was recorded is on disk."""


@final
class RunRecorder:
    """Records one run; a context manager.

    Args:
        path: the log to make.
        info: identity of the run.
        place, task, costs: stored as attachments, so that the run can be replayed from the log alone.
        truth: what every container really holds; simulation only, hidden by readers unless asked.
        force: replace a log that exists.
        paths: draws the way ahead; the place's own ways if not given.
        settings: more facts for settings.json.
        viewer: write the Foxglove channels.
        motion: write the robot's pose and transforms from its actions; off where a robot reports its own.
        sync_s: the longest time that a message waits for the disk.

    Raises:
        OutputExists: the log exists and force is not set.
        DiskFull: no room; what was recorded is kept.
    """

    def __init__(
        self,
        path: Path | str,
        *,
        info: RunInfo,
        place: Place,
        task: Task,
        costs: ActionCosts,
        truth: Contents | None = None,
        force: bool = False,
        paths: Paths | None = None,
        settings: Mapping[str, Any] | None = None,
        viewer: bool = True,
        motion: bool | None = None,
        sync_s: float = SYNC_S,
        chunk_bytes: int = CHUNK_BYTES,
        compression: Compression = "zstd",
    ) -> None:
        self.info = info
        self._writer = McapWriter(path, force=force, chunk_bytes=chunk_bytes, compression=compression)
        self._channels: dict[str, int] = {}
        self._sync_s = sync_s
        self._synced = time.monotonic()
        start_ns = info.started.ns
        self._writer.add_metadata(INFO_METADATA, info_to_metadata(info))
        for name, data in (
            (PLACE_ATTACHMENT, place_to_json(place)),
            (TASK_ATTACHMENT, task_to_json(task)),
            (SETTINGS_ATTACHMENT, settings_to_json(costs, settings)),
        ):
            self._writer.add_attachment(name, "application/json", data, log_time=start_ns, create_time=start_ns)
        self._narrator = (
            Narrator(place, task, paths=paths, motion=info.source != "spot" if motion is None else motion)
            if viewer
            else None
        )
        if truth is not None:
            self._write_domain(ground_truth(truth, start_ns))
        if self._narrator is not None:
            self._write_viewer(self._narrator.opening(start_ns))
        self.sync()

    @property
    def path(self) -> Path:
        return self._writer.path

    def record(self, event: Event) -> None:
        """Writes an event and what a viewer draws of it; a decision and the end are on disk when this returns."""
        for wire in to_wire(event):
            self._write_domain(wire)
        if self._narrator is not None:
            self._write_viewer(self._narrator.tell(event))
        if isinstance(event, Planned | Ended) or time.monotonic() - self._synced >= self._sync_s:
            self.sync()

    def sync(self) -> None:
        """Brings everything recorded so far to the disk."""
        self._writer.flush()
        self._synced = time.monotonic()

    def close(self) -> None:
        """Writes the index and closes the log. Safe to call twice."""
        self._writer.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _write_domain(self, event: DomainEvent) -> None:
        topic = TOPIC_OF[type(event)]
        if topic not in self._channels:
            schema = self._writer.add_schema(
                schema_name(type(event)), "jsonschema", msgspec.json.encode(json_schema(type(event)))
            )
            self._channels[topic] = self._writer.add_channel(topic, "json", schema)
        self._writer.add_message(self._channels[topic], encode(event), log_time=event.stamp.ns)

    def _write_viewer(self, messages: Iterable[tuple[str, Message, int]]) -> None:
        for topic, message, stamp_ns in messages:
            if topic not in self._channels:
                schema = self._writer.add_schema(
                    message.DESCRIPTOR.full_name,
                    "protobuf",
                    build_file_descriptor_set(type(message)).SerializeToString(deterministic=True),
                )
                self._channels[topic] = self._writer.add_channel(topic, "protobuf", schema)
            self._writer.add_message(
                self._channels[topic], message.SerializeToString(deterministic=True), log_time=stamp_ns
            )


def record_run(path: Path | str, events: Iterable[Event], **options: Any) -> Ended | None:
    """Records all events of a run; returns its end, or None when the events stopped short of one.

    Args:
        options: as for RunRecorder.
    """
    ended = None
    with RunRecorder(path, **options) as recorder:
        for event in recorded(events, recorder):
            ended = event if isinstance(event, Ended) else ended
    return ended


def recorded(events: Iterable[Event], recorder: RunRecorder) -> Iterator[Event]:
    """The events again, each recorded before it is handed on."""
    for event in events:
        recorder.record(event)
        yield event


def json_schema(event_class: type[msgspec.Struct]) -> dict[str, Any]:
    """The JSON Schema of a wire class, self-contained, with an object at its root as viewers want it."""
    schema = msgspec.json.schema(event_class)
    root = schema["$defs"].pop(event_class.__name__)
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **root, "$defs": schema["$defs"]}
