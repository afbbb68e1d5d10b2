"""Training of estimators for each fold, in this process, on several, or on a Dask cluster.

A worker receives the names of the files and the number of the fold, and reads the houses itself: the files of houses
and the folder of the weights must have the same paths on all workers.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory

from workbench.beliefs.training.train import houses_sha256, train
from workbench.beliefs.weights import read_weights
from workbench.errors import InputError
from workbench.evaluation.beliefs.fold_weights import (
    FoldEstimators,
    FoldSource,
    FoldSplit,
    make_folds,
    require_trainable,
)
from workbench.evaluation.cluster import Workforce, run_in_order
from workbench.files import atomic

Progress = Callable[[Iterable[Path], int], Iterable[Path]]


@dataclass(frozen=True, slots=True, kw_only=True)
class FoldTraining:
    """One training: an estimator without the houses of a fold, and where its weights go."""

    source: FoldSource
    estimator: str
    fold: int
    path: Path


def no_progress(trained: Iterable[Path], count: int) -> Iterable[Path]:
    del count
    return trained


@contextmanager
def trained_per_fold(
    names: Iterable[str],
    fold_split: FoldSplit | None,
    output: Path | None,
    *,
    progress: Progress = no_progress,
    on: Workforce = Workforce(),
) -> Generator[FoldEstimators]:
    """A context with estimators retrained for each fold; without folds, with the estimators as they are.

    Args:
        output: keeps the weights in OUTPUT/weights for reuse; None discards them.
        progress: wraps the trainings and their number, for a progress bar.

    Raises:
        UnknownName: an estimator cannot be trained. And what run_in_order raises.
    """
    if fold_split is None:
        yield FoldEstimators()
    elif output is not None:
        yield train_folds(names, fold_split, output / "weights", progress=progress, on=on)
    else:
        # Workers of a cluster see the working folder, and not the folder of temporary files here.
        with TemporaryDirectory(dir=Path.cwd() if on.scheduler else None, prefix=".lios-folds-") as temporary:
            yield train_folds(names, fold_split, Path(temporary), progress=progress, on=on)


def train_folds(
    names: Iterable[str],
    fold_split: FoldSplit,
    folder: Path,
    *,
    progress: Progress = no_progress,
    on: Workforce = Workforce(),
    anew: bool = False,
) -> FoldEstimators:
    """Weights FOLDER/NAME-FOLD-of-COUNT.safetensors, the same bytes whoever trains.

    Args:
        anew: train also where a file of the same training is there.

    Raises:
        UnknownName: an estimator cannot be trained. And what run_in_order raises.
    """
    chosen = tuple(dict.fromkeys(names))
    require_trainable(chosen)
    folder.mkdir(parents=True, exist_ok=True)
    every = [
        FoldTraining(
            source=fold_split.source,
            estimator=name,
            fold=fold,
            path=weights_path(folder, name, fold, fold_split.count),
        )
        for name in chosen
        for fold in range(fold_split.count)
    ]
    left = [one for one in every if anew or not _is_made(one, fold_split)]
    for _ in progress(run_in_order(train_fold, left, workers=on.workers, scheduler=on.scheduler), len(left)):
        pass
    weights = {name: tuple(str(one.path) for one in every if one.estimator == name) for name in chosen}
    return FoldEstimators(weights=weights, fold_of=fold_split.fold_of())


def weights_path(folder: Path, estimator: str, fold: int, count: int) -> Path:
    """Where the weights of a fold are kept."""
    return (folder / f"{estimator}-{fold}-of-{count}.safetensors").absolute()


def train_fold(one: FoldTraining) -> Path:
    """Trains an estimator without the houses of a fold; executed by workers."""
    source = one.source
    files = (source.path, *source.folds.also, *([source.assets] if source.assets else []))
    training_set = _split(source, tuple(_stamp(file) for file in files)).training_set(one.fold)
    with atomic(one.path) as draft:
        train(one.estimator, training_set, draft)
    return one.path


@lru_cache(maxsize=1)
def _split(source: FoldSource, stamps: Sequence[int]) -> FoldSplit:
    """The split of a source; read again when one of its files has changed."""
    del stamps
    return make_folds(source.path, source.folds, assets=source.assets, seed=source.seed)


def _stamp(file: Path) -> int:
    try:
        return file.stat().st_mtime_ns
    except OSError:
        return 0  # reading the file will report that it is missing


def _is_made(one: FoldTraining, fold_split: FoldSplit) -> bool:
    """Whether a file holds the weights of this estimator and this training set."""
    try:
        header = read_weights(one.path, estimator=one.estimator).header
    except InputError:
        return False
    training_set = fold_split.training_set(one.fold)
    return header.seed == training_set.seed and header.houses_sha256 == houses_sha256(training_set.houses)
