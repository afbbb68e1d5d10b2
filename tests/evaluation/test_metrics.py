"""Quality figures of beliefs, on cases worked out by hand, and the commands that print them."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from toy import BED, COUNTER, DESK, FRIDGE, toy_house

from workbench.beliefs.belief import Belief
from workbench.cli import run
from workbench.errors import UnknownName
from workbench.evaluation.beliefs.metrics import (
    calibration_error,
    compare_with_baseline,
    evaluate_estimator,
    metrics_of,
    missing_types,
    partial_knowledge,
    reliability,
)
from workbench.evaluation.splits import Split, effective_split, is_shared, split_indices, split_of
from workbench.worlds.house import ItemType
from workbench.worlds.knowledge import Knowledge


@dataclass(frozen=True)
class Says:
    """Gives every item the same probability in a container, by the container's id."""

    chances: dict[str, float]
    name: str = "says@0"

    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Belief:
        row = [self.chances.get(c, 0.0) for c in knowledge.unsearched]
        return Belief(
            item_types=item_types,
            containers=knowledge.unsearched,
            probability=np.tile(row, (len(item_types), 1)),
            estimator=self.name,
        )


def test_ranks_by_hand() -> None:
    """Order: fridge .9, counter .5, the rest 0. The mug is on the counter and the desk, the egg in the fridge."""
    judged = {j.item_type: j for j in evaluate_estimator(Says({FRIDGE: 0.9, COUNTER: 0.5}), [toy_house()])}
    egg, mug, pillow = judged["Egg"], judged["Mug"], judged["Pillow"]
    assert (egg.top1, egg.top3, egg.reciprocal_rank) == (1.0, 1.0, 1.0)
    assert (mug.top1, mug.top3, mug.reciprocal_rank) == (0.0, 1.0, 0.5)
    # The bed shares places 3, 4, 5 with two others.
    assert pillow.top1 == 0.0
    assert pillow.top3 == pytest.approx(1 / 3)
    assert pillow.reciprocal_rank == pytest.approx((1 / 3 + 1 / 4 + 1 / 5) / 3)


def test_equal_probabilities_are_ranked_by_chance() -> None:
    """Five containers alike: one holder is first one time in five; two holders two times in five."""
    judged = {j.item_type: j for j in evaluate_estimator(Says({}), [toy_house()])}
    assert judged["Egg"].top1 == pytest.approx(1 / 5)
    assert judged["Mug"].top1 == pytest.approx(2 / 5)
    assert judged["Egg"].top3 == pytest.approx(3 / 5)


def test_log_loss_and_calibration_by_hand() -> None:
    judged = evaluate_estimator(
        Says(dict.fromkeys((FRIDGE, COUNTER, BED, DESK, "DiningTable|1"), 0.25)), [toy_house()]
    )
    pairs = sum(len(j.held) for j in judged)
    holds = sum(int(j.held.sum()) for j in judged)
    made = metrics_of(judged, rng=np.random.default_rng(0))
    expected = -(holds * np.log(0.25) + (pairs - holds) * np.log(0.75)) / pairs
    assert made["log_loss"] == pytest.approx(expected, abs=1e-5)
    assert calibration_error(judged) == pytest.approx(abs(0.25 - holds / pairs))
    bins = reliability(judged)
    assert bins.count.sum() == pairs
    assert bins.said[3] == pytest.approx(0.25)
    low, high = made["ece_ci95"]
    assert low <= made["ece"] <= high


def test_a_sure_mistake_costs_much_but_not_everything() -> None:
    judged = evaluate_estimator(Says({FRIDGE: 1.0}), [toy_house()])
    assert np.isfinite(metrics_of(judged, rng=np.random.default_rng(0))["log_loss"])


def test_what_has_been_seen_is_not_asked() -> None:
    house = toy_house()
    knowledge = partial_knowledge(house, seen_share=0.5, rng=np.random.default_rng(1))
    assert len(knowledge.first_seen) == 2
    seen = {i.type for items in knowledge.first_seen.values() for i in items}
    assert set(missing_types(house, knowledge)) == set(house.item_types()) - seen
    assert len(partial_knowledge(house, seen_share=0.99, rng=np.random.default_rng(1)).unsearched) == 1


def test_better_is_better_than_the_base() -> None:
    house = toy_house()
    base = evaluate_estimator(Says({}), [house])
    same = compare_with_baseline(base, base, rng=np.random.default_rng(0))
    assert (same["top1_gain"], same["log_loss_ratio"]) == (0.0, 1.0)
    better = compare_with_baseline(
        evaluate_estimator(Says({FRIDGE: 0.3, COUNTER: 0.4}), [house]), base, rng=np.random.default_rng(0)
    )
    assert better["log_loss_ratio"] < 1


