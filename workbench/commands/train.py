"""`lios train`: trains an estimator on houses and writes its weights."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from workbench.options import AlsoLearnt, AssetsOrBeside, Force, Json, Scheduler, Workers
from workbench.parameters import Option
from workbench.worlds.shipped import house_file

if TYPE_CHECKING:
    from workbench.beliefs.training.train import TrainingListener, TrainingSet
    from workbench.evaluation.beliefs.fold_weights import Folds
    from workbench.evaluation.cluster import Workforce


PEOPLE = "people"
"""The estimator that is made from votes instead of houses."""
ENCODER = "encoder"
"""The name that writes vectors of names, like the shipped ones, instead of training an estimator."""


def train(
    houses: Annotated[
        list[Path] | None,
        Option("--houses", help="Houses (.jsonl.gz, .jsonl); repeat for several.", file=house_file),
    ] = None,
    estimator: Annotated[
        str, Option("--estimator", "-e", help="counts, fcnn, best; people, of votes; encoder, for vectors of names.")
    ] = "best",
    votes: Annotated[
        Path | None,
        Option("--votes", help="For people: a table of votes (CSV) with object, room, receptacle and three counts."),
    ] = None,
    output: Annotated[
        Path | None,
        Option(
            "--output",
            "-o",
            help="The weights file to write; default: ESTIMATOR.safetensors. With --folds a folder, ESTIMATOR-folds.",
        ),
    ] = None,
    encoder: Annotated[
        str, Option("--encoder", help="Text encoder: a sentence-transformers model by name or folder.")
    ] = "all-MiniLM-L6-v2",
    assets: AssetsOrBeside = None,
    seed: Annotated[int | None, Option("--seed", help="Seed; random and shown if not given.")] = None,
    hold_out: Annotated[
        float, Option("--hold-out", help="Share of houses held out, for files without splits.")
    ] = 0.1,
    folds: Annotated[
        int | None,
        Option("--folds", help="Train once for each fold, without its houses, for evaluations with --folds."),
    ] = None,
    also: AlsoLearnt = None,
    workers: Workers = 1,
    scheduler: Scheduler = "",
    force: Force = False,
    json: Json = False,
) -> None:
    """Train an estimator on houses and write its weights.

    The shared ProcTHOR files are split: their training houses are used for training, their validation houses decide
    when to stop, and their test houses are not used. Of other files, a share of the houses is held out.

    Examples:

        lios train --houses multi_room_train.jsonl.gz --houses single_room_train.jsonl.gz --assets asset_sizes.csv

        lios train --houses mine.jsonl.gz --estimator fcnn --seed 3 -o mine.safetensors

        lios train --houses mine.jsonl.gz --estimator encoder -o vectors.safetensors

        lios train --houses mine.jsonl.gz --folds 5 --scheduler tcp://10.0.0.1:8786 -o folds

        lios train --estimator people --votes housekeep_placement.csv.gz -o people.safetensors
    """
    from secrets import randbelow
    from time import perf_counter

    from workbench.beliefs.training.train import TRAINERS
    from workbench.beliefs.training.train import train as run
    from workbench.errors import BadValue, OutputExists, UnknownName
    from workbench.evaluation.beliefs.fold_weights import folds_from_options
    from workbench.evaluation.beliefs.training_sets import training_set_of
    from workbench.evaluation.cluster import Workforce
    from workbench.terminal import say

    if folds is not None or also:
        wanted = folds_from_options(folds, also)
        made = _train_folds(
            houses or [], estimator, wanted, output, (assets, seed), Workforce(workers, scheduler), force
        )
        _answer_folds(made, as_json=json)
        return
    if scheduler:
        raise BadValue("--scheduler", scheduler, "given with --folds; one training runs in one process")
    target = output or Path(f"{estimator}.safetensors")
    if estimator not in (*TRAINERS, ENCODER, PEOPLE):
        raise UnknownName("estimator to train", estimator, (*TRAINERS, PEOPLE, ENCODER))
    if (votes is not None) != (estimator == PEOPLE) or bool(houses) == (estimator == PEOPLE):
        needed = "given, and --houses not" if estimator == PEOPLE else "left out, and --houses given"
        raise BadValue(f"--votes for {estimator}", None if votes is None else str(votes), needed)
    if not 0 < hold_out < 1:
        raise BadValue("--hold-out", hold_out, "between 0 and 1")
    if seed is not None and seed >= 2**63:
        raise BadValue("--seed", seed, "below 2^63")
    if target.suffix != ".safetensors":  # by which --estimator knows a weights file
        raise BadValue("-o/--output", str(target), "a name that ends in .safetensors")
    if target.exists() and not force:
        raise OutputExists(target)
    if not target.absolute().parent.is_dir():
        raise BadValue("folder of -o/--output", target.absolute().parent, "a folder that exists")
    if votes is not None:
        _count_votes(votes, encoder, target, as_json=json)
        return
    assert houses, "checked with the votes"
    if estimator == ENCODER:
        _encode(houses, encoder, target, as_json=json)
        return
    chosen = randbelow(1_000_000) if seed is None else seed
    training_set = training_set_of(houses, assets=assets, encoder=encoder, seed=chosen, share=hold_out)
    say(f"{len(training_set.houses)} houses to learn from, {len(training_set.held_out)} held out, seed {chosen}")
    begin = perf_counter()
    weights = _watched(run, estimator, training_set, target)
    _answer(weights, perf_counter() - begin, as_json=json)


def _train_folds(
    houses: list[Path],
    estimator: str,
    folds: Folds | None,
    output: Path | None,
    setting: tuple[Path | None, int | None],
    on: Workforce,
    force: bool,
) -> tuple[str, ...]:
    """Train for each fold; what an earlier call has made of the same houses is kept.

    Args:
        setting: the asset table and the seed, which is 0 by default as that of evaluations.
    """
    from workbench.errors import BadValue
    from workbench.evaluation.beliefs.fold_training import train_folds
    from workbench.evaluation.beliefs.fold_weights import make_folds, require_trainable
    from workbench.terminal import progress, say

    assets, seed = setting
    require_trainable([estimator])
    if folds is None or len(houses) != 1:
        given = " ".join(map(str, houses)) or None
        raise BadValue("--houses", given, "one file with --folds; give further training houses with --also")
    fold_split = make_folds(houses[0], folds, assets=assets, seed=seed or 0)
    folder = output or Path(f"{estimator}-folds")
    say(f"{len(fold_split.own.houses)} houses in {folds.count} folds, seed {seed or 0}")
    made = train_folds(
        [estimator],
        fold_split,
        folder,
        progress=lambda trained, total: progress(trained, title="Training", total=total),
        on=on,
        anew=force,
    )
    return made.weights[estimator]


def _answer_folds(files: tuple[str, ...], *, as_json: bool) -> None:
    from workbench.terminal import emit_json, say

    if as_json:
        emit_json({"files": list(files)})
        return
    say(f"{len(files)} weights: {files[0]} and so on")


def _count_votes(votes: Path, encoder: str, target: Path, *, as_json: bool) -> None:
    """Write the weights of the estimator that goes by people's votes."""
    from time import perf_counter

    from workbench.beliefs.encoder import text_encoder
    from workbench.beliefs.people.votes import write_votes

    begin = perf_counter()
    weights = write_votes(votes, target, text_encoder(encoder))
    _answer(weights, perf_counter() - begin, as_json=as_json)


