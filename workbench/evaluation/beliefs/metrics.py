"""Quality of beliefs: log loss, ranking and calibration over all pairs of house and item type.

A query is a house and an item type that it holds and that has not been observed yet. Measured are the ranking of
the containers that hold it, and the calibration of the probabilities. Top-1, top-3 and the reciprocal rank are
means over queries, with ties in expectation over random order; log loss and calibration are over all pairs of query
and unsearched container. Calibration error: the mean gap between predicted probability and observed frequency in
fifteen equal bins, weighted by the number of pairs in each bin (Naeini et al. 2015; Guo et al. 2017).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import comb, isfinite
from typing import Any

import numpy as np

from workbench.arrays import Bools, Floats
from workbench.beliefs.belief import Estimator
from workbench.evaluation.statistics import interval_of, paired_difference, ratio_with_interval, resampled
from workbench.tolerances import EQUAL_PROBABILITY
from workbench.worlds.house import START, FloorPlan, House, ItemType, LocationId
from workbench.worlds.knowledge import Knowledge, knowledge_at_start
from workbench.worlds.travel import TravelCosts

BINS = 15
PROBABILITY_CLIP = 1e-4
"""Probabilities are clipped to [PROBABILITY_CLIP, 1 - PROBABILITY_CLIP] for the log loss."""
CALIBRATION_DRAWS = 400

KINDS = ("ai2-thor", "objaverse")


@dataclass(frozen=True, slots=True, kw_only=True)
class QueryResult:
    """One query with its results.

    Attributes:
        house, item_type: the query.
        probability, held: prediction and truth, shape (unsearched containers,).
        top1, top3: probability that a holder is among the first one or three.
        reciprocal_rank: expected reciprocal of the rank of the first holder.
    """

    house: str
    item_type: str
    probability: Floats
    held: Bools
    top1: float
    top3: float
    reciprocal_rank: float

    @property
    def kind(self) -> str:
        return "objaverse" if self.item_type.startswith("Obja") else "ai2-thor"


def evaluate_estimator(
    estimator: Estimator, houses: Iterable[House], *, seen_share: float = 0.0, seed: int = 0
) -> list[QueryResult]:
    """Evaluate an estimator on every item type of every house.

    Args:
        estimator: the estimator.
        houses: the houses.
        seen_share: share of containers searched before the query; 0 is the start of a run.
        seed: of the choice of those containers; the same for every estimator.
    """
    judged: list[QueryResult] = []
    for k, house in enumerate(houses):
        knowledge = partial_knowledge(house, seen_share=seen_share, rng=np.random.default_rng((seed, k)))
        items = missing_types(house, knowledge)
        if not items or not knowledge.unsearched:
            continue
        belief = estimator.believe(knowledge, items)
        for item, row in zip(items, belief.probability, strict=True):
            holders = set(house.holders(item))
            held = np.array([c in holders for c in belief.containers], dtype=bool)
            judged.append(_judged(house.plan.name, item, row, held))
    return judged


def partial_knowledge(house: House, *, seen_share: float, rng: np.random.Generator) -> Knowledge:
    """The knowledge after searching a random share of the containers; at least one stays unsearched."""
    ids = [c.id for c in house.plan.containers]
    count = min(round(seen_share * len(ids)), max(len(ids) - 1, 0))
    known = {ids[k]: house.contents[ids[k]] for k in sorted(rng.permutation(len(ids))[:count].tolist())}
    return knowledge_at_start(house.plan, dummy_travel_costs(house.plan), known)


def dummy_travel_costs(plan: FloorPlan) -> TravelCosts:
    """Dummy travel costs for beliefs, which do not depend on distances."""
    locations = (START, *(LocationId(c.id) for c in plan.containers))
    return TravelCosts(locations=locations, metres=np.zeros((len(locations), len(locations))))


def missing_types(house: House, knowledge: Knowledge) -> tuple[ItemType, ...]:
    """The item types of a house without an observed instance, sorted."""
    return tuple(t for t in house.item_types() if not knowledge.has_known_instance(t))


def metrics_of(judged: Sequence[QueryResult], *, rng: np.random.Generator) -> dict[str, Any]:
    """The metrics over queries, each with a bootstrap interval over houses.

    `top1_said` is the mean probability of the estimator's first choice, the best top-1 that a calibrated estimator
    with the same information can reach.
    """
    if not judged:
        return {"queries": 0}
    houses = [j.house for j in judged]
    loss = np.array([_log_loss(j).sum() for j in judged])
    pairs = np.array([len(j.held) for j in judged], dtype=np.float64)
    answer: dict[str, Any] = {"queries": len(judged), "houses": len(set(houses)), "pairs": int(pairs.sum())}
    columns = {
        "log_loss": (loss, pairs),
        "top1": (np.array([j.top1 for j in judged]), np.ones(len(judged))),
        "top3": (np.array([j.top3 for j in judged]), np.ones(len(judged))),
        "mrr": (np.array([j.reciprocal_rank for j in judged]), np.ones(len(judged))),
    }
    for name, (top, bottom) in columns.items():
        estimate = ratio_with_interval(top, bottom, houses, rng=rng)
        answer[name] = round(estimate.value, 5)
        answer[f"{name}_ci95"] = [round(v, 5) for v in estimate.interval]
    answer["top1_said"] = round(float(np.mean([j.probability.max() for j in judged])), 5)
    answer["ece"] = round(calibration_error(judged), 5)
    answer["ece_ci95"] = _calibration_interval(judged, rng)
    answer["ci95_resamples"] = resampled(len(judged), len(set(houses)), "houses", "queries")
    return answer


def compare_with_baseline(
    judged: Sequence[QueryResult], base: Sequence[QueryResult], *, rng: np.random.Generator
) -> dict[str, Any]:
    """Comparison with a baseline over the same queries: top-1 gain and ratio of log losses, with intervals."""
    houses = [j.house for j in judged]
    gain = paired_difference([j.top1 for j in judged], [j.top1 for j in base], houses, rng=rng)
    loss = ratio_with_interval(
        [float(_log_loss(j).sum()) for j in judged], [float(_log_loss(j).sum()) for j in base], houses, rng=rng
    )
    return {
        "top1_gain": round(gain.value, 5),
        "top1_gain_ci95": [round(v, 5) for v in gain.interval],
        "log_loss_ratio": round(loss.value, 5),
        "log_loss_ratio_ci95": [round(v, 5) for v in loss.interval],
        "ci95_resamples": gain.resampled("houses", "queries"),
    }


@dataclass(frozen=True, slots=True, kw_only=True)
class Reliability:
    """Calibration by bin: weight, mean prediction, and observed frequency. Each of shape (BINS,)."""

    count: Floats
    said: Floats
    was: Floats


def reliability(judged: Sequence[QueryResult]) -> Reliability:
    """The bins of a reliability diagram; an empty bin has 0 for both means."""
    p, y = np.concatenate([j.probability for j in judged]), np.concatenate([j.held for j in judged])
    at = np.minimum((p * BINS).astype(np.int64), BINS - 1)
    count = np.bincount(at, minlength=BINS).astype(np.float64)
    below = np.maximum(count, 1.0)
    return Reliability(
        count=count,
        said=np.bincount(at, p, minlength=BINS) / below,
        was=np.bincount(at, y.astype(np.float64), minlength=BINS) / below,
    )


def calibration_error(judged: Sequence[QueryResult]) -> float:
    """The expected calibration error."""
    bins = reliability(judged)
    return float((bins.count * np.abs(bins.said - bins.was)).sum() / bins.count.sum())


def _calibration_interval(judged: Sequence[QueryResult], rng: np.random.Generator) -> list[float]:
    """Percentile interval over houses: the bins' sums are drawn, house by house; in one house, query by query."""
    houses = {house: k for k, house in enumerate(dict.fromkeys(j.house for j in judged))}
    of = [houses[j.house] for j in judged] if len(houses) > 1 else list(range(len(judged)))
    gaps = np.zeros((max(of) + 1, BINS))
    counts = np.zeros(len(gaps))
    for k, j in zip(of, judged, strict=True):
        at = np.minimum((j.probability * BINS).astype(np.int64), BINS - 1)
        gaps[k] += np.bincount(at, j.probability - j.held, minlength=BINS)
        counts[k] += len(at)
    chosen = rng.integers(len(gaps), size=(CALIBRATION_DRAWS, len(gaps)))
    drawn = np.abs(gaps[chosen].sum(axis=1)).sum(axis=1) / counts[chosen].sum(axis=1)
    ends = interval_of(drawn, calibration_error(judged), trials=len(judged), clusters=len(houses))
    return [round(max(end, 0.0), 5) if isfinite(end) else end for end in ends]


