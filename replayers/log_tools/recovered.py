"""What a copy of a damaged or cut-off log says was lost before it was made: the metadata record lios.recovered.

A log that was cut off lost only what came after its last complete message, and everything before stands as it was
recorded. Its copy is closed in order, and therefore states the loss itself; it also says how many messages it had
saved of the topics that conclusions rest on, by which a reader sees whether later copies left some out.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from types import MappingProxyType
from typing import TYPE_CHECKING, Self, final

from mcap.records import Channel, Metadata

from replayers.log_tools.log_paths import shown
from replayers.log_tools.multi_run import member_name, run_and_name, run_of
from replayers.mcap_io.messages import Message
from workbench.errors import first_few
from workbench.log_schema.events import (
    TOPIC_OF,
    ActionFinished,
    BeliefUpdate,
    ItemSighting,
    Observation,
    PlanComputed,
)
from workbench.log_schema.run_info import PART_METADATA

if TYPE_CHECKING:
    from replayers.log_tools.copy_log import ReadLoss
    from replayers.log_tools.whole_chunk import WholeChunk

RECOVERED_METADATA = "lios.recovered"
EVIDENCE_TOPICS = frozenset(
    {TOPIC_OF[kind] for kind in (ActionFinished, BeliefUpdate, ItemSighting, Observation, PlanComputed)}
)
"""Topics that a replay rests on."""
MAX_PARTS = 100_000
"""A part with a higher number is none."""


class Lost(StrEnum):
    """Where in a log something was lost."""

    NOTHING = "nothing"
    END = "after the last complete message"
    MIDDLE = "in the middle"
    UNKNOWN = ""
    """A copy made by a release that did not say."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Recovered:
    """What a copy says of the log that it was made from.

    Attributes:
        source: names of the files.
        lost: where something was lost.
        torn: the log was cut off inside a record with content.
        lost_at: byte offset of the first loss in its file; None where nothing was lost, or only an index shows it.
        damages: number of damaged places, those of indexes too.
        messages: how many messages were saved.
        expected: how many there were by the index; None where there was none.
        kept: number of messages saved of each of EVIDENCE_TOPICS; topics without messages are left out.
        parts_missing: numbers of the parts of a split recording that were not there when the others were joined.
    """

    source: str
    lost: Lost
    torn: bool = False
    lost_at: int | None = None
    damages: int = 0
    messages: int | None = None
    expected: int | None = None
    kept: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))
    parts_missing: tuple[int, ...] = ()

    @classmethod
    def from_facts(cls, facts: Mapping[str, str]) -> Self:
        """The record of a copy; what makes no sense in it is taken as not said."""
        said = facts.get("lost", "")
        lost = Lost(said) if said in set(Lost) else Lost.UNKNOWN
        if lost is Lost.UNKNOWN and facts.get("lossy") == "true":
            lost = Lost.MIDDLE
        return cls(
            source=facts.get("from", ""),
            lost=lost,
            torn=lost is Lost.END and facts.get("lossy") == "true",
            lost_at=_whole(facts.get("lost_at")),
            damages=_whole(facts.get("damages")) or 0,
            messages=_whole(facts.get("messages")),
            expected=_whole(facts.get("expected")),
            kept=_counts(facts.get("kept", "")),
            parts_missing=tuple(int(n) for n in facts.get("parts_missing", "").split() if _whole(n) is not None),
        )

    def to_facts(self) -> dict[str, str]:
        """The record as metadata."""
        facts = {"from": self.source, "damages": str(self.damages)}
        if self.messages is not None:
            facts["messages"] = str(self.messages)
        if self.expected is not None:
            facts["expected"] = str(self.expected)
        facts["lossy"] = "true" if self.torn or self.lost is Lost.MIDDLE else "false"
        if self.lost is not Lost.UNKNOWN:
            facts["lost"] = self.lost.value
            facts["kept"] = json.dumps(dict(sorted(self.kept.items())))
        if self.lost_at is not None:
            facts["lost_at"] = str(self.lost_at)
        if self.parts_missing:
            facts["parts_missing"] = " ".join(map(str, self.parts_missing))
        return facts

    def only_end_lost(self, counts: Mapping[str, int]) -> bool:
        """Whether a log with so many messages of each of EVIDENCE_TOPICS lacks nothing but the end of the run."""
        return self.lost is Lost.END and all(counts.get(t, 0) == self.kept.get(t, 0) for t in EVIDENCE_TOPICS)

    @property
    def words(self) -> str | None:
        """What was lost, as one clause; None where nothing was, or where the copy does not say."""
        at = "" if self.lost_at is None else f", at byte {self.lost_at}"
        places = "1 damaged place" if self.damages == 1 else f"{self.damages} damaged places"
        if self.lost is Lost.END:
            return f"recovered from a log that was cut off: what came {Lost.END}{at}, is lost"
        if self.lost is Lost.MIDDLE and self.parts_missing:
            joined = "joined from parts of a recording"
            return f"{joined} without {_numbers(self.parts_missing)}" + (
                f" and with {places}" if self.damages else ""
            )
        if self.lost is Lost.MIDDLE:
            count = "" if self.messages is None else f": {self.messages} messages were saved"
            if self.messages is not None and self.expected is not None:
                count = f": {self.messages} of {self.expected} messages were saved"
            first = "" if self.lost_at is None else f", the first at byte {self.lost_at}"
            return f"recovered from a log with {places}{first}{count}"
        return None


