"""Comparison of strategies in pairs, log by log and in the same world: who is better, and whether that is certain.

Two strategies over one log are compared world by world: the bounds of both costs in each group of worlds bound the
difference over all worlds that are consistent with the log (groups with the same contents of the open containers are
matched). That is tighter than subtracting the overall bounds. Sampled figures (estimates, probabilities) stay
separate.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np

from replayers.batch.store import StoredReplay
from replayers.counterfactual.results import Assignment, WorldGroup
from replayers.tables.html_tables import html_table
from workbench.arrays import Bools, Ints
from workbench.errors import first_few
from workbench.evaluation.statistics import IntervalEstimate, paired_difference
from workbench.terminal import counted
from workbench.tolerances import NEAR_COST

MAX_PAIRS = 1_000_000
"""Pairs of groups of worlds; beyond this, the overall bounds are subtracted instead."""

MAX_NAMED = 4
"""Logs that a message names."""

WINS, LOSES, EQUAL, UNDECIDED = "wins", "loses", "equal", "undecided"


@dataclass(frozen=True, slots=True, kw_only=True)
class CostDifference:
    """The cost of a minus the cost of b over one log.

    Attributes:
        sha256: of the log.
        least, most: its bounds over every world that is consistent with the log.
        paired: whether groups of worlds were matched; otherwise from the two bounds alone.
        verdict: a wins, loses or equals b in every world, or undecided.
        chance: share of sampled worlds in which a is cheaper, and in which they are equal; None without samples.
        drawn: mean difference in the sampled worlds; true: in the recorded truth, where requested.
    """

    log: str
    sha256: str
    house: str
    least: float
    most: float
    paired: bool
    verdict: str
    chance: tuple[float, float] | None
    drawn: float | None
    true: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class StrategyComparison:
    """Two strategies over many logs.

    Attributes:
        wins, loses, equal, undecided: logs on which a wins in every consistent world, and so on.
        least, most: bounds of the mean difference over the logs, in every consistent world.
        drawn, true: mean paired differences with intervals that draw houses, or the logs of the only one, widened
            (workbench/evaluation/statistics.py); None where no log has them.
        chance: mean share of drawn worlds in which a is cheaper.
    """

    a: str
    b: str
    logs: int
    houses: int
    wins: int
    loses: int
    equal: int
    undecided: int
    least: float
    most: float
    chance: float | None
    drawn: IntervalEstimate | None
    true: IntervalEstimate | None
    differences: tuple[CostDifference, ...]

    def _repr_html_(self) -> str:
        """A table of one row, as a notebook shows it."""
        return comparisons_html((self,))


def comparisons_html(pairs: Iterable[StrategyComparison]) -> str:
    """A table with one row for each pair: on how many logs which of the two is cheaper in every consistent world."""
    listed = tuple(pairs)
    head = ("a", "b", "logs", "a wins", "b wins", "equal", "undecided", "mean of a - b from", "to")
    rows = ((p.a, p.b, p.logs, p.wins, p.loses, p.equal, p.undecided, p.least, p.most) for p in listed)
    title = f"{counted(len(listed), 'pair')} of strategies"
    return html_table(title, head, rows, note="A win is a lower cost in every world that agrees with the log.")


def compare(records: Iterable[StoredReplay], *, rng: np.random.Generator) -> tuple[StrategyComparison, ...]:
    """Every pair of strategies that share a log, in the order of first appearance."""
    by_log: dict[str, dict[str, StoredReplay]] = {}
    for record in records:
        if record.bounds is not None:
            by_log.setdefault(record.sha256, {})[record.strategy] = record
    names = tuple(dict.fromkeys(name for group in by_log.values() for name in group))
    apart: dict[tuple[str, str], list[CostDifference]] = {}
    for group in by_log.values():
        for a, b, difference in cost_differences([group[name] for name in names if name in group]):
            apart.setdefault((a.strategy, b.strategy), []).append(difference)
    return tuple(_pair(*pair, apart[pair], rng) for pair in combinations(names, 2) if pair in apart)


def cost_differences(
    replays: Sequence[StoredReplay],
) -> Iterator[tuple[StoredReplay, StoredReplay, CostDifference]]:
    """Every pair of replays over one log, with the first minus the second."""
    answers = [_answers_of(replay.groups) for replay in replays]
    for (a, answers_a), (b, answers_b) in combinations(zip(replays, answers, strict=True), 2):
        yield a, b, _difference(a, answers_a, b, answers_b)


def cost_difference(a: StoredReplay, b: StoredReplay) -> CostDifference:
    """a minus b over the log that both were made from."""
    return _difference(a, _answers_of(a.groups), b, _answers_of(b.groups))


def _difference(a: StoredReplay, answers_a: _Answers, b: StoredReplay, answers_b: _Answers) -> CostDifference:
    assert a.bounds is not None, f"{a.strategy} has no bounds"
    assert b.bounds is not None, f"{b.strategy} has no bounds"
    least, most = a.bounds.lower - b.bounds.upper, a.bounds.upper - b.bounds.lower
    paired = bool(a.groups and b.groups) and len(a.groups) * len(b.groups) <= MAX_PAIRS
    if paired:
        together = _compatible_groups(answers_a, answers_b)
        lowest, highest = _difference_bounds(a.groups, b.groups, together)
        least, most = max(least, lowest), min(most, highest)
    chance, drawn = None, None
    common = min(len(a.drawn), len(b.drawn))
    if common and a.draws == b.draws:
        costs = np.array(a.drawn[:common]) - np.array(b.drawn[:common])
        chance = (float(np.mean(costs < -NEAR_COST)), float(np.mean(np.abs(costs) <= NEAR_COST)))
        drawn = float(costs.mean())
    return CostDifference(
        log=a.log,
        sha256=a.sha256,
        house=a.place_sha256,
        least=least,
        most=most,
        paired=paired,
        verdict=_verdict(least, most),
        chance=chance,
        drawn=drawn,
        true=None if a.true_cost is None or b.true_cost is None else a.true_cost - b.true_cost,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class RunInSeveralLogs:
    """One recorded run that was replayed from more than one log: parts of a split log, or copies of a log.

    Attributes:
        run_id, logs: which run, and from which logs.
        kept: the log that counts for it: one that holds the whole run, or any where all say the same; None where logs
            contradict each other, and none counts.
        incomplete: logs that lack something that `kept` holds, such as a copy that was cut off, and what.
    """

    run_id: str
    logs: tuple[str, ...]
    kept: str | None
    incomplete: tuple[tuple[str, str], ...] = ()

    @property
    def words(self) -> str:
        """How the duplicate was resolved."""
        lacking = dict(self.incomplete)
        same = [log for log in self.logs if log not in lacking]
        if self.kept is None:
            return f"{names_of(same)} are of one run and say different things, as parts of a split log do"
        told = [f"{names_of(same)} are of one run and say the same; it counts once"] if len(same) > 1 else []
        whole = f"is of the run that {names_of([self.kept])} holds whole"
        return "; ".join([*told, *(f"{names_of([log])} {whole} ({why})" for log, why in lacking.items())])


def runs_once(records: Iterable[StoredReplay]) -> tuple[tuple[StoredReplay, ...], tuple[RunInSeveralLogs, ...]]:
    """Replays in which no run counts twice, and how duplicates were resolved.

    A part of a split log holds but a part of what the run showed: replays of parts contradict each other, and their
    number is no number of runs. Copies (compressed, filtered, or under another name) that say the same count once,
    and so does a whole log beside copies that lack something, such as the end.
    """
    listed, same_bytes = _logs_once(records)
    by_run: dict[tuple[str, ...], dict[str, list[StoredReplay]]] = {}
    for r in listed:
        run = (r.run_id, r.place_sha256, r.scenario, r.recorded_strategy)
        by_run.setdefault(run, {}).setdefault(r.sha256, []).append(r)
    left_out: set[str] = set()
    several: list[RunInSeveralLogs] = list(same_bytes)
    for logs in by_run.values():
        if len(logs) > 1:
            kept, duplicate = _one_of(logs)
            left_out |= {sha256 for sha256 in logs if sha256 != kept}
            several.append(duplicate)
    return tuple(r for r in listed if r.sha256 not in left_out), tuple(several)


def _one_of(logs: dict[str, list[StoredReplay]]) -> tuple[str | None, RunInSeveralLogs]:
    """The log that counts for a run, by its hash, and what became of the others."""
    whole = {sha256: group for sha256, group in logs.items() if _is_whole(group[0])}
    candidates = whole or logs
    first = next(iter(candidates))
    kept = first if all(_say_the_same(logs[first], other) for other in candidates.values()) else None
    incomplete = [group[0] for sha256, group in logs.items() if kept is not None and whole and sha256 not in whole]
    return kept, RunInSeveralLogs(
        run_id=logs[first][0].run_id,
        logs=tuple(dict.fromkeys(group[0].log for group in logs.values())),
        kept=logs[first][0].log if kept is not None else None,
        incomplete=tuple((r.log, "; ".join(r.lost) or "its end is missing") for r in incomplete),
    )


def _is_whole(r: StoredReplay) -> bool:
    """Whether the log of a replay holds its run from start to end."""
    return r.complete_log and not r.lost


def _logs_once(records: Iterable[StoredReplay]) -> tuple[tuple[StoredReplay, ...], tuple[RunInSeveralLogs, ...]]:
    """Each strategy's first replay over the same bytes, and the files that hold these, where there are several."""
    once: dict[tuple[str, str], StoredReplay] = {}
    copies: dict[str, dict[str, StoredReplay]] = {}
    for r in records:
        first = once.setdefault((r.sha256, r.strategy), r)
        if first is not r and first.log != r.log:
            copies.setdefault(r.sha256, {first.log: first})[r.log] = r
    several = (
        RunInSeveralLogs(run_id=next(iter(logs.values())).run_id, logs=tuple(logs), kept=next(iter(logs)))
        for logs in copies.values()
    )
    return tuple(once.values()), tuple(several)


