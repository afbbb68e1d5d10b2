"""Estimators on strange houses (unknown names, endless names, one container): sane beliefs or a clear error."""

from __future__ import annotations

import importlib.util
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import toy
from procthor_strange import strange_house

from workbench.arrays import Floats32
from workbench.beliefs import encoder as encoder_module
from workbench.beliefs.belief import Belief
from workbench.beliefs.encoder import NameNotShipped, ShippedVectors, shipped_vectors
from workbench.beliefs.estimators import ESTIMATORS, estimator, shipped_weights
from workbench.beliefs.weights import read_weights
from workbench.cli import run
from workbench.errors import MissingExtra
from workbench.evaluation.beliefs.metrics import dummy_travel_costs
from workbench.worlds.house import ContainerId, ItemType
from workbench.worlds.knowledge import Knowledge, knowledge_at_start

NAMES = sorted(ESTIMATORS)
UNKNOWN = (ItemType("Zonk"), ItemType("ObjaBrillig"), ItemType("Mome" * 2500))
live = pytest.mark.skipif(
    importlib.util.find_spec("sentence_transformers") is None, reason="the extra 'encoder' is not installed"
)


def strange_knowledge(*, opened: int = 0) -> Knowledge:
    """The toy house with rooms and containers of kinds that nobody has met."""
    plan = toy.toy_plan()
    rooms = tuple(replace(room, kind=f"Slithy{k}") for k, room in enumerate(plan.rooms))
    containers = tuple(replace(c, type=f"Tove{k}") for k, c in enumerate(plan.containers))
    plan = replace(plan, rooms=rooms, containers=containers)
    seen: dict[ContainerId, tuple[object, ...]] = {c.id: (toy.item("Wabe|1"),) for c in containers[:opened]}
    return knowledge_at_start(plan, dummy_travel_costs(plan), seen)  # type: ignore[arg-type]


def assert_sane(belief: Belief, items: int, containers: int) -> None:
    assert belief.probability.shape == (items, containers)
    assert np.isfinite(belief.probability).all()
    assert (belief.probability > 0).all()
    assert (belief.probability < 1).all()


class Hashed:
    """A stand-in for a live encoder: a vector of length 1 for any name."""

    name = "all-MiniLM-L6-v2"

    def encode(self, names: list[str]) -> Floats32:
        drawn = [np.random.default_rng(sum(map(ord, n))).normal(size=384) for n in names]
        return np.array([v / np.linalg.norm(v) for v in drawn], dtype=np.float32)


@pytest.fixture
def anew(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """Estimators that have encoded nothing yet."""
    vectors = ShippedVectors(name="all-MiniLM-L6-v2", table=shipped_vectors().table)
    for module in ("fcnn", "placements"):
        monkeypatch.setattr(f"workbench.beliefs.{module}.text_encoder", lambda _: vectors)
    return monkeypatch


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("opened", [0, 2])
def test_a_house_of_which_no_name_is_known(name: str, opened: int, anew: pytest.MonkeyPatch) -> None:
    anew.setattr(encoder_module, "live_encoder", lambda _: Hashed())
    chosen = ESTIMATORS[name](read_weights(shipped_weights(name)))
    assert_sane(chosen.believe(strange_knowledge(opened=opened), UNKNOWN), 3, 5 - opened)


@pytest.mark.parametrize("name", ["fcnn", "best"])
def test_without_an_encoder_an_unknown_name_is_one_clear_error(name: str, anew: pytest.MonkeyPatch) -> None:
    def absent(_: str) -> None:
        raise MissingExtra("the text encoder", "encoder")

    anew.setattr(encoder_module, "live_encoder", absent)
    chosen = ESTIMATORS[name](read_weights(shipped_weights(name)))
    knowledge = knowledge_at_start(toy.toy_plan(), toy.toy_travel(), {})
    for item in UNKNOWN:
        with pytest.raises(NameNotShipped, match=r"lios-workbench\[encoder\]") as error:
            chosen.believe(knowledge, (item,))
        assert len(str(error.value)) < 300


def test_counts_need_no_encoder_for_unknown_names() -> None:
    belief = estimator("counts").believe(strange_knowledge(), UNKNOWN)
    assert_sane(belief, 3, 5)


@live
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", ["fcnn", "best"])
def test_unknown_names_are_encoded_live(name: str) -> None:
    assert_sane(estimator(name).believe(strange_knowledge(opened=1), UNKNOWN), 3, 4)


def test_the_commands_on_a_house_of_one_container_and_unknown_items(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    houses = tmp_path / "strange.jsonl"
    houses.write_text(json.dumps(strange_house(items=("Zonk", "Mome" * 2500))) + "\n")
    assert run(["evaluate", "belief", "--houses", str(houses), "--estimators", "counts", "--json"]) == 0
    row = json.loads(capfd.readouterr().out)["rows"][0]
    assert row["queries"] == 2
    assert row["top1"] == 1.0
    assert np.isfinite(row["log_loss"])
