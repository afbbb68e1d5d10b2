"""The estimator of people's votes and its mixture: by hand, on known and unknown names, and through the commands."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import toy

from workbench.beliefs import encoder as encoder_module
from workbench.beliefs.encoder import ShippedVectors, shipped_vectors, text_encoder
from workbench.beliefs.estimators import estimator
from workbench.beliefs.people import people as people_module
from workbench.beliefs.people.mixed import MixedEstimator
from workbench.beliefs.people.people import FLOOR, INSTANCES, SHARPNESS, UNTIDY, PeopleEstimator, people_from
from workbench.beliefs.people.votes import write_votes
from workbench.beliefs.weights import read_weights
from workbench.cli import run as lios
from workbench.errors import BadValue, FileMissing, MalformedFile, MissingExtra
from workbench.worlds.house import ItemType
from workbench.worlds.knowledge import Knowledge, knowledge_at_start

MUG, EGG = ItemType("Mug"), ItemType("Egg")
HEADER = "object,room,receptacle,tidy_votes,untidy_votes,implausible_votes\n"
ROWS = "mug,kitchen,countertop,6,2,2\nmug,kitchen,fridge,0,0,10\nmug,bedroom,bed,0,4,6\n"
SHARED = Path(__file__).parents[3].parent / "shared" / "placements" / "housekeep_placement.csv.gz"


def start() -> Knowledge:
    return knowledge_at_start(toy.toy_plan(), toy.toy_travel(), {})


@pytest.fixture
def voted(tmp_path: Path) -> PeopleEstimator:
    (tmp_path / "votes.csv").write_text(HEADER + ROWS, encoding="utf-8")
    return people_from(write_votes(tmp_path / "votes.csv", tmp_path / "people.safetensors", text_encoder()))


def test_a_fit_is_the_share_of_votes_as_worked_out_by_hand(voted: PeopleEstimator) -> None:
    fits = {
        (room, container): voted.fit("Mug", room, container)
        for room, container in (("Kitchen", "CounterTop"), ("Kitchen", "Fridge"), ("Bedroom", "Bed"))
    }
    assert fits["Kitchen", "Fridge"] == pytest.approx(FLOOR, abs=0.01)
    assert fits["Bedroom", "Bed"] == pytest.approx(FLOOR + (1 - FLOOR) * UNTIDY * 0.4, abs=0.01)
    assert fits["Kitchen", "CounterTop"] == pytest.approx(FLOOR + (1 - FLOOR) * (0.6 + UNTIDY * 0.2), abs=0.02)


def test_chances_are_shared_out_among_all_containers_of_the_house(voted: PeopleEstimator) -> None:
    plan, knowledge = toy.toy_plan(), start()
    belief = voted.believe(knowledge, (MUG,))
    kind = {room.id: room.kind for room in plan.rooms}
    sharp = np.array([voted.fit("Mug", kind[c.room], c.type) ** SHARPNESS for c in plan.containers])
    assert belief.of(MUG) == pytest.approx(1 - np.exp(-INSTANCES * sharp / sharp.sum()), abs=1e-8)
    later = voted.believe(knowledge.seen(toy.BED, ()), (MUG,))
    assert later.of(MUG) == pytest.approx(np.delete(belief.of(MUG), belief.containers.index(toy.BED)))


def test_other_names_take_the_votes_of_those_that_are_close() -> None:
    votes = estimator("people")
    assert isinstance(votes, PeopleEstimator)
    assert votes.fit("Cup", "Kitchen", "CounterTop") > votes.fit("Cup", "Bathroom", "Toilet")
    assert votes.fit("ToiletPaper", "Bathroom", "CounterTop") > votes.fit("ToiletPaper", "Kitchen", "Fridge")
    assert votes.fit("Pillow", "Bedroom", "Bed") > votes.fit("Pillow", "Kitchen", "CounterTop")


def test_without_an_encoder_unknown_names_are_as_the_average_and_known_ones_exact(
    voted: PeopleEstimator, monkeypatch: pytest.MonkeyPatch
) -> None:
    def absent(_: str) -> None:
        raise MissingExtra("the text encoder", "encoder")

    monkeypatch.setattr(encoder_module, "live_encoder", absent)
    vectors = ShippedVectors(name="all-MiniLM-L6-v2", table=shipped_vectors().table)
    monkeypatch.setattr(people_module, "text_encoder", lambda _: vectors)
    alone = PeopleEstimator(name="people@0", votes=voted.votes, encoder=vectors)
    strange, other = (alone.fit(name, "Kitchen", "Fridge") for name in ("Qwrtzx", "Blorpf"))
    assert strange == other
    assert alone.fit("Mug", "Kitchen", "CounterTop") == pytest.approx(voted.fit("Mug", "Kitchen", "CounterTop"))


def test_a_mixture_is_the_weighted_mean_of_both() -> None:
    votes, learned = estimator("people"), estimator("counts")
    mixed = MixedEstimator(people=votes, learned=learned, people_share=0.4)
    made, first, second = (e.believe(start(), (MUG, EGG)).probability for e in (mixed, votes, learned))
    assert made == pytest.approx(0.4 * first + 0.6 * second)
    assert mixed.name != MixedEstimator(people=votes, learned=learned, people_share=0.5).name
    with pytest.raises(BadValue):
        MixedEstimator(people=votes, learned=learned, people_share=1.1)


@pytest.mark.parametrize(
    "text",
    ["", "a,b\n1,2\n", HEADER, HEADER + "mug,kitchen,counter,many,2,2\n", HEADER + "mug,kitchen,counter,-1,2,2\n",
     HEADER + "mug,kitchen\n"],
)  # fmt: skip
def test_a_table_that_holds_no_votes_is_refused_in_one_line(tmp_path: Path, text: str) -> None:
    (tmp_path / "votes.csv").write_text(text, encoding="utf-8")
    with pytest.raises(MalformedFile) as refused:
        write_votes(tmp_path / "votes.csv", tmp_path / "people.safetensors", text_encoder())
    assert "\n" not in str(refused.value)
    assert not (tmp_path / "people.safetensors").exists()
    with pytest.raises(FileMissing):
        write_votes(tmp_path / "none.csv", tmp_path / "people.safetensors", text_encoder())


def test_the_command_makes_weights_of_votes_that_runs_take(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "votes.csv").write_text(HEADER + ROWS, encoding="utf-8")
    weights = tmp_path / "people.safetensors"
    said = ["train", "--estimator", "people", "-o", str(weights)]
    assert lios([*said, "--votes", str(tmp_path / "votes.csv")]) == 0
    run = ["record", "--find", "mug", "--estimator", str(weights), "-o", str(tmp_path / "run.mcap")]
    assert lios(run) == 0
    capsys.readouterr()
    assert lios([*said, "--force"]) == 2
    assert lios(["train", "--estimator", "counts", "--votes", str(tmp_path / "votes.csv")]) == 2
    assert len([line for line in capsys.readouterr().err.splitlines() if line.startswith("lios: ")]) == 2


@pytest.mark.slow
@pytest.mark.skipif(not SHARED.exists(), reason="the shared votes are not here")
def test_the_shipped_shares_are_those_of_the_votes() -> None:
    from workbench.beliefs.estimators import shipped_weights
    from workbench.beliefs.people.votes import SOURCE, _rows

    weights = read_weights(shipped_weights("people"))
    assert weights.header.settings["source"] == SOURCE
    votes = people_from(weights).votes
    place = {pair: j for j, pair in enumerate(zip(votes.rooms, votes.receptacles, strict=True))}
    for name, room, receptacle, (tidy, untidy, everybody) in _rows(SHARED):
        i, j = votes.objects.index(name), place[room, receptacle]
        assert votes.tidy[i, j] == pytest.approx(tidy / everybody, abs=1e-3)
        assert votes.untidy[i, j] == pytest.approx(untidy / everybody, abs=1e-3)
