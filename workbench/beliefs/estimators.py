"""Which estimators are there? One readable table: a name and how its weights become an estimator."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType

from workbench.beliefs.belief import Estimator
from workbench.beliefs.best import best_from
from workbench.beliefs.counts import counts_from
from workbench.beliefs.fcnn import fcnn_from
from workbench.beliefs.weights import Weights, read_weights
from workbench.errors import UnknownName

EstimatorFactory = Callable[[Weights], Estimator]
"""Makes an estimator of its weights."""

ESTIMATORS: Mapping[str, EstimatorFactory] = MappingProxyType(
    {"counts": counts_from, "fcnn": fcnn_from, "best": best_from}
)
"""The estimators by name: smoothed counts, the paper's network, and the best one here."""

WEIGHTS_SUFFIX = ".safetensors"


def estimator(name: str, *, weights: Path | None = None) -> Estimator:
    """An estimator by name, with the shipped weights unless others are given.

    Args:
        name: of the table; or a path that ends in .safetensors: weights name their estimator themselves.

    Raises:
        UnknownName: no such estimator.
        FileMissing, MalformedFile: weights that cannot be read or belong to another estimator.
    """
    if weights is None and name.endswith(WEIGHTS_SUFFIX):
        held = read_weights(Path(name))
        return estimator(held.header.estimator, weights=Path(name))
    if name not in ESTIMATORS:
        raise UnknownName("estimator", name, ESTIMATORS)
    if weights is None:
        return _shipped(name)
    return ESTIMATORS[name](read_weights(weights, estimator=name))


def shipped_weights(name: str) -> Path:
    """The weights file that this distribution ships for an estimator."""
    return Path(__file__).resolve().parents[1] / "data" / "weights" / f"{name}.safetensors"


@lru_cache(maxsize=8)
def _shipped(name: str) -> Estimator:
    return ESTIMATORS[name](read_weights(shipped_weights(name), estimator=name))
