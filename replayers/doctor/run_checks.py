"""Checks the run in a log: identity, attachments, and every event against the house and the other events."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from mcap.records import Attachment, Metadata

from recorders.mcap_io.channels import STAMPS, UNCERTAIN
from recorders.run_recorder import COMPUTER_CLOCK, WORLD_CLOCK
from replayers.doctor.event_checks import EventChecks
from replayers.doctor.findings import Findings, Level
from replayers.log_tools.recovered import RECOVERED_METADATA, Recovered
from replayers.mcap_io.messages import Message
from workbench.errors import LiosError
from workbench.log_schema.codec import decode
from workbench.log_schema.events import TOPICS, Dropped, RunInfo, schema_name
from workbench.log_schema.place import PLACE_ATTACHMENT, TASK_ATTACHMENT, place_from_json, task_from_json
from workbench.log_schema.run_info import INFO_METADATA, PART_METADATA, info_from_metadata
from workbench.log_schema.settings_json import SETTINGS_ATTACHMENT, settings_from_json

REPLAYABLE = "Without it the run cannot be replayed"


@dataclass(slots=True)
class RunChecks:
    """Takes a log's content in the order of the file and reports findings. A log without a run has nothing to
    check."""

    findings: Findings
    holds_run: bool = False
    info: RunInfo | None = None
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    attachments: set[str] = field(default_factory=set)
    events: EventChecks | None = None
    dropped: Dropped | None = None
    settings: dict[str, Any] = field(default_factory=dict)
    domain_messages: int = 0
    uncertain: dict[str, int] = field(default_factory=dict)
    """By topic: messages whose stamps were converted while the time sync was away."""

    def take(self, part: Message | Attachment | Metadata) -> None:
        if isinstance(part, Message) and part.channel.metadata.get(STAMPS) == UNCERTAIN:
            self.uncertain[part.topic] = self.uncertain.get(part.topic, 0) + 1
        if isinstance(part, Metadata):
            self._metadata(part)
        elif isinstance(part, Attachment):
            self._attachment(part)
        elif part.topic in TOPICS:
            self._message(part)

    def finish(self, *, cut_off: bool, damaged: bool) -> None:
        """The checks that need the whole file."""
        findings = self.findings
        self._check_recovered()
        if self.uncertain:
            counts = ", ".join(f"{topic[:60]} {count}" for topic, count in sorted(self.uncertain.items())[:20])
            what = f"publish times are by an old clock skew, since the time sync was away: {counts}"
            findings.warning("stamps", what, "Use the log times of these messages, or /robot/clock")
        if not self.holds_run:
            if self.domain_messages and not (cut_off or RECOVERED_METADATA in self.metadata):
                findings.error("metadata", f"events of a run, but no metadata {INFO_METADATA}", REPLAYABLE)
            else:
                findings.add(Level.INFO, "metadata", f"no metadata {INFO_METADATA}: it holds no run")
            return
        recovered = RECOVERED_METADATA in self.metadata
        for name in (PLACE_ATTACHMENT, TASK_ATTACHMENT, SETTINGS_ATTACHMENT):
            if name not in self.attachments:
                level = Level.WARNING if recovered else Level.LOSS if cut_off else Level.ERROR
                findings.add(level, "attachments", f"{name} is missing", REPLAYABLE)
        if self.dropped is not None and any(self.dropped.counts.values()):
            counts = ", ".join(f"{topic} {count}" for topic, count in sorted(self.dropped.counts.items()))
            findings.add(Level.LOSS, "/recorder/dropped", f"the recorder could not keep up and dropped: {counts}")
        partial = cut_off or damaged or recovered or PART_METADATA in self.metadata
        if self.events is not None:
            self.events.finish(partial=partial)

    @property
    def may_be_complete(self) -> bool:
        """Whether it is a run by itself: no part of a split one, and no copy of a damaged one."""
        return self.holds_run and not {PART_METADATA, RECOVERED_METADATA} & self.metadata.keys()

    @property
    def real_time(self) -> bool:
        """Whether log times are those of the clock of the recording computer.

        The recorder states it; older logs, which do not, are in real time unless they hold a simulator's ground
        truth.
        """
        recorder = self.settings.get("recorder")
        clock = recorder.get("log_time") if isinstance(recorder, dict) else None
        if clock in (WORLD_CLOCK, COMPUTER_CLOCK):
            return clock == COMPUTER_CLOCK
        simulated = self.events is not None and self.events.truth is not None
        return not simulated and (self.info is None or self.info.source not in ("simulation", "replay"))

    @property
    def promised_s(self) -> float | None:
        """The longest time that a message could wait for the disk, as the recorder was set, in seconds; None where
        unknown."""
        recorder = self.settings.get("recorder")
        sync_s = recorder.get("sync_s") if isinstance(recorder, dict) else None
        return float(sync_s) if isinstance(sync_s, int | float) else None

    def _check_recovered(self) -> None:
        what = Recovered.from_facts(self.metadata.get(RECOVERED_METADATA, {})).words
        if what:
            self.findings.add(Level.LOSS, "metadata", what, "What was lost is not in this file", kind="recovered")

    def _metadata(self, record: Metadata) -> None:
        self.metadata[record.name] = record.metadata
        if record.name != INFO_METADATA:
            return
        self.holds_run = True
        try:
            self.info = info_from_metadata(record.metadata)
        except LiosError as error:
            self.findings.error(f"metadata {INFO_METADATA}", str(error))

    def _attachment(self, record: Attachment) -> None:
        self.attachments.add(record.name)
        read = _READ.get(record.name)
        if read is None:
            return
        try:
            value = read(record.data)
        except LiosError as error:
            self.findings.error(f"attachment {record.name}", str(error), REPLAYABLE)
            return
        if record.name == SETTINGS_ATTACHMENT:
            self.settings = value.more
        elif record.name == PLACE_ATTACHMENT:
            self.events = EventChecks(self.findings, value)

    def _message(self, message: Message) -> None:
        self.domain_messages += 1
        where = message.topic
        expected = schema_name(TOPICS[where])
        if message.schema is None or message.schema.name != expected:
            said = message.schema.name if message.schema else "none"
            self.findings.error(where, f"its schema is {said[:60]}, not {expected}", kind=f"schema of {where}")
        try:
            event = decode(where, message.data)
        except LiosError as error:
            self.findings.error(where, str(error), kind=f"undecodable {where}")
            return
        if isinstance(event, Dropped):
            self.dropped = event
        elif self.events is not None:
            self.events.take(event, simulated=self.info is not None and self.info.source == "simulation")


_READ: dict[str, Callable[[bytes], Any]] = {
    PLACE_ATTACHMENT: place_from_json,
    TASK_ATTACHMENT: task_from_json,
    SETTINGS_ATTACHMENT: settings_from_json,
}
