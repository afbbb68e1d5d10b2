"""Training: tiny models learn a learnable pattern in seconds, and the same seed gives the same weights."""

from __future__ import annotations

import gzip
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from learnable import learnable_houses

from workbench.beliefs.encoder import text_encoder
from workbench.beliefs.estimators import ESTIMATORS
from workbench.beliefs.examples import Examples, collect, house_weight
from workbench.beliefs.fcnn import FcnnEstimator, fcnn_from
from workbench.beliefs.placements import placements_settings
from workbench.beliefs.training.best import train_best
from workbench.beliefs.training.boosting import Boosting, Rows, boost, cross_entropy
from workbench.beliefs.training.train import TRAINERS, TrainingSet, hold_out, houses_sha256, train
from workbench.beliefs.weights import VERSION, Header, read_weights, write_weights
from workbench.cli import run
from workbench.errors import BadValue, UnknownName
from workbench.evaluation.beliefs.metrics import evaluate_estimator, metrics_of
from workbench.worlds.shipped import shipped_houses

if TYPE_CHECKING:
    import torch

    from workbench.beliefs.training.fcnn import Fcnn, TrainingSettings


FEW_TREES = Boosting(trees=40, rate=0.2, columns=1.0, depth=3)


@pytest.fixture(autouse=True)
def _one_thread() -> None:
    import torch  # Seconds, and only the worker that has these tests needs it.

    torch.set_num_threads(1)


def short() -> TrainingSettings:
    from workbench.beliefs.training.fcnn import TrainingSettings

    return TrainingSettings(hidden=(64, 16), epochs=80, patience=80, batch=8, rate=1e-2, dropout=0.0)


def figures_of(estimator: object, houses: list) -> dict[str, float]:
    return metrics_of(evaluate_estimator(estimator, houses), rng=np.random.default_rng(0))  # type: ignore[arg-type]


def prior_loss(houses: list) -> float:
    """Log loss of saying everywhere how often any container holds any item: by hand, 1 in 6."""
    p = 1 / 6
    return -(p * np.log(p) + (1 - p) * np.log(1 - p))


def test_examples_by_hand() -> None:
    houses = learnable_houses(1)
    examples = collect(houses)
    assert examples.items == ("Book", "Egg", "Fork", "Laptop", "Mug", "Pillow")
    assert examples.containers == ("Bed", "Chair", "CounterTop", "Desk", "Fridge")
    assert examples.rows == 6 * 6
    assert examples.held.sum() == 6
    assert len(examples.triples) == 5 * 6
    doubled = collect(houses * 2, weights=[1.0, 0.5])
    assert doubled.rows == pytest.approx(1.5 * 36)
    assert house_weight(houses[0], single_room=0.1) == 1.0


def test_examples_refuse_what_does_not_fit() -> None:
    names = {"rooms": ("a",), "containers": ("b",), "items": ("c",)}
    one, two = np.ones(1), np.full(1, 2.0)
    with pytest.raises(BadValue, match="at most seen"):
        Examples(**names, triples=np.zeros((1, 3), np.int64), seen=one, held=two)
    with pytest.raises(BadValue, match="shapes"):
        Examples(**names, triples=np.zeros((1, 3), np.int64), seen=np.ones(2), held=one)
    with pytest.raises(BadValue, match="index"):
        Examples(**names, triples=np.ones((1, 3), np.int64), seen=one, held=one)
    with pytest.raises(BadValue, match="holds an item"):
        collect([])


def test_counts_learn_and_beat_the_prior(tmp_path: Path) -> None:
    lesson = TrainingSet(houses=learnable_houses(20), held_out=learnable_houses(4, first=100), encoder=text_encoder())
    weights = train("counts", lesson, tmp_path / "c.safetensors")
    tested = learnable_houses(20, first=200)
    made = figures_of(ESTIMATORS["counts"](weights), tested)
    assert made["log_loss"] < 0.8 * prior_loss(tested)
    assert made["top1"] > 0.55


