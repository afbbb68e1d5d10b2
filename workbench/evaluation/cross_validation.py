"""How good is an estimator on more houses than those held out? Each house judged by what never learnt from it.

Twenty houses tell top-1 to two points. The houses to learn from are four times as many: dealt into folds, each fold
is judged by estimators that were trained anew on the other folds. Files of houses that are learnt from only (those of
a single room) belong to every training.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from workbench.beliefs.estimators import estimator
from workbench.beliefs.training import TRAINERS, Lesson, train
from workbench.errors import BadValue, UnknownName
from workbench.evaluation.belief_quality import Judged, judge
from workbench.evaluation.belief_report import BeliefReport, BeliefRequest, belief_seconds, report_of
from workbench.evaluation.lessons import lesson_of
from workbench.worlds.house import House
from workbench.worlds.shipped import shipped_houses

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
    for name in names:
        if name not in TRAINERS:
            raise UnknownName("estimator to train", name, TRAINERS)
    path = request.houses or shipped_houses()
    own, also = _lesson((path,), request), _lesson(folds.also, request) if folds.also else None
    if len(own.houses) < folds.count:
        raise BadValue("--folds", folds.count, f"at most {len(own.houses)}, the number of houses to learn from")
    _require_others(own, also)
    judged: dict[str, dict[int, list[Judged]]] = {name: {} for name in names}
    seconds: dict[str, float] = {}
    with TemporaryDirectory() as temporary:
        for name, fold in watched([(name, fold) for name in names for fold in range(folds.count)]):
            weights = train(
                name, _without(own, also, fold, folds.count), Path(temporary) / f"{name}-{fold}.safetensors"
            )
            trained, tested = estimator(name, weights=weights.path), own.houses[fold :: folds.count]
            judged[name][fold] = judge(trained, tested, seen_share=request.seen_share, seed=request.seed + fold)
            seconds[name] = belief_seconds(trained, tested)
    flat = {
        name: [query for fold in range(folds.count) for query in by_fold[fold]] for name, by_fold in judged.items()
    }
    identities = {name: f"{name}, {folds.count} folds" for name in names}
    report = report_of(request, flat, identities, seconds, houses=len(own.houses))
    report.answer.update({"split": f"train, {folds.count} folds", "also": [str(p) for p in folds.also]})
    return report


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


def _lesson(files: Sequence[Path], request: BeliefRequest) -> Lesson:
    return lesson_of(files, assets=request.assets, encoder=ENCODER, seed=request.seed, share=HELD_OUT)


def _without(own: Lesson, also: Lesson | None, fold: int, count: int) -> Lesson:
    """All that is learnt from but the houses of a fold: every count-th one."""
    kept = [k for k in range(len(own.houses)) if k % count != fold]
    parts = [own] if also is None else [own, also]
    usual = [part.usual_sizes or part.houses for part in parts]
    exact = any(part.usual_sizes is not None for part in parts)
    others, others_usual = (also.houses, usual[1]) if also is not None else ((), ())
    return Lesson(
        houses=[*(own.houses[k] for k in kept), *others],
        held_out=[house for part in parts for house in part.held_out],
        encoder=own.encoder,
        seed=own.seed,
        usual_sizes=[*(usual[0][k] for k in kept), *others_usual] if exact else None,
    )
