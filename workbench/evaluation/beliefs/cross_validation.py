"""Cross-validation of estimators: each house is evaluated with weights trained without it."""

from __future__ import annotations

from workbench.beliefs.estimators import estimator
from workbench.beliefs.training.train import TRAINERS
from workbench.errors import BadValue
from workbench.evaluation.beliefs.fold_training import Progress, no_progress, trained_per_fold
from workbench.evaluation.beliefs.fold_weights import Folds, make_folds, require_trainable
from workbench.evaluation.beliefs.metrics import QueryResult, evaluate_estimator
from workbench.evaluation.beliefs.report import BeliefReport, BeliefRequest, belief_seconds, report_of
from workbench.plugins import NameOrigin


def cross_validate(request: BeliefRequest, folds: Folds, *, progress: Progress = no_progress) -> BeliefReport:
    """Train every estimator once per fold and evaluate it on the houses of that fold.

    Args:
        request: `part` is ignored: the training houses of a shared file are split into folds, and its
            validation houses decide when training stops.
        progress: wraps the trainings, for a progress bar.

    Raises:
        InputError: a file cannot be read, there are fewer houses than folds, or an estimator has no trainer.
    """
    names = tuple(TRAINERS) if request.estimators == ("all",) else tuple(dict.fromkeys(request.estimators))
    require_trainable(names)
    file, *more = request.files
    if more:
        raise BadValue(
            "--houses", " ".join(map(str, more)), "one file with --folds; give further training houses with --also"
        )
    fold_split = make_folds(file, folds, assets=request.assets, seed=request.seed)
    judged: dict[str, list[QueryResult]] = {name: [] for name in names}
    seconds: dict[str, float] = {}
    with trained_per_fold(names, fold_split, None, progress=progress) as fold_estimators:
        for name in names:
            for fold, weights in enumerate(fold_estimators.weights[name]):
                chosen, tested = estimator(weights, origin=NameOrigin.USER), fold_split.fold(fold)
                judged[name] += evaluate_estimator(
                    chosen, tested, seen_share=request.seen_share, seed=request.seed + fold
                )
                seconds[name] = belief_seconds(chosen, tested)
    identities = {name: f"{name}, {folds.count} folds" for name in names}
    report = report_of(request, judged, identities, seconds, houses=len(fold_split.own.houses))
    report.answer.update({"split": folds.split, "also": [str(p) for p in folds.also]})
    return report
