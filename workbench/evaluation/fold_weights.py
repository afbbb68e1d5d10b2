"""What may judge a house that an estimator could learn from? Weights that were trained without it, one set a fold.

The houses to learn from are four times as many as those held out. Dealt into folds, each house is met by estimators
that were trained anew on the other folds. Files of houses that are learnt from only (those of a single room) belong
to every training.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

from workbench.beliefs.training import TRAINERS, Lesson, houses_sha256, train
from workbench.beliefs.weights import read_weights
from workbench.errors import BadValue, InputError, UnknownName
from workbench.evaluation.lessons import lesson_of
from workbench.worlds.house import House

HELD_OUT = 0.1
"""Share of a file that is not split that says when training stops; it is not judged."""

ENCODER = "all-MiniLM-L6-v2"

Training = tuple[str, int]
"""An estimator's name and a fold."""

Watched = Callable[[Iterable[Training]], Iterable[Training]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Folds:
    """How houses are dealt.

    Attributes:
        count: of folds.
        also: files of houses that are learnt from and not judged.

    Raises:
        BadValue: fewer than two folds.
    """

    count: int
    also: tuple[Path, ...] = ()

    def __post_init__(self) -> None:
        if self.count < 2:
            raise BadValue("--folds", self.count, "at least 2")

    @property
    def split(self) -> str:
        """Which houses are met, in words."""
        return f"train, {self.count} folds"


def folds_asked(count: int | None, also: Sequence[Path] | None) -> Folds | None:
    """What --folds and --also ask for; None without folds.

    Raises:
        BadValue: fewer than two folds, or --also without them.
    """
    if count is not None:
        return Folds(count=count, also=tuple(also or ()))
    if also:
        raise BadValue("--also", ", ".join(map(str, also)), "given with --folds: houses that are only learnt from")
    return None


@dataclass(frozen=True, slots=True, kw_only=True)
class Dealt:
    """Houses dealt into folds, every count-th into the same one.

    Attributes:
        own: what is learnt from and judged.
        also: what is learnt from only.
    """

    own: Lesson
    also: Lesson | None
    count: int

    def fold(self, number: int) -> Sequence[House]:
        """The houses that are judged in a fold."""
        return self.own.houses[number :: self.count]

    def fold_of(self) -> dict[str, int]:
        """The fold of every house that is judged, by name."""
        return {house.plan.name: k % self.count for k, house in enumerate(self.own.houses)}

    def lesson(self, number: int) -> Lesson:
        """What the estimators of a fold learn from: everything but its houses."""
        kept = [k for k in range(len(self.own.houses)) if k % self.count != number]
        parts = [self.own] if self.also is None else [self.own, self.also]
        usual = [part.usual_sizes or part.houses for part in parts]
        exact = any(part.usual_sizes is not None for part in parts)
        others, others_usual = (self.also.houses, usual[1]) if self.also is not None else ((), ())
        return Lesson(
            houses=[*(self.own.houses[k] for k in kept), *others],
            held_out=[house for part in parts for house in part.held_out],
            encoder=self.own.encoder,
            seed=self.own.seed,
            usual_sizes=[*(usual[0][k] for k in kept), *others_usual] if exact else None,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Believers:
    """Which weights believe for which house? Those of its fold; without folds the estimator as it was named.

    Attributes:
        weights: by estimator's name, a weights file for each fold.
        fold_of: by house's name.
    """

    weights: Mapping[str, tuple[str, ...]] = field(default_factory=dict[str, tuple[str, ...]])
    fold_of: Mapping[str, int] = field(default_factory=dict[str, int])

    def of(self, estimator: str, house: str) -> str:
        """What to ask for a belief about a house: an estimator's name or a weights file."""
        return self.weights[estimator][self.fold_of[house]] if self.weights else estimator


def deal(path: Path, folds: Folds, *, assets: Path | None, seed: int) -> Dealt:
    """Deal the houses of a file; of a shared one the training houses, its validation houses say when to stop.

    Raises:
        InputError: a file that cannot be read, fewer houses than folds, houses that are judged and learnt from
            under another name.
    """
    own = _lesson((path,), assets=assets, seed=seed)
    also = _lesson(folds.also, assets=assets, seed=seed) if folds.also else None
    if len(own.houses) < folds.count:
        raise BadValue("--folds", folds.count, f"at most {len(own.houses)}, the number of houses to learn from")
    _require_others(own, also)
    return Dealt(own=own, also=also, count=folds.count)


def require_trainable(names: Iterable[str]) -> None:
    """Raises UnknownName for an estimator that cannot be trained anew."""
    for name in names:
        if name not in TRAINERS:
            raise UnknownName("estimator to train", name, TRAINERS)


@contextmanager
def trained(
    names: Iterable[str], dealt: Dealt | None, output: Path | None, *, watched: Watched = iter
) -> Generator[Believers]:
    """Estimators trained anew for each fold, as long as the context lasts; without folds those that are there.

    Args:
        output: keeps the weights in OUTPUT/weights, where they are found again; None keeps them nowhere.
        watched: wraps the trainings, for a progress bar.

    Raises:
        UnknownName: an estimator that cannot be trained.
    """
    if dealt is None:
        yield Believers()
    elif output is not None:
        yield _believers(names, dealt, output / "weights", watched)
    else:
        with TemporaryDirectory() as temporary:
            yield _believers(names, dealt, Path(temporary), watched)


def _believers(names: Iterable[str], dealt: Dealt, folder: Path, watched: Watched) -> Believers:
    """Weights NAME-FOLD-of-COUNT.safetensors; what the folder holds of this very training is kept."""
    chosen = tuple(dict.fromkeys(names))
    require_trainable(chosen)
    weights: dict[str, list[str]] = {name: [] for name in chosen}
    for name, fold in watched([(name, fold) for name in chosen for fold in range(dealt.count)]):
        path = (folder / f"{name}-{fold}-of-{dealt.count}.safetensors").absolute()
        lesson = dealt.lesson(fold)
        if not _is_of(path, name, lesson):
            half = path.with_name(f".{path.name}.{os.getpid()}")
            train(name, lesson, half)
            half.replace(path)
        weights[name].append(str(path))
    return Believers(weights={k: tuple(v) for k, v in weights.items()}, fold_of=dealt.fold_of())


def _is_of(path: Path, name: str, lesson: Lesson) -> bool:
    """Whether a file holds what this estimator learns of this lesson."""
    try:
        header = read_weights(path, estimator=name).header
    except InputError:
        return False
    return header.seed == lesson.seed and header.houses_sha256 == houses_sha256(lesson.houses)


def _lesson(files: Sequence[Path], *, assets: Path | None, seed: int) -> Lesson:
    return lesson_of(files, assets=assets, encoder=ENCODER, seed=seed, share=HELD_OUT)


def _require_others(own: Lesson, also: Lesson | None) -> None:
    """Raises BadValue where a house that is to be judged is learnt from under another name."""
    if also is None:
        return
    judged = {_what_it_is(house) for house in own.houses}
    twice = [h.plan.name for h in (*also.houses, *also.held_out) if _what_it_is(h) in judged]
    if twice:
        shown = ", ".join(twice[:3]) + (f" and {len(twice) - 3} more" if len(twice) > 3 else "")
        raise BadValue("--also", shown, "without houses that are judged")


def _what_it_is(house: House) -> tuple[object, ...]:
    """A house without its name: what stands where, and what is in it."""
    return tuple((c.type, c.pose, tuple(i.type for i in house.contents[c.id])) for c in house.plan.containers)
