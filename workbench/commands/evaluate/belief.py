"""`lios evaluate belief`: log loss, ranking and calibration of estimators, with intervals over houses."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from workbench.options import AlsoLearnt, AssetsOrBeside, FoldCount, Json, Split
from workbench.parameters import Option
from workbench.worlds.shipped import house_file

if TYPE_CHECKING:
    from workbench.evaluation.beliefs.report import BeliefReport, BeliefRequest


def belief(
    houses: Annotated[
        list[Path] | None,
        Option(
            "--houses",
            help="Houses (.jsonl.gz, .jsonl, .json); repeat for several; default: the shipped ones.",
            file=house_file,
        ),
    ] = None,
    estimators: Annotated[
        str, Option("--estimators", "-e", help="all, or names and weights files separated by commas.")
    ] = "all",
    part: Split = "test",
    folds: FoldCount = None,
    also: AlsoLearnt = None,
    seen: Annotated[float, Option("--seen", help="Share of containers searched before the query.")] = 0.0,
    assets: AssetsOrBeside = None,
    figures: Annotated[
        Path | None,
        Option("--figures", help="A folder for reliability diagrams, a learning curve and heat maps."),
    ] = None,
    items: Annotated[
        str, Option("--items", help="Item types of the heat maps, separated by commas.")
    ] = "Mug,Egg,Pillow,RemoteControl,ToiletPaper,Book",
    seed: Annotated[int, Option("--seed", help="Seed of the searched containers and of the bootstrap.")] = 0,
    force: Annotated[bool, Option("--force", help="Replace files in the folder of figures.")] = False,
    json: Json = False,
) -> None:
    """Measure beliefs: log loss, top-1, top-3, reciprocal rank and calibration.

    Every pair of a house and an item type that it holds is one query. Intervals are over houses.

    Examples:

        lios evaluate belief --houses multi_room_train.jsonl.gz --estimators all --json

        lios evaluate belief --houses mine.jsonl.gz --folds 5 --estimators counts,fcnn

        lios evaluate belief --houses mine.jsonl.gz --estimators best,mine.safetensors --seen 0.3 --figures out
    """
    from workbench.errors import BadValue
    from workbench.evaluation.beliefs.fold_weights import folds_from_options
    from workbench.evaluation.beliefs.report import BeliefRequest, measure
    from workbench.terminal import emit_json, progress, say

    names = tuple(name.strip() for name in estimators.split(",") if name.strip())
    if not names:
        raise BadValue("--estimators", estimators, "all, or names with commas between them")
    fold_split = folds_from_options(folds, also)
    if fold_split is not None and figures is not None:
        raise BadValue("--figures", str(figures), "without --folds: figures are of one estimator, not of one a fold")
    _check_folder(figures, force=force)
    request = BeliefRequest(
        houses=tuple(houses or ()),
        estimators=names,
        part=part,
        seen_share=seen,
        assets=assets,
        seed=seed,
    )
    if fold_split is None:
        report = measure(request, progress=lambda names: progress(list(names), title="Believing"))
    else:
        from workbench.evaluation.beliefs.cross_validation import cross_validate

        report = cross_validate(
            request, fold_split, progress=lambda them, total: progress(them, title="Training", total=total)
        )
    if figures is not None:
        report.answer["figures"] = _draw(request, report, figures, items)
    emit_json(report.answer) if json else _show(report.answer)
    if figures is not None and not json:
        say(f"figures in {figures}")


def _draw(request: BeliefRequest, report: BeliefReport, folder: Path, items: str) -> list[str]:
    """Draw the figures, with heat maps of the given item types; returns the files written."""
    from workbench.evaluation.figures.belief_figures import draw_all
    from workbench.terminal import progress

    wanted = tuple(t.strip() for t in items.split(",") if t.strip())
    written = draw_all(
        request,
        report,
        folder,
        items=wanted,
        progress=lambda trainings: progress(list(trainings), title="Learning curve"),
    )
    return [str(path) for path in written]


def _check_folder(figures: Path | None, *, force: bool) -> None:
    from workbench.errors import BadValue, OutputExists

    if figures is None or not figures.exists():
        return
    if not figures.is_dir():
        raise BadValue("--figures", str(figures), "a folder")
    if not force and any(figures.iterdir()):
        raise OutputExists(figures)


SHOWN = ("estimator", "log_loss", "top1", "top3", "mrr", "ece", "ms_a_belief")


def _show(answer: dict[str, Any]) -> None:
    from workbench.evaluation.statistics import ends_in_words, intervals_in_words
    from workbench.terminal import emit_table, say

    seen = f", {100 * answer['seen_share']:.0f} % of the containers seen" if answer["seen_share"] else ""
    rows = [
        {k: f"{row[k]:.4f}" if k in SHOWN[1:6] and k in row else row.get(k) for k in SHOWN} for row in answer["rows"]
    ]
    emit_table(rows, columns=SHOWN, title=f"{answer['houses']} houses ({answer['split']}{seen})")
    for row in answer["rows"]:
        if "against_counts" not in row:
            continue
        pair = row["against_counts"]
        gained = ends_in_words(pair["top1_gain_ci95"], "+.3f")
        say(
            f"{row['estimator']}: top-1 {pair['top1_gain']:+.3f} against counts ({gained}), "
            f"log loss {pair['log_loss_ratio']:.3f} of it"
        )
    if words := intervals_in_words(row.get("ci95_resamples", "") for row in answer["rows"]):
        say(words)