def _say_the_same(a: Sequence[StoredReplay], b: Sequence[StoredReplay]) -> bool:
    """Whether two logs lead to the same bounds of every strategy that was replayed over both."""
    first, second = ({r.strategy: (r.status, r.bounds) for r in group} for group in (a, b))
    common = first.keys() & second.keys()
    return bool(common) and all(first[name] == second[name] for name in common)


def names_of(logs: Sequence[str]) -> str:
    """The file names of logs, at most MAX_NAMED of them."""
    return first_few([Path(log).name for log in logs], MAX_NAMED)


def changed_houses(records: Iterable[StoredReplay]) -> tuple[str, ...]:
    """Houses of one name whose plan or travel costs differ between logs: they count as different houses."""
    plans: dict[str, set[str]] = {}
    for record in records:
        plans.setdefault(record.place, set()).add(record.place_sha256)
    return tuple(sorted(name for name, hashes in plans.items() if len(hashes) > 1))


def _difference_bounds(a: Sequence[WorldGroup], b: Sequence[WorldGroup], together: Bools) -> tuple[float, float]:
    """The least and the greatest cost difference over the groups of worlds that both strategies share.

    Of the groups of b that share worlds with one of a, the most expensive one makes the least difference, and the
    cheapest one the greatest.
    """
    dearest = np.where(together, np.array([y.most for y in b]), -np.inf).max(axis=1)
    cheapest = np.where(together, np.array([y.least for y in b]), np.inf).min(axis=1)
    shared = together.any(axis=1)
    least, most = np.array([x.least for x in a]) - dearest, np.array([x.most for x in a]) - cheapest
    return float(least[shared].min()), float(most[shared].max())