def test_a_tiny_network_beats_the_prior_and_numpy_agrees_with_torch(tmp_path: Path) -> None:
    houses, held_out = learnable_houses(30), learnable_houses(6, first=100)
    examples, out = collect(houses), collect(held_out)
    from workbench.beliefs.training.fcnn import train_fcnn

    tensors = train_fcnn(examples, out, text_encoder(), seed=1, recipe=short())
    again = train_fcnn(examples, out, text_encoder(), seed=1, recipe=short())
    assert all(np.array_equal(tensors[k], again[k]) for k in tensors)
    header = Header(
        estimator="fcnn",
        version=VERSION,
        encoder=text_encoder().name,
        houses_sha256="",
        houses=1,
        seed=1,
        metrics={},
        settings={},
    )
    estimator = fcnn_from(write_weights(tmp_path / "f.safetensors", header, tensors))
    made = figures_of(estimator, learnable_houses(20, first=200))
    assert made["log_loss"] < 0.9 * prior_loss(houses)
    assert np.abs(_by_torch(tensors, examples) - _by_numpy(estimator, examples)).max() < 1e-5


@pytest.mark.ci
def test_best_learns_what_names_do_not_say(tmp_path: Path) -> None:
    """The larger of two counters holds the mug: names cannot know, sizes can."""
    houses, held_out = learnable_houses(60), learnable_houses(12, first=100)
    lesson = TrainingSet(houses=houses, held_out=held_out, encoder=text_encoder(), seed=2)
    placements, tensors = train_best(houses, held_out, text_encoder(), seed=2, how=FEW_TREES)
    header = Header(
        estimator="best",
        version=VERSION,
        encoder=lesson.encoder.name,
        houses_sha256="",
        houses=1,
        seed=2,
        metrics={},
        settings={**placements_settings(placements)},
    )
    best = ESTIMATORS["best"](write_weights(tmp_path / "b.safetensors", header, tensors))
    counts = ESTIMATORS["counts"](train("counts", lesson, tmp_path / "c.safetensors"))
    tested = learnable_houses(30, first=200)
    ours, theirs = figures_of(best, tested), figures_of(counts, tested)
    assert ours["top1"] > theirs["top1"] + 0.1
    assert ours["log_loss"] < 0.85 * theirs["log_loss"]


def test_the_header_says_how_it_was_made(tmp_path: Path) -> None:
    lesson = TrainingSet(
        houses=learnable_houses(3), held_out=learnable_houses(1, first=9), encoder=text_encoder(), seed=5
    )
    weights = train("counts", lesson, tmp_path / "c.safetensors")
    header = read_weights(weights.path).header
    assert (header.estimator, header.houses, header.seed) == ("counts", 3, 5)
    assert header.houses_sha256 == houses_sha256(lesson.houses) != houses_sha256(lesson.held_out)
    assert set(TRAINERS) == set(ESTIMATORS) - {"people", "mixed"}, "these go by votes, not by houses"
    with pytest.raises(UnknownName, match="fcnn"):
        train("fccn", lesson, tmp_path / "x.safetensors")


def test_houses_are_held_out_whole_and_by_seed() -> None:
    houses = learnable_houses(10)
    train_part, out = hold_out(houses, share=0.2, rng=np.random.default_rng(3))
    assert len(out) == 2
    assert {h.plan.name for h in train_part} | {h.plan.name for h in out} == {h.plan.name for h in houses}
    assert [h.plan.name for h in hold_out(houses, share=0.2, rng=np.random.default_rng(3))[1]] == [
        h.plan.name for h in out
    ]
    with pytest.raises(BadValue, match="at least 2"):
        hold_out(houses[:1], share=0.5, rng=np.random.default_rng(0))
    with pytest.raises(BadValue, match="at least one of each"):
        TrainingSet(houses=houses, held_out=[], encoder=text_encoder())


def test_boosting_fits_a_step_and_keeps_only_trees_that_help() -> None:
    """held = x > 0.5: one split says all; noise in the second feature is never worth a leaf."""
    rng = np.random.default_rng(0)
    x = rng.random((400, 2))
    rows = Rows(
        features=x.T,
        start=np.zeros(400),
        held=(x[:, 0] > 0.5).astype(float),
        weight=np.ones(400),
        query=np.repeat(np.arange(40), 10),
    )
    trees = boost(rows, rows, rng=rng, how=Boosting(trees=30, rate=0.3, columns=1.0, ranking=0.0))
    score = trees.total(x.T)
    assert cross_entropy(score, rows) < 0.1
    assert ((score > 0) == (x[:, 0] > 0.5)).mean() > 0.98
    again = boost(
        rows,
        rows,
        rng=np.random.default_rng(0),
        how=Boosting(trees=30, rate=0.3, columns=1.0, ranking=0.0),
    )
    assert np.array_equal(again.value, trees.value)


