"""Cross-validation folds: houses split into folds, and estimators retrained for each fold without its houses.

The training houses are four times as many as the validation houses. With folds, each of them is evaluated with
estimators retrained on the other folds. Files of training-only houses (those of a single room) are part of every
training set.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from workbench.beliefs.training.train import TRAINERS, TrainingSet
from workbench.errors import BadValue, UnknownName, first_few
from workbench.evaluation.beliefs.training_sets import training_set_of
from workbench.worlds.house import House

HELD_OUT = 0.1
"""Share of a file without splits that is held out to decide when training stops; it is not evaluated."""

ENCODER = "all-MiniLM-L6-v2"


@dataclass(frozen=True, slots=True, kw_only=True)
class Folds:
    """The settings of folds.

    Attributes:
        count: number of folds.
        also: files of houses used for training only.

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
        """A description of the evaluated houses."""
        return f"train, {self.count} folds"


def folds_from_options(count: int | None, also: Sequence[Path] | None) -> Folds | None:
    """The settings given by --folds and --also; None without folds.

    Raises:
        BadValue: fewer than two folds, or --also without them.
    """
    if count is not None:
        return Folds(count=count, also=tuple(also or ()))
    if also:
        raise BadValue("--also", ", ".join(map(str, also)), "used with --folds: houses for training only")
    return None


@dataclass(frozen=True, slots=True, kw_only=True)
class FoldSource:
    """What makes a split: the same source gives the same split everywhere. The arguments are those of make_folds."""

    path: Path
    folds: Folds
    assets: Path | None
    seed: int


@dataclass(frozen=True, slots=True, kw_only=True)
class FoldSplit:
    """Houses split into folds round-robin.

    Attributes:
        source: what it was made of.
        own: houses used for training and evaluation.
        also: houses used for training only.
    """

    source: FoldSource
    own: TrainingSet
    also: TrainingSet | None
    count: int

    def fold(self, number: int) -> Sequence[House]:
        """The houses evaluated in a fold."""
        return self.own.houses[number :: self.count]

    def fold_of(self) -> dict[str, int]:
        """The fold of every evaluated house, by name."""
        return {house.plan.name: k % self.count for k, house in enumerate(self.own.houses)}

    def training_set(self, number: int) -> TrainingSet:
        """The training set of a fold: everything but its houses."""
        kept = [k for k in range(len(self.own.houses)) if k % self.count != number]
        parts = [self.own] if self.also is None else [self.own, self.also]
        usual = [part.usual_sizes or part.houses for part in parts]
        exact = any(part.usual_sizes is not None for part in parts)
        others, others_usual = (self.also.houses, usual[1]) if self.also is not None else ((), ())
        return TrainingSet(
            houses=[*(self.own.houses[k] for k in kept), *others],
            held_out=[house for part in parts for house in part.held_out],
            encoder=self.own.encoder,
            seed=self.own.seed,
            usual_sizes=[*(usual[0][k] for k in kept), *others_usual] if exact else None,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class FoldEstimators:
    """The choice of weights for each house: those of its fold, or the named estimator without folds.

    Attributes:
        weights: a weights file for each fold, by estimator name.
        fold_of: the fold of each house, by name.
    """

    weights: Mapping[str, tuple[str, ...]] = field(default_factory=dict[str, tuple[str, ...]])
    fold_of: Mapping[str, int] = field(default_factory=dict[str, int])

    def of(self, estimator: str, house: str) -> str:
        """The estimator for a house: a name or a weights file."""
        return self.weights[estimator][self.fold_of[house]] if self.weights else estimator


def make_folds(path: Path, folds: Folds, *, assets: Path | None, seed: int) -> FoldSplit:
    """Split the houses of a file into folds; of a shared file the training houses, with its validation houses held
    out.

    Raises:
        InputError: a file cannot be read, there are fewer houses than folds, or an evaluated house is also
            among the training-only houses under another name.
    """
    own = _training_set((path,), assets=assets, seed=seed)
    also = _training_set(folds.also, assets=assets, seed=seed) if folds.also else None
    if len(own.houses) < folds.count:
        raise BadValue("--folds", folds.count, f"at most {len(own.houses)}, the number of houses to learn from")
    _require_disjoint(own, also)
    source = FoldSource(path=path, folds=folds, assets=assets, seed=seed)
    return FoldSplit(source=source, own=own, also=also, count=folds.count)


def require_trainable(names: Iterable[str]) -> None:
    """Check that all estimators can be retrained.

    Raises:
        UnknownName: one of them cannot.
    """
    for name in names:
        if name not in TRAINERS:
            raise UnknownName("estimator to train", name, TRAINERS)


def _training_set(files: Sequence[Path], *, assets: Path | None, seed: int) -> TrainingSet:
    return training_set_of(files, assets=assets, encoder=ENCODER, seed=seed, share=HELD_OUT)


def _require_disjoint(own: TrainingSet, also: TrainingSet | None) -> None:
    """Check that no evaluated house is among the training-only houses under another name.

    Raises:
        BadValue: one of them is.
    """
    if also is None:
        return
    judged = {_house_content(house) for house in own.houses}
    twice = [h.plan.name for h in (*also.houses, *also.held_out) if _house_content(h) in judged]
    if twice:
        raise BadValue("--also", first_few(twice, 3), "disjoint from the evaluated houses")


def _house_content(house: House) -> tuple[object, ...]:
    """A house without its name: layout and contents."""
    return tuple((c.type, c.pose, tuple(i.type for i in house.contents[c.id])) for c in house.plan.containers)
