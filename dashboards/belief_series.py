"""How did the belief in one item type go, container by container? For those that were ever most believed."""

from __future__ import annotations

from dashboards.timeline import Timeline

MOST_LINES = 6
"""Containers of which a chart shows the belief."""

Series = list[tuple[int, float]]
"""(stamp of a decision, probability), in order."""


def belief_series(timeline: Timeline, item_type: str) -> dict[str, Series]:
    """A series per container, the most believed first; a container has none once it was searched."""
    series: dict[str, Series] = {}
    for frame in timeline.decisions:
        if frame.belief is None or item_type not in frame.belief.item_types:
            continue
        row = frame.belief.probability[frame.belief.item_types.index(item_type)]
        for container, p in zip(frame.belief.containers, row, strict=True):
            series.setdefault(container, []).append((frame.stamp_ns, p))
    top = sorted(series, key=lambda c: (-max(p for _, p in series[c]), c))[:MOST_LINES]
    return {container: series[container] for container in top}
