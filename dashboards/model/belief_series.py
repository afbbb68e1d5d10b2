"""Belief in one item type over time, for the containers that were ever among the most believed."""

from __future__ import annotations

from dashboards.model.timeline import Timeline

MAX_LINES = 6
"""Containers whose belief a chart shows, at most."""

Series = list[tuple[int, float]]
"""(stamp of a decision in nanoseconds, probability), in order."""


def belief_series(timeline: Timeline, item_type: str) -> dict[str, Series]:
    """One series for each container, the most believed first; a series ends when its container is searched."""
    series: dict[str, Series] = {}
    for frame in timeline.decisions:
        if frame.belief is None or item_type not in frame.belief.item_types:
            continue
        row = frame.belief.probability[frame.belief.item_types.index(item_type)]
        for container, p in zip(frame.belief.containers, row, strict=True):
            series.setdefault(container, []).append((frame.stamp_ns, p))
    top = sorted(series, key=lambda c: (-max(p for _, p in series[c]), c))[:MAX_LINES]
    return {container: series[container] for container in top}
