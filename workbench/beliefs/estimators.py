"""The table of estimators: names, and how weights become an estimator."""

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
"""Makes an estimator from its weights."""

ESTIMATORS: Mapping[str, EstimatorFactory] = MappingProxyType(
    {"counts": counts_from, "fcnn": fcnn_from, "best": best_from}
)
"""The estimators by name: smoothed counts, the paper's network, and this project's best."""

WEIGHTS_SUFFIX = ".safetensors"


def estimator(name: str, *, weights: Path | None = None) -> Estimator:
    """An estimator by name, with the shipped weights unless others are given.

    Args:
        name: a name in the table, or a path that ends in .safetensors (a weights file names its estimator).

    Raises:
        UnknownName: no such estimator.
        FileMissing, MalformedFile: weights that cannot be read or belong to another estimator.
    """
    if weights is None and name.endswith(WEIGHTS_SUFFIX):
        return _of_file(Path(name), _version(Path(name)))
    if name not in ESTIMATORS:
        raise UnknownName("estimator", name, ESTIMATORS)
    if weights is None:
        return _shipped(name)
    return ESTIMATORS[name](read_weights(weights, estimator=name))


@lru_cache(maxsize=16)
def _of_file(path: Path, version: tuple[int, int]) -> Estimator:
    """The estimator of a weights file; cached until the file changes."""
    del version
    held = read_weights(path)
    if held.header.estimator not in ESTIMATORS:
        raise UnknownName("estimator", held.header.estimator, ESTIMATORS)
    return ESTIMATORS[held.header.estimator](held)


def _version(path: Path) -> tuple[int, int]:
    """A fingerprint that changes when the file is replaced; zeros if there is no file."""
    try:
        stat = path.stat()
    except OSError:
        return 0, 0
    return stat.st_mtime_ns, stat.st_size


def shipped_weights(name: str) -> Path:
    """The weights file that this distribution ships for an estimator."""
    return Path(__file__).resolve().parents[1] / "data" / "weights" / f"{name}.safetensors"


@lru_cache(maxsize=8)
def _shipped(name: str) -> Estimator:
    return ESTIMATORS[name](read_weights(shipped_weights(name), estimator=name))
