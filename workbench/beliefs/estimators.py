"""The table of estimators by name and how their weights become one; others by entry point or `module:Class`.

An estimator of your own is an entry point in the group "lios.estimators" whose value is an Estimator, or a class or
function without arguments that makes one; or "module:Class" where a user gives a name (workbench/plugins.py).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType
from typing import cast

from workbench.beliefs.belief import Estimator
from workbench.beliefs.best import best_from
from workbench.beliefs.counts import counts_from
from workbench.beliefs.fcnn import fcnn_from
from workbench.beliefs.people.mixed import mixed_from
from workbench.beliefs.people.people import people_from
from workbench.beliefs.weights import Weights, read_weights
from workbench.errors import UnknownName
from workbench.plugins import ESTIMATOR, NameOrigin, NotFromLog, PluginNotLoaded, plugin

EstimatorFactory = Callable[[Weights], Estimator]
"""Makes an estimator from its weights."""

ESTIMATORS: Mapping[str, EstimatorFactory] = MappingProxyType(
    {"counts": counts_from, "fcnn": fcnn_from, "best": best_from, "people": people_from, "mixed": mixed_from}
)
"""The estimators by name: smoothed counts, the paper's network, this project's best; people's votes, and these with
the best."""

WEIGHTS_OF: Mapping[str, str] = MappingProxyType({"mixed": "people"})
"""Estimators that are made from the weights of another one."""

WEIGHTS_SUFFIX = ".safetensors"


def estimator(name: str, *, origin: NameOrigin = NameOrigin.LOG, weights: Path | None = None) -> Estimator:
    """An estimator by name, with the shipped weights unless others are given.

    Args:
        name: of the table; of an installed plug-in; or, from a user, "module:Class" or a path that ends in
            .safetensors: weights name their estimator themselves.
        origin: who gives the name.

    Raises:
        UnknownName: no such estimator.
        NotFromLog: a path or "module:Class" that only a user may give.
        PluginNotLoaded: a plug-in or "module:Class" that cannot be imported or made.
        FileMissing, MalformedFile: weights that cannot be read or belong to another estimator.
    """
    if weights is None and name.endswith(WEIGHTS_SUFFIX):
        if origin is not NameOrigin.USER:
            raise NotFromLog(ESTIMATOR, name)
        return _of_file(Path(name), _version(Path(name)))
    if name not in ESTIMATORS:
        if weights is not None:
            raise UnknownName("estimator", name, ESTIMATORS)
        return _from_outside(name, origin)
    if weights is None:
        return _shipped(name)
    return ESTIMATORS[name](read_weights(weights, estimator=WEIGHTS_OF.get(name, name)))


@lru_cache(maxsize=16)
def _from_outside(name: str, origin: NameOrigin) -> Estimator:
    """A class or function without arguments that makes an estimator, or a ready one; made once a process."""
    found = plugin(ESTIMATOR, name, origin=origin, known=ESTIMATORS)
    try:
        with found.import_path():
            made = found.load()
            made = made() if isinstance(made, type) or (callable(made) and not _is_estimator(made)) else made
    except (Exception, SystemExit) as error:
        raise PluginNotLoaded(ESTIMATOR, name, f"{type(error).__name__}: {error}") from error
    if not _is_estimator(made):
        raise PluginNotLoaded(
            ESTIMATOR, name, f"it is {type(made).__name__}; an estimator has name and believe(knowledge, item_types)"
        )
    return cast(Estimator, made)


def _is_estimator(thing: object) -> bool:
    return isinstance(getattr(thing, "name", None), str) and callable(getattr(thing, "believe", None))


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
    return Path(__file__).resolve().parents[1] / "data" / "weights" / f"{WEIGHTS_OF.get(name, name)}.safetensors"


@lru_cache(maxsize=8)
def _shipped(name: str) -> Estimator:
    return ESTIMATORS[name](read_weights(shipped_weights(name), estimator=WEIGHTS_OF.get(name, name)))