@final
@dataclass(slots=True)
class SourceLoss:
    """What of one source is known to be lost: by its own records, and by what cannot be read of it.

    Attributes:
        name: the file.
        loss: what cannot be read.
        expected: how many messages it holds by its index; None where there is none.
        part: its number among the parts of a recording; None for a log that was not split.
        said: what the source itself says, by run; None stands for a log of one run.
        counts: messages read of each of EVIDENCE_TOPICS, by run.
        read: messages read of all topics.
    """

    name: str
    loss: ReadLoss
    expected: int | None = None
    part: int | None = None
    said: dict[int | None, Recovered] = field(default_factory=dict[int | None, Recovered])
    counts: dict[int | None, Counter[str]] = field(default_factory=dict[int | None, Counter[str]])
    read: int = 0

    def take(self, record: Metadata) -> bool:
        """Whether a metadata record is about losses; it is then kept here instead of being copied."""
        run, name = run_and_name(record.name)
        if name == PART_METADATA:
            self.part = _whole(record.metadata.get("part"))
        if name != RECOVERED_METADATA:
            return False
        self.said[run] = Recovered.from_facts(record.metadata)
        return True

    def count(self, piece: Message | WholeChunk) -> None:
        """Counts what has been read."""
        if isinstance(piece, Message):
            self.read += 1
            if piece.channel.topic in EVIDENCE_TOPICS:
                self._add(piece.channel, 1)
            return
        self.read += len(piece.places)
        needed = {number: c for number, (c, _) in piece.channels.items() if c.topic in EVIDENCE_TOPICS}
        if needed:
            for number, count in Counter(place.channel_id for place in piece.places).items():
                if number in needed:
                    self._add(needed[number], count)

    def records(self, *, always: bool = False) -> list[tuple[str, dict[str, str]]]:
        """Name and values of the metadata records that a copy of this source needs.

        Args:
            always: write one even where nothing was lost.
        """
        return records_of([self], always=always)

    def records_of_last_part(
        self, counts: Mapping[int | None, Mapping[str, int]]
    ) -> list[tuple[str, dict[str, str]]]:
        """The records for the last one of the parts that this source was split into.

        Args:
            counts: messages of each of EVIDENCE_TOPICS in that part, by run.
        """
        found: list[tuple[str, dict[str, str]]] = []
        for run in self.runs:
            record = combined([self], run)
            if record.lost is not Lost.MIDDLE and not record.only_end_lost(self.counts.get(run, {})):
                record = replace(record, lost=Lost.UNKNOWN)
            if record.lost is not Lost.UNKNOWN or run in self.said:
                found.append((_name_of(run), replace(record, kept=counts.get(run, {})).to_facts()))
        return found

    @property
    def runs(self) -> list[int | None]:
        """The runs that it describes; None alone for a log of one run, or of none."""
        return sorted({*self.counts, *self.said}, key=lambda run: -1 if run is None else run) or [None]

    def own(self, run: int | None) -> Recovered:
        """What is lost by what can be read, whatever the source says of itself."""
        content = [damage for damage in self.loss.damages if damage.loses_content or damage.cut_off]
        torn = [damage for damage in content if not damage.cut_off]
        fewer = self.expected not in (None, self.read)
        lost = Lost.END if content else Lost.NOTHING
        if torn or self.loss.messages or fewer or self.loss.count > len(self.loss.damages):
            lost = Lost.MIDDLE
        return Recovered(
            source=shown(self.name),
            lost=lost,
            torn=lost is Lost.END and any(damage.loses_content for damage in content),
            lost_at=min((damage.offset for damage in torn or content), default=None),
            damages=self.loss.count,
            messages=self.read,
            expected=self.expected,
            kept=MappingProxyType(dict(self.counts.get(run, Counter()))),
        )

    def _add(self, channel: Channel, count: int) -> None:
        counts = self.counts.setdefault(run_of(channel), Counter())
        counts[channel.topic] += count


