"""The comparison of estimators on the same houses, with metrics relative to the baseline `counts`."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from workbench.beliefs.belief import Estimator
from workbench.beliefs.estimators import ESTIMATORS, estimator
from workbench.beliefs.weights import read_weights
from workbench.errors import BadValue, Unsupported
from workbench.evaluation.beliefs.metrics import (
    KINDS,
    QueryResult,
    compare_with_baseline,
    evaluate_estimator,
    metrics_of,
    missing_types,
    partial_knowledge,
)
from workbench.evaluation.splits import effective_split, split_indices
from workbench.plugins import NameOrigin
from workbench.worlds.house import House
from workbench.worlds.procthor.assets import assets_for
from workbench.worlds.procthor.load import load_houses
from workbench.worlds.shipped import shipped_houses

BASE = "counts"
"""The baseline estimator."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BeliefRequest:
    """The settings of a belief evaluation.

    Attributes:
        houses: files of houses; none for the shipped ones.
        estimators: names of the table, or weights files.
        part: part of a shared file: train, validation, test or all.
        seen_share: share of containers searched before the query.
        assets: a table of exact sizes; None takes the one beside each file, if there is one.
        seed: seed of the searched containers and of the bootstrap.
    """

    houses: tuple[Path, ...] = ()
    estimators: tuple[str, ...] = ("all",)
    part: str = "test"
    seen_share: float = 0.0
    assets: Path | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        if not 0 <= self.seen_share < 1:
            raise BadValue("--seen", self.seen_share, "at least 0 and below 1")

    @property
    def files(self) -> tuple[Path, ...]:
        """The files of houses that are used."""
        return self.houses or (shipped_houses(),)

    @property
    def sizes(self) -> Path | None:
        """The asset table that is used for the first file."""
        return assets_for(self.files[0], self.assets)

    def chosen_houses(self) -> list[House]:
        """The houses of the part, of one file after another.

        Raises:
            Unsupported: a file has none.
        """
        return [house for path in self.files for house in self._chosen_of(path)]

    def _chosen_of(self, path: Path) -> list[House]:
        houses = load_houses(path, assets=assets_for(path, self.assets))
        chosen = [houses[k] for k in split_indices(path, self.part, houses=len(houses))]
        if not chosen:
            raise Unsupported(f"{path} has no house in part {self.part!r}. Give another --houses or --split all.")
        return chosen

    def chosen_estimators(self) -> dict[str, Estimator]:
        """The estimators by display name; "all" stands for the whole table."""
        names = tuple(ESTIMATORS) if self.estimators == ("all",) else self.estimators
        chosen: dict[str, Estimator] = {}
        for name in names:
            if name.endswith(".safetensors"):
                path = Path(name)
                chosen[name] = estimator(read_weights(path).header.estimator, weights=path)
            else:
                chosen[name] = estimator(name, origin=NameOrigin.USER)
        return chosen


@dataclass(frozen=True, slots=True, kw_only=True)
class BeliefReport:
    """The results: all queries by estimator, and the result of the command."""

    judged: Mapping[str, Sequence[QueryResult]]
    answer: dict[str, Any]


Progress = Callable[[Iterable[str]], Iterable[str]]


def measure(request: BeliefRequest, *, progress: Progress = iter) -> BeliefReport:
    """Evaluate every estimator on every house.

    Raises:
        InputError: the file, estimator or part does not exist.
    """
    houses = request.chosen_houses()
    estimators = request.chosen_estimators()
    judged: dict[str, list[QueryResult]] = {}
    seconds: dict[str, float] = {}
    for name in progress(list(estimators)):
        judged[name] = evaluate_estimator(estimators[name], houses, seen_share=request.seen_share, seed=request.seed)
        seconds[name] = belief_seconds(estimators[name], houses)
    identities = {name: chosen.name for name, chosen in estimators.items()}
    return report_of(request, judged, identities, seconds, houses=len(houses))


def report_of(
    request: BeliefRequest,
    judged: Mapping[str, Sequence[QueryResult]],
    identities: Mapping[str, str],
    seconds: Mapping[str, float],
    *,
    houses: int,
) -> BeliefReport:
    """The metrics of all queries, one row per estimator.

    Args:
        identities: name and hash of each estimator.
        seconds: time of a whole-house belief in seconds, by estimator.
        houses: number of houses.
    """
    base = judged.get(BASE)
    rows = [_row(name, identities[name], judged[name], base, seconds[name], request.seed) for name in judged]
    answer = {
        "file": ", ".join(map(str, request.files)),
        "files": [str(path) for path in request.files],
        "split": ", ".join(dict.fromkeys(effective_split(path, request.part) for path in request.files)),
        "assets": None if request.sizes is None else str(request.sizes),
        "houses": houses,
        "seen_share": request.seen_share,
        "seed": request.seed,
        "rows": rows,
    }
    return BeliefReport(judged=judged, answer=answer)


def belief_seconds(chosen: Estimator, houses: Sequence[House]) -> float:
    """Median time in seconds of a whole-house belief (all item types and containers), after names have been
    encoded."""
    taken: list[float] = []
    for house in houses[:20]:
        knowledge = partial_knowledge(house, seen_share=0.0, rng=np.random.default_rng(0))
        items = missing_types(house, knowledge)
        chosen.believe(knowledge, items)
        for _ in range(3):
            begin = perf_counter()
            chosen.believe(knowledge, items)
            taken.append(perf_counter() - begin)
    return float(np.median(taken)) if taken else float("nan")


def _row(
    name: str,
    identity: str,
    judged: Sequence[QueryResult],
    base: Sequence[QueryResult] | None,
    seconds: float,
    seed: int,
) -> dict[str, Any]:
    row: dict[str, Any] = {"estimator": name, "name": identity}
    row |= metrics_of(judged, rng=np.random.default_rng(seed))
    row["ms_a_belief"] = round(seconds * 1e3, 2)
    if base is not None and name != BASE:
        row["against_counts"] = compare_with_baseline(judged, base, rng=np.random.default_rng(seed))
    row["by_kind"] = {
        kind: metrics_of([j for j in judged if j.kind == kind], rng=np.random.default_rng(seed)) for kind in KINDS
    }
    return row
