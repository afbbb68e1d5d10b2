"""The figures of belief evaluations: reliability diagrams, a learning curve, heat maps."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from matplotlib.figure import Figure

from workbench.beliefs.belief import Estimator
from workbench.beliefs.encoder import text_encoder
from workbench.beliefs.estimators import estimator
from workbench.beliefs.examples import room_kinds
from workbench.beliefs.training.train import TRAINERS, TrainingSet, train
from workbench.evaluation.beliefs.metrics import (
    calibration_error,
    evaluate_estimator,
    metrics_of,
    partial_knowledge,
    reliability,
)
from workbench.evaluation.beliefs.report import BeliefReport, BeliefRequest
from workbench.evaluation.figures.belief_heat_map import draw_belief_heat_map
from workbench.evaluation.figures.learning_curve import draw_learning_curve
from workbench.evaluation.figures.reliability import draw_reliability
from workbench.evaluation.figures.style import BLUE, GREY, ORANGE, VERMILION, save
from workbench.evaluation.splits import Split, is_shared, split_indices
from workbench.worlds.house import House, ItemType
from workbench.worlds.names import readable_name
from workbench.worlds.procthor.load import load_houses

COLOURS = {"counts": GREY, "fcnn": ORANGE, "best": BLUE}
MIN_HOUSES = 5
COMMON_CONTAINERS = 12

Training = tuple[int, str]
"""A point of the learning curve: number of houses and estimator."""

Progress = Callable[[Iterable[Training]], Iterable[Training]]


def draw_all(
    request: BeliefRequest, report: BeliefReport, folder: Path, *, items: Sequence[str], progress: Progress = iter
) -> list[Path]:
    """Draw every figure of a report as PNG files into a folder, created if needed.

    Args:
        items: item types for heat maps.
        progress: wraps the trainings of the learning curve, for a progress bar.
    """
    folder.mkdir(parents=True, exist_ok=True)
    chosen = request.chosen_estimators()
    last = list(chosen)[-1]
    drawn = [_reliability(report, folder)]
    drawn.append(_heat_maps(chosen[last], last, request.chosen_houses(), [ItemType(t) for t in items], folder))
    curve = _curve(request, [n for n in chosen if n in TRAINERS], folder, progress)
    return drawn if curve is None else [*drawn, curve]


def _reliability(report: BeliefReport, folder: Path) -> Path:
    count = len(report.judged)
    figure = Figure(figsize=(3.2 * count, 3.4), layout="constrained")
    for ax, (name, judged) in zip(figure.subplots(1, count, squeeze=False)[0], report.judged.items(), strict=True):
        colour = COLOURS.get(name, VERMILION)
        shown = Path(name).stem
        draw_reliability(ax, reliability(judged), name=shown, ece=calibration_error(judged), colour=colour)
    return save(figure, folder / "reliability.png")


def _heat_maps(
    chosen: Estimator, name: str, houses: Sequence[House], items: Sequence[ItemType], folder: Path
) -> Path:
    kinds = sorted({kind for house in houses for kind in room_kinds(house.plan)})
    types = [c.type for house in houses for c in house.plan.containers]
    common = sorted(sorted(set(types)), key=lambda t: -types.count(t))[:COMMON_CONTAINERS]
    total, count = np.zeros((len(items), len(kinds), len(common))), np.zeros((len(kinds), len(common)))
    for house in houses:
        belief = chosen.believe(partial_knowledge(house, seen_share=0.0, rng=np.random.default_rng(0)), tuple(items))
        for k, (kind, container) in enumerate(zip(room_kinds(house.plan), house.plan.containers, strict=True)):
            if container.type in common:
                at = (kinds.index(kind), common.index(container.type))
                count[at] += 1
                total[(slice(None), *at)] += belief.probability[:, k]
    mean = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    rows = -(-len(items) // 2)
    figure = Figure(figsize=(9, 2.3 * rows), layout="constrained")
    axes = figure.subplots(rows, 2, squeeze=False).ravel()
    for ax, item, grid in zip(axes, items, mean, strict=False):
        shown = [readable_name(t) for t in common]
        draw_belief_heat_map(
            ax, grid, rooms=[readable_name(k) for k in kinds], containers=shown, item=readable_name(item)
        )
    for ax in axes[len(items) :]:
        ax.set_axis_off()
    figure.suptitle(f"{Path(name).stem}: mean probability by room and container", fontsize=10)
    return save(figure, folder / "heat_maps.png")


def _curve(request: BeliefRequest, names: Sequence[str], folder: Path, progress: Progress) -> Path | None:
    """The learning curve, trained on 5, 10, 20, ... houses apart from the evaluated ones; None if there are too
    few."""
    pool, held_out, measured = _curve_houses(request)
    sizes = sorted({n for n in (5, 10, 20, 40, 80, 160, 320) if n <= 0.75 * len(pool)} | {len(pool)})
    if len(sizes) < 2 or not held_out or not measured or not names:
        return None
    order = np.random.default_rng(request.seed).permutation(len(pool))
    lines: dict[str, dict[str, list[float]]] = {what: {name: [] for name in names} for what in ("log_loss", "top1")}
    with TemporaryDirectory() as temporary:
        for size, name in progress([(size, name) for name in names for size in sizes]):
            training_set = TrainingSet(
                houses=[pool[k] for k in order[:size]], held_out=held_out, encoder=text_encoder(), seed=request.seed
            )
            path = Path(temporary) / f"{name}-{size}.safetensors"
            train(name, training_set, path)
            made = metrics_of(
                evaluate_estimator(estimator(name, weights=path), measured), rng=np.random.default_rng(0)
            )
            for what in lines:
                lines[what][name].append(made[what])
    figure = Figure(figsize=(7, 3), layout="constrained")
    for ax, (what, by_name) in zip(figure.subplots(1, 2), lines.items(), strict=True):
        draw_learning_curve(ax, sizes, by_name, colours=COLOURS, label=what.replace("_", " "))
    return save(figure, folder / "learning_curve.png")


def _curve_houses(request: BeliefRequest) -> tuple[list[House], list[House], list[House]]:
    """Disjoint houses for training, early stopping and evaluation."""
    path = request.files[0]
    houses = load_houses(path, assets=request.sizes)
    n = len(houses)
    if is_shared(path):
        parts = [split_indices(path, part, houses=n) for part in (Split.TRAIN, Split.VALIDATION)]
        measured = request.chosen_houses() if request.part in ("validation", "test") else []
        if request.part == "validation":
            parts = [parts[0][: -MIN_HOUSES * 2], parts[0][-MIN_HOUSES * 2 :]]
        return [houses[k] for k in parts[0]], [houses[k] for k in parts[1]], measured
    cut, out = round(0.6 * n), round(0.8 * n)
    return houses[:cut], houses[cut:out], houses[out:]