def records_of(
    sources: Sequence[SourceLoss], *, always: bool = False, joined: bool = False
) -> list[tuple[str, dict[str, str]]]:
    """Name and values of the metadata records that one copy of several sources needs.

    Args:
        always: write one even where nothing was lost.
        joined: parts of a recording become one log, so that all of them should be there.
    """
    found: list[tuple[str, dict[str, str]]] = []
    for run in dict.fromkeys(run for source in sources for run in source.runs):
        record = combined(sources, run, joined=joined)
        if always or record.lost is not Lost.NOTHING or any(run in source.said for source in sources):
            found.append((_name_of(run), record.to_facts()))
    return found


def combined(sources: Sequence[SourceLoss], run: int | None = None, *, joined: bool = False) -> Recovered:
    """What a copy of some sources together says of one run; joined as of `records_of`.

    Only the end is lost where no source lost anything in its middle, and where of those that hold the run's events
    only the last part was cut off.
    """
    parts = [
        (source.part, _with_own(source.said.get(run, source.said.get(None)), source.own(run))) for source in sources
    ]
    found = list({json.dumps(record.to_facts()): record for _, record in parts}.values())
    missing = missing_parts(sources) if joined else ()
    if len(found) == 1 and not missing:
        return found[0]
    lost = next((kind for kind in (Lost.MIDDLE, Lost.END, Lost.UNKNOWN) if any(r.lost is kind for r in found)), None)
    kept: Counter[str] = Counter()
    for record in found:
        kept.update(record.kept)
    if lost is Lost.END:
        of_run = [(part, record) for part, record in parts if record.kept or part is not None]
        ended = {part for part, record in of_run if record.lost is Lost.END}
        if not ended:
            kept.clear()  # a log beside the run's was cut off: that says nothing of the run
        elif len({json.dumps(r.to_facts()) for _, r in of_run}) > 1 and ended != {_last_part(sources)}:
            lost = Lost.MIDDLE
    if missing:
        lost = Lost.MIDDLE
    of = [record for record in found if record.lost is not Lost.NOTHING] or found
    return Recovered(
        source=", ".join(dict.fromkeys(record.source for record in of)),
        lost=lost or Lost.NOTHING,
        torn=lost is Lost.END and any(record.torn for record in of),
        lost_at=next((record.lost_at for record in of if record.lost_at is not None), None),
        damages=sum(record.damages for record in found),
        messages=sum(source.read for source in sources),
        kept=MappingProxyType(dict(kept)),
        parts_missing=tuple(sorted({*missing, *(number for record in found for number in record.parts_missing)})),
    )


def missing_parts(sources: Sequence[SourceLoss]) -> tuple[int, ...]:
    """Which parts of a split recording are not among several sources, up to the last one that is.

    Empty where another log of the run is among them, which may hold them.
    """
    if any(source.part is None and source.counts for source in sources):
        return ()
    there = {source.part for source in sources if source.part is not None}
    if not there or max(there) >= MAX_PARTS:
        return ()
    return tuple(number for number in range(max(there)) if number not in there)


def _with_own(said: Recovered | None, own: Recovered) -> Recovered:
    """What a source says of itself, with what cannot be read of it."""
    if said is None or said.lost is Lost.NOTHING:
        return own
    if own.lost is Lost.NOTHING:
        return said
    lost = Lost.MIDDLE if Lost.MIDDLE in (said.lost, own.lost) else Lost.END
    torn = lost is Lost.END and (said.torn or own.torn)
    return replace(own, lost=lost, torn=torn, damages=said.damages + own.damages, kept=said.kept)


def _name_of(run: int | None) -> str:
    return RECOVERED_METADATA if run is None else member_name(RECOVERED_METADATA, run)


def _last_part(sources: Sequence[SourceLoss]) -> int:
    """The number of the last part of a recording among some sources; -1 where none is a part."""
    return max((source.part for source in sources if source.part is not None), default=-1)


def _numbers(parts: Sequence[int]) -> str:
    return ("part " if len(parts) == 1 else "parts ") + first_few(parts, 5)


def _counts(text: str) -> Mapping[str, int]:
    try:
        found = json.loads(text)
    except ValueError:
        return MappingProxyType({})
    if not isinstance(found, dict):
        return MappingProxyType({})
    return MappingProxyType({str(topic): count for topic, count in found.items() if isinstance(count, int)})


def _whole(text: str | None) -> int | None:
    return int(text) if text is not None and text.isascii() and text.isdecimal() and len(text) < 19 else None
