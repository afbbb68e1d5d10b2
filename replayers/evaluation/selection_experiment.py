"""The selection experiment: campaigns of trials one after another, by each selector, on the same trials in the same
order."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from replayers.evaluation.selection_pool import PoolTrial
from replayers.selection.elimination import NEAR, eliminated_by_proof, eliminated_by_sequence
from replayers.selection.selectors import ABLATIONS, SELECTORS
from replayers.selection.trial_costs import TrialCosts
from workbench.arrays import Floats
from workbench.errors import BadValue
from workbench.evaluation.statistics import IntervalEstimate, mean_with_interval, ratio_with_interval

OURS = "intervals"
RANDOM = "random"
"""A selector that draws: what choosing without looking costs."""
FULL_INFORMATION = "full-information"
"""No competitor: after each trial it is told what every strategy truly cost there, which no robot and no replay
knows, and it follows the leader, the strategy of least mean cost so far. By that mean alone none can know more."""
REFERENCES = (FULL_INFORMATION,)
ALPHA = 0.05
"""Probability of any wrong elimination by sequence."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Campaign:
    """One seed's trials, driven as one selector says.

    Attributes:
        pool: the number of the pool that its trials are from.
        driven: the index of the strategy driven in each trial.
        best: the best fixed strategy in hindsight: of least total cost over the trials, the first of several.
        regret: cumulative: what was driven so far cost more than the best fixed strategy in hindsight (over all of
            the campaign's trials) did so far; shape (trials,).
    """

    selector: str
    seed: int
    driven: tuple[int, ...]
    best: int
    regret: Floats
    pool: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class SelectorRow:
    """One selector over all pools and seeds; intervals draw the campaigns of a pool's seeds.

    Attributes:
        regret: mean cumulative regret at the end.
        best_share: share of trials in which the best fixed strategy in hindsight was driven.
        share_of: by baseline, this selector's mean regret over the baseline's on the same trials; None where that is
            not clearly above 0: by its interval.
    """

    selector: str
    regret: IntervalEstimate
    best_share: float
    share_of: dict[str, IntervalEstimate | None]


@dataclass(frozen=True, slots=True, kw_only=True)
class EliminationCheck:
    """Eliminations against the truth, over campaigns whose driven strategies and trials were drawn.

    Attributes:
        wrong_by_proof: campaigns in which, after some trial, the best strategy on the trials so far was out by proof.
        by_proof: mean share of the other strategies that are out by proof after the last trial.
        wrong_by_sequence: campaigns in which, after the last trial, a strategy of least mean over the pool was out.
        by_sequence: as by_proof, by sequence.
    """

    campaigns: int
    wrong_by_proof: int
    by_proof: float
    wrong_by_sequence: int
    by_sequence: float


def campaigns(pool: Sequence[PoolTrial], *, trials: int, seeds: Sequence[int], number: int = 0) -> Iterator[Campaign]:
    """Every selector's campaign for every seed: the seed draws trials from the pool without putting back.

    Args:
        number: the pool's.

    Raises:
        BadValue: the pool is smaller than a campaign.
    """
    if not 0 < trials <= len(pool):
        raise BadValue("--trials", trials, f"between 1 and the pool's {len(pool)}")
    for seed in seeds:
        order = np.random.default_rng((seed, 0)).permutation(len(pool))[:trials]
        chosen = [pool[i] for i in order]
        for k, name in enumerate((*SELECTORS, RANDOM, *ABLATIONS, FULL_INFORMATION)):
            made = campaign(chosen, name, seed=seed, rng=np.random.default_rng((seed, 1 + k)))
            yield replace(made, pool=number)


def campaign(chosen: Sequence[PoolTrial], selector: str, *, seed: int, rng: np.random.Generator) -> Campaign:
    """Drives the trials in their order as a selector says."""
    names = chosen[0].seen[0].strategies
    select = _SELECT[selector]
    driven: list[int] = []
    seen: list[TrialCosts] = []
    for trial in chosen:
        driven.append(select(seen, names, rng))
        seen.append(_fully_known(trial) if selector == FULL_INFORMATION else trial.seen[driven[-1]])
    true = np.array([trial.true for trial in chosen])
    best = int(np.argmin(true.sum(axis=0)))
    paid = true[np.arange(len(chosen)), driven]
    regret = np.cumsum(paid - true[:, best])
    return Campaign(selector=selector, seed=seed, driven=tuple(driven), best=best, regret=regret)


