"""The order by time of several logs' messages; a chunk stays whole where no other log has messages in its time."""

from __future__ import annotations

import heapq
from collections.abc import Iterator, Sequence
from itertools import chain

from replayers.log_tools.whole_chunk import WholeChunk
from replayers.mcap_io.messages import Message


def by_time(flows: Sequence[Iterator[Message | WholeChunk]]) -> Iterator[Message | WholeChunk]:
    """Merges flows by log time; of equal times, the earlier flow is first. Within a flow, the order stays.

    Memory: a message or chunk of each flow.
    """
    rest: list[Iterator[Message | WholeChunk]] = list(flows)
    heads: dict[int, Message | WholeChunk] = {}
    heap: list[tuple[int, int]] = []

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
        if isinstance(piece, WholeChunk) and heap and heap[0] < (piece.end_ns, number):
            rest[number] = chain(piece.messages(), rest[number])
        else:
            yield piece
        advance(number)
