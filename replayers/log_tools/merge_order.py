"""The order by time of several logs' messages; a chunk stays whole where no other log has messages in its time.

What two logs both hold, as recordings that overlap do, comes once: messages of one topic with the same number, times
and data.
"""

from __future__ import annotations

import heapq
import zlib
from collections import Counter
from collections.abc import Callable, Hashable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import chain
from typing import final

from replayers.log_tools.whole_chunk import WholeChunk
from replayers.mcap_io.messages import Message

MAX_TOGETHER = 10_000
"""The last messages with which each one is compared."""


def by_time(
    flows: Sequence[Iterator[Message | WholeChunk]], *, on_repeated: Callable[[], None] = lambda: None
) -> Iterator[Message | WholeChunk]:
    """Merges flows by log time; of equal times, the earlier flow is first. Within a flow, the order stays.

    Memory: a message or chunk of each flow, and the checksums of the last messages.

    Args:
        on_repeated: called for every message that is left out because another flow gave it already.
    """
    rest: list[Iterator[Message | WholeChunk]] = list(flows)
    heads: dict[int, Message | WholeChunk] = {}
    heap: list[tuple[int, int]] = []
    given = _GivenMessages()
    until: dict[int, int] = {}

    def advance(number: int) -> None:
        for piece in rest[number]:
            if isinstance(piece, WholeChunk) and not piece.places:
                continue
            first_ns = piece.places[0].log_time if isinstance(piece, WholeChunk) else piece.log_time
            heads[number] = piece
            heapq.heappush(heap, (first_ns, number))
            return

    for number in range(len(rest)):
        advance(number)
    while heap:
        _, number = heapq.heappop(heap)
        piece = heads.pop(number)
        if isinstance(piece, WholeChunk) and (
            (heap and heap[0][0] <= piece.end_ns)
            or any(newest_ns >= piece.start_ns for flow, newest_ns in until.items() if flow != number)
        ):
            rest[number] = chain(piece.messages(), rest[number])
        elif isinstance(piece, Message) and len(flows) > 1 and given.already(piece, number):
            on_repeated()
        else:
            until[number] = max(until.get(number, 0), piece.log_time if isinstance(piece, Message) else piece.end_ns)
            yield piece
        advance(number)


@final
@dataclass(slots=True)
class _GivenMessages:
    """The last messages that were given, by which another flow's copies of them are recognised."""

    given: dict[Hashable, Counter[int]] = field(default_factory=dict[Hashable, Counter[int]])

    def already(self, message: Message, flow: int) -> bool:
        """Whether another flow gave this message as often as this flow does by now; else it is given now."""
        schema = message.schema.name if message.schema else ""
        of_run = tuple(sorted(message.channel.metadata.items()))
        stamps = message.sequence, message.log_time, message.publish_time
        key = message.topic, schema, of_run, stamps, len(message.data), zlib.crc32(message.data)
        if key not in self.given and len(self.given) >= MAX_TOGETHER:
            del self.given[next(iter(self.given))]
        by_flow = self.given.setdefault(key, Counter())
        most = max(by_flow.values(), default=0)
        by_flow[flow] += 1
        return by_flow[flow] <= most
