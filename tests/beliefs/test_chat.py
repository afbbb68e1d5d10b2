"""Beliefs of a language model: its questions, and what its answers are worth."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import toy
from toy import BED, COUNTER, DESK, FRIDGE, TABLE

from workbench.beliefs.asking.chat import MAX_PROBABILITY, MIN_PROBABILITY, ChatQuestions
from workbench.beliefs.asking.prompt_file import Prompt, read_prompt
from workbench.beliefs.guarded_estimator import EstimatorFailed
from workbench.worlds.house import ItemType
from workbench.worlds.knowledge import Knowledge, knowledge_at_start

MUG, EGG = ItemType("Mug"), ItemType("Egg")
NAMES = ChatQuestions(prompt=Prompt(stem="p", model="m", text="{item}?\n{containers}"))
SEEN = ChatQuestions(prompt=Prompt(stem="p", model="m", text="{item}?\n{containers}\nseen:\n{seen}"))
PROMPTS = Path(__file__).resolve().parents[2] / "examples" / "ask_a_model"


def knowing(*containers: str) -> Knowledge:
    house = toy.toy_house()
    return knowledge_at_start(house.plan, toy.toy_travel(), {c: house.contents[c] for c in containers})


def test_a_question_names_every_container_whatever_was_seen() -> None:
    asked = NAMES.questions(knowing(), (MUG, EGG))
    assert asked == NAMES.questions(knowing(FRIDGE, BED), (MUG, EGG))
    assert asked[0].splitlines() == [
        "Mug?",
        "Fridge|1: Fridge in Kitchen",
        "CounterTop|1: CounterTop in Kitchen",
        "DiningTable|1: DiningTable in Kitchen",
        "Bed|2: Bed in Bedroom",
        "Desk|2: Desk in Bedroom",
    ]
    assert NAMES.names_alone
    assert not SEEN.names_alone


def test_a_question_that_tells_what_was_seen_changes_with_it() -> None:
    assert SEEN.questions(knowing(), (MUG,))[0].endswith("seen:\nnothing yet")
    assert SEEN.questions(knowing(BED), (MUG,))[0].endswith("seen:\nBed|2: Book, Pillow")


def test_what_is_filled_in_is_not_searched_for_fields() -> None:
    assert NAMES.questions(knowing(), (ItemType("{containers}"),))[0].startswith("{containers}?\nFridge|1")


def test_an_answer_is_read_from_among_words_for_the_containers_not_yet_searched() -> None:
    told = {FRIDGE: 0.5, COUNTER: 1, TABLE: 0.0, BED: 0.25, "Moon|1": 7}
    answers = (f"Well, {{yes}}: ```{json.dumps(told)}``` {{}}", json.dumps({"places": {DESK: 0.75}}))
    made = NAMES.probabilities(knowing(FRIDGE), (MUG, EGG), answers)
    assert made.tolist() == [
        [MAX_PROBABILITY, MIN_PROBABILITY, 0.25, MIN_PROBABILITY],
        [MIN_PROBABILITY, MIN_PROBABILITY, MIN_PROBABILITY, 0.75],
    ]


@pytest.mark.parametrize(
    "answer",
    ["", "I do not know.", "{", "{}" * 99, '{"Moon|1": 0.5}', "[0.1, 0.2]", '{"a":' * 50_000],
)
def test_an_answer_without_probabilities_is_one_line(answer: str) -> None:
    with pytest.raises(EstimatorFailed, match="holds no JSON object of probabilities by container") as told:
        NAMES.probabilities(knowing(), (MUG,), (answer,))
    assert len(str(told.value)) < 300


@pytest.mark.parametrize("value", ["NaN", "Infinity", "-0.1", "1.01", '"0.5"', "null", "true", "[1]", "1e999"])
def test_a_value_that_is_no_probability_is_one_line(value: str) -> None:
    with pytest.raises(EstimatorFailed, match=r"its answer gives Fridge\|1 .*, which is not a probability"):
        NAMES.probabilities(knowing(), (MUG,), (f'{{"Fridge|1": {value}}}',))


def test_without_an_endpoint_nobody_is_asked() -> None:
    with pytest.raises(EstimatorFailed, match="it may not ask anything here"):
        NAMES.ask("Where?")


@pytest.mark.parametrize(("file", "alone"), [("by-room", True), ("by-sight", False)])
def test_the_shipped_prompts_are_read_and_show_an_answer_that_is_read(file: str, alone: bool) -> None:
    prompt, _ = read_prompt(PROMPTS / f"{file}.prompt")
    assert prompt.names_alone is alone
    chat = ChatQuestions(prompt=prompt)
    (question,) = chat.questions(knowing(BED), (MUG,))
    assert "looks for a Mug" in question
    assert "{item}" not in question
    assert chat.probabilities(knowing(BED), (MUG,), (question,))[0, 0] == 0.7, "the example in the prompt itself"
