"""How good is an estimator on more houses than those held out? Each house judged by what never learnt from it."""

from __future__ import annotations

from workbench.beliefs.estimators import estimator
from workbench.beliefs.training import TRAINERS
from workbench.evaluation.belief_quality import Judged, judge
from workbench.evaluation.belief_report import BeliefReport, BeliefRequest, belief_seconds, report_of
from workbench.evaluation.fold_weights import Folds, Watched, deal, require_trainable, trained
from workbench.plugins import NameOrigin
from workbench.worlds.shipped import shipped_houses


def cross_validate(request: BeliefRequest, folds: Folds, *, watched: Watched = iter) -> BeliefReport:
    """Train every estimator once a fold and judge it on that fold's houses.

    Args:
        request: `part` is not asked: of a file that is split the training houses are dealt, and its validation
            houses say when to stop.
        watched: wraps the trainings, for a progress bar.

    Raises:
        InputError: a file that cannot be read, fewer houses than folds, a name that no trainer has.
    """
    names = tuple(TRAINERS) if request.estimators == ("all",) else tuple(dict.fromkeys(request.estimators))
    require_trainable(names)
    dealt = deal(request.houses or shipped_houses(), folds, assets=request.assets, seed=request.seed)
    judged: dict[str, list[Judged]] = {name: [] for name in names}
    seconds: dict[str, float] = {}
    with trained(names, dealt, None, watched=watched) as believers:
        for name in names:
            for fold, weights in enumerate(believers.weights[name]):
                chosen, tested = estimator(weights, origin=NameOrigin.USER), dealt.fold(fold)
                judged[name] += judge(chosen, tested, seen_share=request.seen_share, seed=request.seed + fold)
                seconds[name] = belief_seconds(chosen, tested)
    identities = {name: f"{name}, {folds.count} folds" for name in names}
    report = report_of(request, judged, identities, seconds, houses=len(dealt.own.houses))
    report.answer.update({"split": folds.split, "also": [str(p) for p in folds.also]})
    return report