def test_the_split_keeps_houses_apart() -> None:
    for name, count in (("multi_room_train.jsonl.gz", 120), ("single_room_train.jsonl.gz", 500)):
        parts = [split_indices(f"/data/{name}", part, houses=count) for part in ("train", "validation", "test")]
        assert sorted(i for part in parts for i in part) == list(range(count))
        assert is_shared(Path(name))
    assert split_indices("mine.jsonl", Split.TEST, houses=3) == (0, 1, 2)
    assert (effective_split("mine.jsonl", "test"), effective_split("multi_room_train.jsonl.gz", "test")) == (
        "all",
        "test",
    )
    assert split_indices("multi_room_train.jsonl.gz", "validation", houses=85) == (80, 81, 82, 83, 84)
    with pytest.raises(UnknownName, match="validation"):
        split_of("valid")


@pytest.mark.ci
def test_the_command_on_the_shipped_houses(capfd: pytest.CaptureFixture[str]) -> None:
    assert run(["evaluate", "belief", "--estimators", "counts,best", "--seen", "0.3", "--json"]) == 0
    answer = json.loads(capfd.readouterr().out)
    rows = {row["estimator"]: row for row in answer["rows"]}
    assert set(rows) == {"counts", "best"}
    for row in rows.values():
        assert {"log_loss", "top1", "top3", "mrr", "ece", "by_kind", "name"} <= set(row)
        assert 0 <= row["top1"] <= row["top3"] <= 1
        low, high = row["top1_ci95"]
        assert low <= row["top1"] <= high
    assert "against_counts" in rows["best"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--estimators", "bset"], "Did you mean: best"),
        (["--estimators", "no.safetensors"], "no such file"),
        (["--houses", "no.jsonl"], "no such file"),
        (["--seen", "1.5"], "--seen is 1.5"),
        (["--split", "tset"], "Did you mean: test"),
    ],
)
def test_bad_usage_is_one_line(arguments: list[str], said: str, capfd: pytest.CaptureFixture[str]) -> None:
    assert run(["evaluate", "belief", *arguments]) == 2
    captured = capfd.readouterr()
    assert said in captured.err.replace("\n", " ")
    assert captured.out == ""


def test_training_by_the_command_and_judging_what_it_wrote(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    from workbench.worlds.shipped import shipped_houses

    weights = tmp_path / "mine.safetensors"
    wanted = ["train", "--houses", str(shipped_houses()), "-e", "counts", "--seed", "3", "-o", str(weights)]
    assert run([*wanted, "--json"]) == 0
    answer = json.loads(capfd.readouterr().out)
    assert answer["bytes"] == weights.stat().st_size
    assert answer["seed"] == 3
    first = weights.read_bytes()
    assert run(wanted) == 2
    assert "exists" in capfd.readouterr().err
    assert run([*wanted, "--force"]) == 0
    assert weights.read_bytes() == first
    assert run(["evaluate", "belief", "--estimators", str(weights), "--json"]) == 0
    assert json.loads(capfd.readouterr().out)["rows"][0]["name"] == answer["estimator"]


@pytest.mark.slow
def test_the_learning_curve_draws_every_estimator_that_is_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from workbench.evaluation.figures import belief_figures

    drawn: dict[str, dict[str, list[float]]] = {}

    def watch(ax: object, sizes: list[int], lines: dict[str, list[float]], *, label: str, **_: object) -> None:
        assert all(len(values) == len(sizes) >= 2 for values in lines.values())
        drawn[label] = lines

    monkeypatch.setattr(belief_figures, "draw_learning_curve", watch)
    assert run(["evaluate", "belief", "--estimators", "counts,best", "--figures", str(tmp_path / "out")]) == 0
    assert set(drawn) == {"log loss", "top1"}
    assert all(set(lines) == {"counts", "best"} for lines in drawn.values())


@pytest.mark.slow
def test_figures(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "figures"
    assert run(["evaluate", "belief", "--estimators", "counts,fcnn", "--figures", str(folder)]) == 0
    assert {p.name for p in folder.iterdir()} == {"reliability.png", "heat_maps.png", "learning_curve.png"}
    assert all(p.stat().st_size > 5000 for p in folder.iterdir())
    assert run(["evaluate", "belief", "--figures", str(folder)]) == 2


def test_what_an_estimator_says_of_its_first_choice() -> None:
    """The largest probability of each query, on average: 0.9 for all of them."""
    judged = evaluate_estimator(Says({FRIDGE: 0.9, COUNTER: 0.5}), [toy_house()])
    assert metrics_of(judged, rng=np.random.default_rng(0))["top1_said"] == pytest.approx(0.9)


def test_a_seed_that_no_generator_takes_is_one_line(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    from workbench.worlds.shipped import shipped_houses

    wanted = ["train", "--houses", str(shipped_houses()), "-e", "counts", "-o", str(tmp_path / "w.safetensors")]
    assert run([*wanted, "--seed", str(2**63)]) == 2
    assert "below 2^63" in capfd.readouterr().err
    assert not (tmp_path / "w.safetensors").exists()
