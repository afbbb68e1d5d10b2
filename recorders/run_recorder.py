"""The recorder of runs: writes every event of the loop to its topic, with viewer channels beside it, and syncs it
to disk.

The file is self-describing: the run's identity is metadata; place, task and settings are attachments; every topic
has a schema. Data is flushed and synced at every decision and at least every second, so that at most 1.0 s is lost
in a crash. In simulation `log_time` is the event's own stamp, so that the same seed gives the same bytes.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self, final

from google.protobuf.message import Message

from recorders.foxglove.channels import LATCHED, ViewerMessage, ViewerMessages
from recorders.mcap_io.channels import json_channel, protobuf_channel
from recorders.mcap_io.writer import DiskFull
from recorders.sinks.files import LogFiles, Sink, SplitLimits
from recorders.sinks.mirrored import MirroredSink, ViewerFeed
from recorders.sinks.threaded import ThreadedSink
from workbench.errors import LiosError
from workbench.execution.events import ActionEnded, ContainerObserved, Event, PlanMade, RunEnded
from workbench.log_schema.codec import encode, ground_truth, to_wire
from workbench.log_schema.events import DomainEvent, GroundTruth, Outcome, RunInfo
from workbench.log_schema.place import PLACE_ATTACHMENT, TASK_ATTACHMENT, Place, place_to_json, task_to_json
from workbench.log_schema.run_info import INFO_METADATA, OUTCOME_METADATA, info_to_metadata, outcome_to_metadata
from workbench.log_schema.settings_json import SETTINGS_ATTACHMENT, settings_to_json
from workbench.planning.tasks import Task
from workbench.search.costs import ActionCosts
from workbench.worlds.house import Contents
from workbench.worlds.travel import Paths

SYNC_S = 1.0
"""Longest time in seconds between syncs to disk."""
WORLD_CLOCK, COMPUTER_CLOCK = "the world's clock", "the computer's clock"
"""Metadata key of the clock of log_time; the world's clock may run faster than the computer's, as in simulation."""


@final
class RunRecorder:
    """Records one run; a context manager.

    It has more than eight parameters, all but the path by keyword: what the log holds, and how it is written, each
    with a default that most callers keep.

    Args:
        path: the log to write.
        info: identity of the run.
        place: the place; stored as an attachment like the next two, so that the log alone suffices for replay.
        task: the task.
        costs: the action costs.
        truth: true contents of every container; simulation only, hidden by readers unless requested.
        force: replace an existing log.
        paths: paths for drawing the path ahead; by default those of the place.
        settings: further entries of settings.json.
        viewer: write the Foxglove channels.
        motion: write the robot's pose and transforms derived from its actions; by default if no robot reports
            its own.
        sync_s: longest time in seconds before a message is on disk.
        background: write in a thread, so that `record` never waits for the disk and never raises for it.
        split: continue in further files.
        sink: sink used in place of `path`: a ring buffer, or files shared with other topics.
        audience: viewers that are shown every message once it is written.
        receipt_ns: clock for log_time; by default the event's stamp, which publish_time always is.

    Raises:
        OutputExists, CannotCreate: nothing was written.
        DiskFull: the disk is full; recorded data is kept. With `background`, only `close` raises it.
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
        background: bool = False,
        split: SplitLimits | None = None,
        sink: Sink | None = None,
        audience: ViewerFeed | None = None,
        receipt_ns: Callable[[], int] | None = None,
    ) -> None:
        self.info = info
        files = sink or LogFiles(path, force=force, split=split)
        self._files = files if audience is None else MirroredSink(files, audience)
        self._background = ThreadedSink(self._files, sync_s=sync_s) if background else None
        self._receipt_ns = receipt_ns
        self._sync_s, self._synced = sync_s, time.monotonic()
        moving = info.source != "spot" if motion is None else motion
        self._viewer_messages = ViewerMessages(place, task, paths=paths, motion=moving) if viewer else None
        start_ns = info.started.ns
        identity = info_to_metadata(info)
        clock = WORLD_CLOCK if receipt_ns is None else COMPUTER_CLOCK
        syncs = {"sync_s": sync_s, "syncs_at": "every decision and every look", "log_time": clock}
        more = {**(settings or {}), "recorder": syncs, "run": identity}
        self.sink.describe(INFO_METADATA, identity)
        for name, data in (
            (PLACE_ATTACHMENT, place_to_json(place)),
            (TASK_ATTACHMENT, task_to_json(task)),
            (SETTINGS_ATTACHMENT, settings_to_json(costs, more)),
        ):
            self.sink.attach(name, "application/json", data, log_time=start_ns)
        if truth is not None:
            self._write_domain(self.sink, ground_truth(truth, start_ns))
        if self._viewer_messages is not None:
            self._write_viewer(self.sink, self._viewer_messages.opening(start_ns))
        self.sync()

    @property
    def sink(self) -> Sink:
        """The sink for further topics of the same log (images, robot state). Write to it from the recording
        thread."""
        return self._background or self._files

    @property
    def stop_reason(self) -> LiosError | None:
        """Why nothing is recorded any more; None while recording goes on."""
        return None if self._background is None else self._background.stop_reason

    @property
    def path(self) -> Path:
        return self._files.path

    def record(self, event: Event) -> None:
        """Write an event and its viewer messages; looks, decisions and the end are synced at once.

        Looks are synced because planning follows them, which may take minutes without recording.
        """
        if self._background is None:
            self._write(event)
        else:
            self._background.submit(lambda: self._write(event))
        looked = isinstance(event, ContainerObserved) and not event.known_at_start
        if looked or isinstance(event, PlanMade | RunEnded) or time.monotonic() - self._synced >= self._sync_s:
            self.sync()

    def sync(self) -> None:
        """Sync everything recorded so far; with `background`, without waiting."""
        self.sink.flush()
        self._synced = time.monotonic()

    def close(self) -> None:
        """Write the index and close the log. Safe to call twice.

        Raises:
            DiskFull: the background thread had to stop.
        """
        self.sink.close()
        if self._background is not None and self._background.stop_reason is not None:
            raise self._background.stop_reason

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if isinstance(error, DiskFull):
            return  # the writer has closed the file as far as possible
        self.close()

    def _write(self, event: Event) -> None:
        """Write an event and its viewer messages by stamp: the poses of an action come before its end."""
        viewer_messages = () if self._viewer_messages is None else tuple(self._viewer_messages.messages_for(event))
        if isinstance(event, ActionEnded):
            self._write_viewer(self._files, viewer_messages)
        for wire in to_wire(event):
            self._write_domain(self._files, wire)
            if isinstance(wire, Outcome):
                self._files.describe(OUTCOME_METADATA, outcome_to_metadata(wire, event.decision))
        if not isinstance(event, ActionEnded):
            self._write_viewer(self._files, viewer_messages)

    def _write_domain(self, sink: Sink, event: DomainEvent) -> None:
        channel = json_channel(type(event), latched=isinstance(event, GroundTruth))
        sink.write(channel, encode(event), log_time=self._log_time(event.stamp.ns), publish_time=event.stamp.ns)

    def _write_viewer(self, sink: Sink, messages: Iterable[ViewerMessage]) -> None:
        for topic, message, stamp_ns in messages:
            channel = protobuf_channel(topic, type(message), latched=topic in LATCHED)
            sink.write(channel, _bytes(message), log_time=self._log_time(stamp_ns), publish_time=stamp_ns)

    def _log_time(self, stamp_ns: int) -> int:
        return stamp_ns if self._receipt_ns is None else self._receipt_ns()


def _bytes(message: Message) -> bytes:
    return message.SerializeToString(deterministic=True)