@dataclass(frozen=True, slots=True, kw_only=True)
class _Answers:
    """What containers answer in the groups of worlds of one replay.

    Attributes:
        groups: how many there are.
        by_container: the distinct answers of each container, and for each group the index of the one that it gives;
            -1 for none.
    """

    groups: int
    by_container: dict[str, tuple[tuple[Assignment, ...], Ints]]


def _answers_of(groups: Sequence[WorldGroup]) -> _Answers:
    found: dict[str, tuple[dict[Assignment, int], list[int]]] = {}
    numbers: dict[int, tuple[list[int], int]] = {}  # by identity: many groups share an answer
    for g, group in enumerate(groups):
        for answer in group.filled:
            numbered = numbers.get(id(answer))
            if numbered is None:
                if answer.container not in found:
                    found[answer.container] = ({}, [-1] * len(groups))
                known, which = found[answer.container]
                numbered = numbers[id(answer)] = which, known.setdefault(answer, len(known))
            numbered[0][g] = numbered[1]
    by_container = {c: (tuple(known), np.array(which, dtype=np.int64)) for c, (known, which) in found.items()}
    return _Answers(groups=len(groups), by_container=by_container)


def _compatible_groups(a: _Answers, b: _Answers) -> Bools:
    """Which groups of a and of b can contain the same world; bool, shape (groups of a, groups of b)."""
    possible = np.ones((a.groups, b.groups), dtype=bool)
    for container in a.by_container.keys() & b.by_container.keys():
        answers_a, which_a = a.by_container[container]
        answers_b, which_b = b.by_container[container]
        alike = np.ones((len(answers_a) + 1, len(answers_b) + 1), dtype=bool)
        for i, x in enumerate(answers_a):
            alike[i, :-1] = [answers_compatible(x, y) for y in answers_b]
        possible &= alike[which_a][:, which_b]
    return possible


def answers_compatible(a: Assignment, b: Assignment) -> bool:
    """Whether one container can have given both answers: equal in every type that mattered to both."""
    both = set(a.live) & set(b.live)
    return all(a.answer.count(t) == b.answer.count(t) for t in both)


def _verdict(least: float, most: float) -> str:
    if most < -NEAR_COST:
        return WINS
    if least > NEAR_COST:
        return LOSES
    return EQUAL if max(abs(least), abs(most)) <= NEAR_COST else UNDECIDED


def _pair(a: str, b: str, differences: list[CostDifference], rng: np.random.Generator) -> StrategyComparison:
    houses = [d.house for d in differences]
    drawn = [(d.drawn, d.house) for d in differences if d.drawn is not None]
    true = [(d.true, d.house) for d in differences if d.true is not None]
    chances = [d.chance[0] for d in differences if d.chance is not None]
    verdicts = [d.verdict for d in differences]
    return StrategyComparison(
        a=a,
        b=b,
        logs=len(differences),
        houses=len(set(houses)),
        wins=verdicts.count(WINS),
        loses=verdicts.count(LOSES),
        equal=verdicts.count(EQUAL),
        undecided=verdicts.count(UNDECIDED),
        least=float(np.mean([d.least for d in differences])),
        most=float(np.mean([d.most for d in differences])),
        chance=float(np.mean(chances)) if chances else None,
        drawn=_interval(drawn, rng),
        true=_interval(true, rng),
        differences=tuple(differences),
    )


def _interval(values: list[tuple[float, str]], rng: np.random.Generator) -> IntervalEstimate | None:
    if not values:
        return None
    apart = np.array([value for value, _ in values])
    return paired_difference(apart, np.zeros_like(apart), [house for _, house in values], rng=rng)
