"""Ranks unopened containers by how many strategy comparisons their contents are expected to settle.

For every open container, the sampled worlds are grouped by what it holds; within each group the strategies' costs
vary less than over all. Reported are how many undecided comparisons a look is expected to settle (the doubt of a
comparison is the probability that its likeliest result is wrong), and by how much it narrows the costs. The ranking
rests on sampled worlds, so it is an estimate; the bounds show afterwards what a look really settled.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from replayers.counterfactual.estimates.sampled_worlds import SampledWorlds
from workbench.arrays import Bools, Floats, Indices
from workbench.errors import LiosError
from workbench.tolerances import NEAR_COST

if TYPE_CHECKING:
    from pathlib import Path

    from replayers.counterfactual.prepared_log import ReplaySettings

NO_LOOK = "no look would change what is known of these strategies"


@dataclass(frozen=True, slots=True, kw_only=True)
class LookValue:
    """What a look into one container is expected to reveal.

    Attributes:
        settles: how much doubt about the better strategy it removes, summed over pairs of strategies; the doubt of a
            pair is 1 - max(P(a wins), P(b wins), P(equal)), at most 2/3.
        doubt: that doubt before the look.
        narrows: expected decrease of the standard deviation of a strategy's cost, mean over strategies, in cost
            units.
        chance_found: probability that it holds something relevant to the task.
        again: the run looked into it, and may have missed something there.
    """

    container: str
    settles: float
    doubt: float
    narrows: float
    chance_found: float
    again: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class ContainerLook:
    """The most informative look of one log.

    Attributes:
        log: the log's path.
        value: which container, and what a look into it is expected to reveal.
        words: the same as a phrase.
    """

    log: str
    value: LookValue
    words: str

    @property
    def container(self) -> str:
        """The container to look into."""
        return self.value.container


def rank_looks(worlds: SampledWorlds, costs: Mapping[str, Floats], asked: Collection[str]) -> tuple[LookValue, ...]:
    """Open containers, the most informative first.

    Args:
        costs: per strategy, its cost in each drawn world, shape (worlds,); the first ones where lengths differ.
        asked: containers that some strategy searches; the others carry no information about these strategies.
    """
    common = min((len(drawn) for drawn in costs.values()), default=0)
    if not common:
        return ()
    table = np.array([costs[name][:common] for name in sorted(costs)])
    doubt, spread = _doubt(table), _spread(table)
    looks: list[LookValue] = []
    for j, container in enumerate(worlds.containers):
        if container not in asked:
            continue
        inside = worlds.inside[:common, :, j]
        groups = _groups(inside)
        shares = [len(g) / common for g in groups]
        looks.append(
            LookValue(
                container=container,
                settles=max(0.0, doubt - sum(s * _doubt(table[:, g]) for s, g in zip(shares, groups, strict=True))),
                doubt=doubt,
                narrows=max(0.0, spread - sum(s * _spread(table[:, g]) for s, g in zip(shares, groups, strict=True))),
                chance_found=float(inside.any(axis=1).mean()),
            )
        )
    return tuple(sorted(looks, key=lambda look: (-round(look.settles, 9), -round(look.narrows, 9), look.container)))


def best_looks(
    outcomes: Iterable[object], files: Sequence[Path], settings: ReplaySettings
) -> tuple[ContainerLook, ...]:
    """The most informative look for each replayed log, from the costs stored with its replays."""
    return tuple(
        ContainerLook(log=str(path), value=looks[0], words=_words(looks[0]))
        for path, _, looks in looks_by_log(outcomes, files, settings)
    )


def looks_by_log(
    outcomes: Iterable[object], files: Sequence[Path], settings: ReplaySettings
) -> Iterator[tuple[Path, str, tuple[LookValue, ...]]]:
    """For each replayed log its path, its house and its open containers, the most informative first; logs without
    any are left out."""
    from replayers.batch.store import StoredReplay
    from replayers.counterfactual.prepared_log import prepare_log
    from replayers.runs.run import read

    by_log: dict[str, list[StoredReplay]] = {}
    for outcome in outcomes:
        if isinstance(outcome, StoredReplay) and outcome.drawn:
            by_log.setdefault(outcome.sha256, []).append(outcome)
    for path in files:
        try:
            run = read(path, with_truth=settings.with_truth)
        except LiosError:
            continue  # its row says why it was not replayed
        replays = by_log.get(run.sha256, [])
        prepared = prepare_log(run, settings, with_paths=False) if replays else None
        if prepared is None or prepared.worlds is None:
            continue
        worlds, doubtful = prepared.worlds, prepared.evidence.doubtful
        costs = {r.strategy: np.array(r.drawn) for r in replays}
        looks = rank_looks(worlds, costs, {c for r in replays for c in r.asked})
        if looks:
            yield path, run.info.place, tuple(replace(look, again=look.container in doubtful) for look in looks)


@dataclass(frozen=True, slots=True, kw_only=True)
class SharedLook:
    """What a look into one container of one house would have settled over all its logs.

    Attributes:
        logs: in how many logs it was left unopened, and some strategy looks into it.
        settles, doubt, narrows: as of LookValue, summed over these logs.
    """

    place: str
    container: str
    logs: int
    settles: float
    doubt: float
    narrows: float


def shared_looks(found: Iterable[tuple[Path, str, tuple[LookValue, ...]]]) -> tuple[SharedLook, ...]:
    """The containers of all logs together, the most informative first.

    Args:
        found: of looks_by_log.
    """
    sums: dict[tuple[str, str], SharedLook] = {}
    for _, place, looks in found:
        for look in looks:
            key = (place, look.container)
            before = sums.get(key)
            sums[key] = SharedLook(
                place=place,
                container=look.container,
                logs=1 + (before.logs if before else 0),
                settles=look.settles + (before.settles if before else 0.0),
                doubt=look.doubt + (before.doubt if before else 0.0),
                narrows=look.narrows + (before.narrows if before else 0.0),
            )
    order = sorted(sums.values(), key=lambda s: (-round(s.settles, 9), -round(s.narrows, 9), s.place, s.container))
    return tuple(order)


def _words(look: LookValue) -> str:
    if look.doubt <= NEAR_COST and look.narrows <= NEAR_COST:
        return NO_LOOK
    again = "it was looked into, and may hold more: look again; " if look.again else ""
    return (
        f"{again}expected to settle {look.settles:.2f} of {look.doubt:.2f} doubtful comparisons "
        f"and to narrow the costs by {look.narrows:.1f} (drawn worlds)"
    )


def _doubt(table: Floats) -> float:
    """The doubt about which strategy is better, summed over pairs; table has shape (strategies, worlds)."""
    total = 0.0
    for a, b in combinations(range(len(table)), 2):
        apart = table[a] - table[b]
        wins, loses = float(np.mean(apart < -NEAR_COST)), float(np.mean(apart > NEAR_COST))
        total += 1 - max(wins, loses, 1 - wins - loses)
    return total


def _spread(table: Floats) -> float:
    return float(table.std(axis=1).mean())


def _groups(inside: Bools) -> list[Indices]:
    """Groups of worlds that agree on what a container holds; inside has shape (worlds, types)."""
    codes = inside @ (1 << np.arange(inside.shape[1], dtype=np.int64))
    return [np.flatnonzero(codes == code) for code in np.unique(codes)]