def _encode(houses: list[Path], encoder: str, target: Path, *, as_json: bool) -> None:
    """Write the vectors of all names in the houses and of the vocabulary."""
    from workbench.beliefs.encoder import live_encoder, names_to_ship, write_vectors
    from workbench.evaluation.beliefs.training_sets import names_in
    from workbench.terminal import emit_json, say

    vectors = write_vectors(target, (*names_to_ship(), *names_in(houses)), live_encoder(encoder))
    size = target.stat().st_size
    if as_json:
        emit_json({"file": str(target), "encoder": vectors.name, "names": len(vectors.table), "bytes": size})
        return
    say(f"vectors of {len(vectors.table)} names by {vectors.name} in {target} ({size / 1e6:.2f} MB)")


def _watched(run: Any, estimator: str, training_set: TrainingSet, target: Path) -> Any:
    """Train, with a progress line on a terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), TextColumn("{task.fields[loss]}"))
    console = Console(stderr=True)
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        tasks: dict[str, Any] = {}

        def show(what: str, number: int, loss: float) -> None:
            if what not in tasks:
                tasks[what] = bar.add_task(what, total=None, loss="")
            bar.update(tasks[what], completed=number, loss=f"held-out loss {loss:.4f}")

        watch: TrainingListener = show
        return run(estimator, training_set, target, watch=watch)


def _answer(weights: Any, seconds: float, *, as_json: bool) -> None:
    from workbench.terminal import emit_json, say

    size = weights.path.stat().st_size
    if as_json:
        header = weights.header
        answer = {"file": str(weights.path), "estimator": weights.name, "sha256": weights.sha256, "bytes": size}
        answer |= {"houses": header.houses, "houses_sha256": header.houses_sha256, "encoder": header.encoder}
        emit_json(answer | {"seed": header.seed, "metrics": header.metrics, "seconds": round(seconds, 2)})
        return
    losses = ", ".join(f"{what} {loss:.4f}" for what, loss in weights.header.metrics.items())
    say(f"{weights.name} in {weights.path} ({size / 1e6:.2f} MB), {seconds:.0f} s. {losses}")
    say(f"Next: lios evaluate belief --estimators {weights.path}")
