"""What do the containers hold? As many items, and as often of each type, as such containers in real houses."""

from __future__ import annotations

import numpy as np

from workbench.worlds.house_statistics import ContentShares, HouseStatistics


def draw_contents(
    statistics: HouseStatistics, *, room_kind: str, container: str, rng: np.random.Generator
) -> tuple[str, ...]:
    """Item types of one container, in a drawn order; empty for a container of which nothing is known.

    The number of items is drawn first, then types one by one: a type's weight is the share of containers that hold
    it, and once drawn, how often there is another one.
    """
    shares = statistics.contents.get(f"{room_kind}/{container}") or statistics.contents.get(f"/{container}")
    if shares is None or not shares.types:
        return ()
    p = np.array(shares.number)
    number = int(rng.choice(len(p), p=p / p.sum()))
    return _draw_types(shares, number, rng)


def _draw_types(shares: ContentShares, number: int, rng: np.random.Generator) -> tuple[str, ...]:
    names = list(shares.types)
    weights = np.array([shares.types[name][0] for name in names])
    again = np.array([(mean - 1) / mean for _, mean in shares.types.values()])
    drawn: list[str] = []
    for _ in range(number):
        if weights.sum() <= 0:
            break
        which = int(rng.choice(len(names), p=weights / weights.sum()))
        weights[which] = again[which] * shares.types[names[which]][0]
        drawn.append(names[which])
    return tuple(drawn)