def _by_torch(tensors: dict[str, np.ndarray], examples: Examples) -> np.ndarray:
    """The trained tensors run by torch itself, on plain concatenated inputs: the definition of the network."""
    import torch

    from workbench.beliefs.training.fcnn import Fcnn, _blocks

    blocks = _blocks((examples.rooms, examples.containers, examples.items), text_encoder())
    net = Fcnn(blocks, short()).eval()
    with torch.no_grad():
        for k, layer in enumerate(net.linear):
            layer.weight.copy_(torch.from_numpy(tensors[f"{k}.weight"].astype(np.float32)))
            layer.bias.copy_(torch.from_numpy(tensors[f"{k}.bias"].astype(np.float32)))
        hidden = torch.cat([block[examples.triples[:, k]] for k, block in enumerate(blocks)], dim=1)
        for k, layer in enumerate(net.linear):
            hidden = layer(torch.relu(hidden) if k else hidden)
        direct = torch.sigmoid(hidden[:, 0]).numpy()
        shared = torch.sigmoid(net(torch.from_numpy(examples.triples))).numpy()
    assert np.abs(direct - shared).max() < 1e-5
    return direct


def _by_numpy(estimator: FcnnEstimator, examples: Examples) -> np.ndarray:
    places = [(examples.rooms[r], examples.containers[c]) for r, c, _ in examples.triples]
    table = estimator.probabilities(places, examples.items)
    return table[examples.triples[:, 2], np.arange(len(places))]


def test_a_gpu_is_used_when_there_is_one(monkeypatch: pytest.MonkeyPatch) -> None:
    import torch

    from workbench.beliefs.training.fcnn import chosen_device

    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    assert chosen_device() == "cuda"
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    assert chosen_device() == "cpu"


@pytest.mark.ci
def test_the_network_is_trained_on_the_device_that_was_chosen(monkeypatch: pytest.MonkeyPatch) -> None:
    """The "meta" device holds no numbers: what stays elsewhere by mistake cannot be combined with it."""
    from workbench.beliefs.training import fcnn

    examples = collect(learnable_houses(2))
    devices: list[torch.device] = []

    def watch(net: Fcnn, *rows: torch.Tensor) -> torch.Tensor:
        tensors = (*net.parameters(), *net.blocks, *rows)
        devices.extend(t.device for t in tensors)
        raise Stopped

    monkeypatch.setattr(fcnn, "chosen_device", lambda: "meta")
    monkeypatch.setattr(fcnn, "_loss", watch)
    monkeypatch.setattr(fcnn, "_tensors", lambda _: {})
    with pytest.raises(Stopped):
        fcnn.train_fcnn(examples, examples, text_encoder(), seed=0, recipe=short())
    assert {d.type for d in devices} == {"meta"}


class Stopped(Exception):
    """Raised by a test to end a training."""


@pytest.mark.parametrize("name", ["counts", *(pytest.param(n, marks=pytest.mark.slow) for n in ("fcnn", "best"))])
def test_the_command_run_twice_writes_the_same_bytes(name: str, tmp_path: Path) -> None:
    few = tmp_path / "houses.jsonl"
    with gzip.open(shipped_houses(), "rt") as lines:
        few.write_text("".join(line for line, _ in zip(lines, range(3), strict=False)))
    made = [tmp_path / f"{k}.safetensors" for k in range(2)]
    for path in made:
        assert run(["train", "--houses", str(few), "-e", name, "--seed", "7", "-o", str(path), "--json"]) == 0
    assert made[0].read_bytes() == made[1].read_bytes()
    assert read_weights(made[0]).header.seed == 7


def test_weights_have_the_name_by_which_estimators_are_known(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["train", "--houses", str(shipped_houses()), "-e", "counts", "-o", str(tmp_path / "w.txt")]) == 2
    assert "a name that ends in .safetensors" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_too_few_houses_are_refused_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with gzip.open(shipped_houses()) as houses:
        (tmp_path / "two.jsonl").write_bytes(next(houses) + next(houses))
    out = tmp_path / "best.safetensors"
    assert run(["train", "-e", "best", "--houses", str(tmp_path / "two.jsonl"), "--seed", "0", "-o", str(out)]) == 2
    assert "Give more houses" in capsys.readouterr().err.splitlines()[-1]
    assert not out.exists()
