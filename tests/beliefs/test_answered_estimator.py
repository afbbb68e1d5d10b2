"""Estimators that ask: every question once, and a fault of the one who answers is one line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import toy

from workbench.beliefs.asking.answered_estimator import answered, answers_of, uses_names_alone
from workbench.beliefs.asking.answers import MAX_ANSWER_BYTES, NotAnswered
from workbench.beliefs.asking.state_questions import StateQuestions
from workbench.beliefs.belief import Belief
from workbench.beliefs.estimators import estimator
from workbench.beliefs.guarded_estimator import EstimatorFailed
from workbench.worlds.house import ContainerId, ItemType
from workbench.worlds.knowledge import Knowledge, knowledge_at_start

MUG, EGG = ItemType("Mug"), ItemType("Egg")


class Oracle:
    """Asks one question for each type; what it is answered is the probability of every container."""

    name, model, names_alone = "oracle@1", "delphi", True

    def __init__(self, answer: Any = "0.25") -> None:
        self.asked: list[str] = []
        self.answer = answer

    def questions(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> tuple[str, ...]:
        return tuple(f"where is {t}" for t in item_types)

    def ask(self, question: str) -> str:
        self.asked.append(question)
        return self.answer

    def probabilities(
        self, knowledge: Knowledge, item_types: tuple[ItemType, ...], answers: tuple[str, ...]
    ) -> np.ndarray[Any, Any]:
        return np.array([[float(a)] * len(knowledge.unsearched) for a in answers])


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LIOS_CACHE", str(tmp_path))


def knowing(*containers: ContainerId) -> Knowledge:
    house = toy.toy_house()
    return knowledge_at_start(house.plan, toy.toy_travel(), {c: house.contents[c] for c in containers})


def test_every_question_is_asked_once_and_its_answer_is_told_with_its_seconds() -> None:
    oracle = Oracle()
    ticks = iter(range(100))
    asking = answered(oracle, may_ask=True, stopwatch=lambda: float(next(ticks)))
    first = asking.believe(knowing(), (MUG,))
    both = asking.believe(knowing(toy.FRIDGE), (MUG, EGG))
    assert oracle.asked == ["where is Mug", "where is Egg"]
    assert (first.probability == 0.25).all()
    assert both.probability.shape == (2, 4)
    told = answers_of(asking, knowing(), (MUG, EGG))
    assert [(a.estimator, a.model, a.question, a.answer, a.seconds) for a in told] == [
        ("oracle@1", "delphi", "where is Mug", "0.25", 1.0),
        ("oracle@1", "delphi", "where is Egg", "0.25", 1.0),
    ]


def test_from_a_logs_answers_nobody_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    oracle = Oracle()
    told = answers_of(answered(oracle, may_ask=True), knowing(), (MUG,))
    monkeypatch.setenv("LIOS_CACHE", "off")
    again = answered(oracle, told, may_ask=False)
    assert (again.believe(knowing(), (MUG,)).probability == 0.25).all()
    assert len(oracle.asked) == 1
    with pytest.raises(NotAnswered, match="where is Egg"):
        again.believe(knowing(), (EGG,))


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        ("nan", r"is nan; it must be within \[0, 1\]"),
        ("7", r"is 7\.0; it must be within \[0, 1\]"),
        ("hm", "it raised ValueError: could not convert"),
        (None, "its answer is NoneType, not a text"),
        ("1" * (MAX_ANSWER_BYTES + 1), "is longer than"),
    ],
)
def test_an_answer_of_no_use_is_one_line_and_is_not_kept(answer: Any, words: str) -> None:
    oracle = Oracle(answer)
    with pytest.raises(EstimatorFailed, match=words):
        answered(oracle, may_ask=True).believe(knowing(), (MUG,))
    with pytest.raises(NotAnswered):
        answered(oracle, may_ask=False).believe(knowing(), (MUG,))


def test_questions_that_are_no_texts_are_one_line() -> None:
    oracle = Oracle()
    oracle.questions = lambda knowledge, item_types: [7]  # type: ignore[method-assign]
    with pytest.raises(EstimatorFailed, match="its questions are not a tuple of strings"):
        answered(oracle, may_ask=True).believe(knowing(), (MUG,))


def test_nothing_is_asked_where_there_is_nothing_to_believe() -> None:
    oracle = Oracle()
    asking = answered(oracle, may_ask=False)
    everything = knowing(*toy.toy_house().contents)
    assert asking.believe(everything, (MUG,)).probability.shape == (1, 0)
    assert asking.believe(knowing(), ()).probability.shape == (0, 5)
    assert answers_of(asking, everything, (MUG,)) == ()


class Slow:
    """Costly as a whole; believes in what is not yet seen in equal parts."""

    name, costly = "slow", True
    calls = 0

    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Belief:
        self.calls += 1
        count = len(knowledge.unsearched)
        return Belief(
            item_types=item_types,
            containers=knowledge.unsearched,
            probability=np.full((len(item_types), count), 1 / count),
            estimator=self.name,
        )


def test_one_that_is_costly_as_a_whole_is_asked_about_each_state_once() -> None:
    slow = Slow()
    asking = answered(StateQuestions("slow", slow), may_ask=True)
    for known in ((), (toy.FRIDGE,), (), (toy.FRIDGE,)):
        belief = asking.believe(knowing(*known), (MUG, EGG))
        assert belief.probability.tolist() == [[1 / len(belief.containers)] * len(belief.containers)] * 2
    assert slow.calls == 2
    (told,) = answers_of(asking, knowing(toy.FRIDGE), (MUG, EGG))
    assert '"Fridge|1":["Apple","Egg","Tomato"]' in told.question
    gone = answered(StateQuestions("slow", None), [told], may_ask=False)
    assert gone.believe(knowing(toy.FRIDGE), (MUG, EGG)).probability.tolist() == [[0.25] * 4] * 2


def test_the_resolver_tells_asking_estimators_from_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "some_estimators.py").write_text(
        "from test_answered_estimator import Oracle, Slow\n"
        "from test_guarded_estimator import Fine\n"
        "class Alone(Slow):\n    names_alone = True\n    model = 'm'\n"
    )
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(Path(__file__).parent))
    from workbench.plugins import NameOrigin

    made = {n: estimator(f"some_estimators:{n}", origin=NameOrigin.USER) for n in ("Oracle", "Slow", "Alone", "Fine")}
    assert {n: type(e).__name__ for n, e in made.items()} == {
        "Oracle": "AnsweredEstimator",
        "Slow": "AnsweredEstimator",
        "Alone": "AnsweredEstimator",
        "Fine": "GuardedEstimator",
    }
    assert [n for n, e in made.items() if uses_names_alone(e)] == ["Oracle", "Alone"]