def _draw(_: Sequence[TrialCosts], strategies: Sequence[str], rng: np.random.Generator) -> int:
    return int(rng.integers(len(strategies)))


_SELECT = {**SELECTORS, **ABLATIONS, RANDOM: _draw, FULL_INFORMATION: SELECTORS[OURS]}


def _fully_known(trial: PoolTrial) -> TrialCosts:
    """A trial whose every cost is known, and nothing but that."""
    true = np.array(trial.true)
    apart = true[:, None] - true[None, :]
    known = replace(trial.seen[0], lower=true, upper=true, estimate=true, max_difference=apart)
    return replace(known, driven=None, drawn=None, prior=None)


def selector_rows(made: Sequence[Campaign], *, seed: int) -> tuple[SelectorRow, ...]:
    """The selectors' rows, in the order of first appearance.

    Args:
        made: every selector's campaigns for the same pools and seeds, in the same order.
        seed: of the intervals.
    """
    names = tuple(dict.fromkeys(c.selector for c in made))
    of = {name: [c for c in made if c.selector == name] for name in names}
    ends = {name: np.array([c.regret[-1] for c in of[name]]) for name in names}
    clusters = [(c.pool, c.seed) for c in of[names[0]]]
    mean_of = {name: mean_with_interval(ends[name], clusters, rng=np.random.default_rng(seed)) for name in names}

    def share(name: str, other: str) -> IntervalEstimate | None:
        if not mean_of[other].lower > NEAR:
            return None
        return ratio_with_interval(ends[name], ends[other], clusters, rng=np.random.default_rng(seed))

    return tuple(
        SelectorRow(
            selector=name,
            regret=mean_of[name],
            best_share=float(np.mean([np.mean(np.array(c.driven) == c.best) for c in of[name]])),
            share_of={other: share(name, other) for other in names if other != name},
        )
        for name in names
    )


def all_checks(checks: Sequence[EliminationCheck]) -> EliminationCheck:
    """The checks of several pools as one; shares are means over pools."""
    return EliminationCheck(
        campaigns=sum(c.campaigns for c in checks),
        wrong_by_proof=sum(c.wrong_by_proof for c in checks),
        by_proof=float(np.mean([c.by_proof for c in checks])),
        wrong_by_sequence=sum(c.wrong_by_sequence for c in checks),
        by_sequence=float(np.mean([c.by_sequence for c in checks])),
    )


def check_eliminations(
    pool: Sequence[PoolTrial], *, trials: int, count: int, seed: int, sequences: int = 100
) -> EliminationCheck:
    """Campaigns with drawn strategies on trials drawn with putting back: alike and independent, as sequences need.

    Args:
        count: how many campaigns.
        sequences: in how many of them sequences are checked too, which takes longer.
    """
    true = np.array([trial.true for trial in pool])
    least = true.mean(axis=0) <= true.mean(axis=0).min() + NEAR
    names = pool[0].seen[0].strategies
    wrong_proof, wrong_sequence = 0, 0
    out_proof, out_sequence = list[float](), list[float]()
    for number in range(count):
        rng = np.random.default_rng((seed, number))
        order, driven = rng.integers(len(pool), size=trials), rng.integers(len(names), size=trials)
        seen = [pool[i].seen[k] for i, k in zip(order, driven, strict=True)]
        totals = np.cumsum(true[order], axis=0)
        out: set[str] = set()
        wrong = False
        for t in range(trials):
            out = {e.strategy for e in eliminated_by_proof(seen[: t + 1])}
            best = totals[t] <= totals[t].min() + NEAR
            wrong = wrong or any(best[k] for k, name in enumerate(names) if name in out)
        wrong_proof += wrong
        out_proof.append(len(out) / (len(names) - 1))
        if number < sequences:
            gone = {e.strategy for e in eliminated_by_sequence(seen, alpha=ALPHA)}
            wrong_sequence += any(least[k] for k, name in enumerate(names) if name in gone)
            out_sequence.append(len(gone) / (len(names) - 1))
    return EliminationCheck(
        campaigns=count,
        wrong_by_proof=wrong_proof,
        by_proof=float(np.mean(out_proof)),
        wrong_by_sequence=wrong_sequence,
        by_sequence=float(np.mean(out_sequence)) if out_sequence else 0.0,
    )