def _judged(house: str, item: str, p: Floats, held: Bools) -> QueryResult:
    better, ties, good = _first_holder(p, held)
    ranks = _rank_chances(ties, good)
    at = better + np.arange(len(ranks))
    return QueryResult(
        house=house,
        item_type=item,
        probability=p,
        held=held,
        top1=float(ranks[at < 1].sum()),
        top3=float(ranks[at < 3].sum()),
        reciprocal_rank=float((ranks / (at + 1)).sum()),
    )


def _first_holder(p: Floats, held: Bools) -> tuple[int, int, int]:
    """The number of containers ranked above the best holder, of containers tied with it, and of holders among
    these."""
    if not held.any():
        return len(p), 0, 0
    best = p[held].max()
    alike = np.abs(p - best) < EQUAL_PROBABILITY
    return int((p > best + EQUAL_PROBABILITY).sum()), int(alike.sum()), int((alike & held).sum())


def _rank_chances(ties: int, good: int) -> Floats:
    """The probability that the first of `good` holders is at position 0, 1, ... among `ties` in random order."""
    if good == 0:
        return np.zeros(0)
    places = range(ties - good + 1)
    return np.array([comb(ties - 1 - k, good - 1) / comb(ties, good) for k in places])


def _log_loss(judged: QueryResult) -> Floats:
    p = np.clip(judged.probability, PROBABILITY_CLIP, 1 - PROBABILITY_CLIP)
    return -np.where(judged.held, np.log(p), np.log1p(-p))
