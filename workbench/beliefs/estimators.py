"""The table of estimators by name and how their weights become one; others by entry point or `module:Class`.

An estimator of your own is an entry point in the group "lios.estimators" whose value is an Estimator, or a class or
function without arguments that makes one; or "module:Class" where a user gives a name (workbench/plugins.py). One
whose answers cost something is asked each question once (asking/): an AskingEstimator, an Estimator with
`costly = True`, or a prompt file for a language model.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType
from typing import cast

from workbench.beliefs.asking.answered_estimator import ASKING_METHODS, AskingEstimator, answered
from workbench.beliefs.asking.answers import Answer
from workbench.beliefs.asking.chat import ChatQuestions
from workbench.beliefs.asking.prompt_file import SUFFIX as PROMPT_SUFFIX
from workbench.beliefs.asking.prompt_file import read_prompt
from workbench.beliefs.asking.state_questions import StateQuestions
from workbench.beliefs.belief import Estimator
from workbench.beliefs.counts import counts_from
from workbench.beliefs.guarded_estimator import GuardedEstimator
from workbench.beliefs.weights import Weights, read_weights
from workbench.errors import UnknownName, Unsupported
from workbench.plugins import ESTIMATOR, NameOrigin, NotFromLog, PluginNotLoaded, plugin, taken_name, tell_left_out

EstimatorFactory = Callable[[Weights], Estimator]
"""Makes an estimator from its weights."""


def _fcnn(weights: Weights) -> Estimator:
    from workbench.beliefs.fcnn import fcnn_from

    return fcnn_from(weights)


def _best(weights: Weights) -> Estimator:
    from workbench.beliefs.best import best_from

    return best_from(weights)


def _people(weights: Weights) -> Estimator:
    from workbench.beliefs.people.people import people_from

    return people_from(weights)


def _mixed(weights: Weights) -> Estimator:
    from workbench.beliefs.people.mixed import mixed_from

    return mixed_from(weights)


ESTIMATORS: Mapping[str, EstimatorFactory] = MappingProxyType(
    {
        "counts": counts_from,
        "fcnn": _fcnn,
        "best": _best,
        "people": _people,
        "mixed": _mixed,
    }
)
"""The estimators by name: smoothed counts, the paper's network, this project's best; people's votes, and these with
the best. All but the first import much, and do so when they are made."""

WEIGHTS_OF: Mapping[str, str] = MappingProxyType({"mixed": "people"})
"""Estimators that are made from the weights of another one."""

WEIGHTS_SUFFIX = ".safetensors"


def estimator(
    name: str,
    *,
    origin: NameOrigin = NameOrigin.LOG,
    weights: Path | None = None,
    known: Iterable[Answer] = (),
    may_ask: bool = True,
    limit_s: float | None = None,
) -> Estimator:
    """An estimator by name, with the shipped weights unless others are given.

    Args:
        name: of the table; of an installed plug-in; or, from a user, "module:Class", or a path that ends in
            .safetensors (weights name their estimator themselves) or .prompt (asking/prompt_file.py).
        origin: who gives the name.
        known: answers of a log, for one whose answers cost something.
        may_ask: whether such a one is asked for what neither the log nor the cache holds.
        limit_s: the longest that one from outside may take for a belief; BELIEF_LIMIT_S by default.

    Raises:
        UnknownName: no such estimator.
        NotFromLog: a path or "module:Class" that only a user may give.
        PluginNotLoaded: a plug-in or "module:Class" that cannot be imported or made.
        FileMissing, MalformedFile: weights or a prompt that cannot be read, or weights of another estimator.
    """
    if weights is None and name.endswith((WEIGHTS_SUFFIX, PROMPT_SUFFIX)):
        if origin is not NameOrigin.USER:
            raise NotFromLog(ESTIMATOR, name)
        if name.endswith(WEIGHTS_SUFFIX):
            return _of_file(Path(name), _version(Path(name)))
        prompt, endpoint = read_prompt(Path(name))
        return answered(ChatQuestions(prompt=prompt, endpoint=endpoint), known, may_ask=may_ask)
    if name not in ESTIMATORS:
        if weights is not None:
            raise UnknownName("estimator", name, ESTIMATORS)
        return wrapped_estimator(_from_outside(name, origin), known, may_ask=may_ask, limit_s=limit_s)
    if weights is None:
        if origin is NameOrigin.USER:
            tell_left_out(ESTIMATOR, name)
        return _shipped(name)
    return ESTIMATORS[name](read_weights(weights, estimator=WEIGHTS_OF.get(name, name)))


def is_built_in(name: str) -> bool:
    """Whether a name stands for an estimator of the table, or for a file."""
    return name in ESTIMATORS or name.endswith((WEIGHTS_SUFFIX, PROMPT_SUFFIX))


def wrapped_estimator(
    made: object, known: Iterable[Answer] = (), *, may_ask: bool = True, limit_s: float | None = None
) -> Estimator:
    """An estimator from outside as a run uses it: guarded, and asked each question once where that costs something.

    Args:
        made: an Estimator, one with `costly = True`, or an AskingEstimator.
        known: as for `estimator`.
        may_ask: as for `estimator`.
        limit_s: as for `estimator`.

    Raises:
        NoEstimator: it is none of them.
    """
    if not _is_estimator(made):
        raise NoEstimator(made)
    if _is_asking(made):
        return answered(cast(AskingEstimator, made), known, may_ask=may_ask)
    whole = cast(Estimator, made)
    if getattr(made, "costly", False) is not True:
        return GuardedEstimator(whole, limit_s)
    alone = getattr(made, "names_alone", False) is True
    questions = StateQuestions(whole.name, whole, model=str(getattr(made, "model", "")), names_alone=alone)
    return answered(questions, known, may_ask=may_ask)


class NoEstimator(Unsupported):
    """Something that was to be an estimator is none."""

    def __init__(self, made: object) -> None:
        what = f"it is {type(made).__name__}; an estimator has name and believe(knowledge, item_types)"
        super().__init__(f"{what}. See docs/beliefs.md.")


@lru_cache(maxsize=16)
def _from_outside(name: str, origin: NameOrigin) -> object:
    """What a class or function without arguments makes, or a ready estimator; made once a process."""
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
    own = cast(Estimator, made).name
    if not own.strip() or not own.isprintable():
        raise PluginNotLoaded(ESTIMATOR, name, f"its name is {own!r}; it must be one line of text")
    if own in ESTIMATORS:  # ours have the hash of their weights behind it
        raise PluginNotLoaded(ESTIMATOR, name, taken_name(own))
    return made


def _is_estimator(thing: object) -> bool:
    named = isinstance(getattr(thing, "name", None), str)
    return named and (callable(getattr(thing, "believe", None)) or _is_asking(thing))


def _is_asking(thing: object) -> bool:
    methods = all(callable(getattr(thing, method, None)) for method in ASKING_METHODS)
    return methods and isinstance(getattr(thing, "model", None), str) and hasattr(thing, "names_alone")


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
