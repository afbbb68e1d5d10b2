"""Estimators that ask questions: their protocol, and the wrapper that makes them ordinary estimators."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Protocol, cast, final

import numpy as np

from workbench.arrays import Floats
from workbench.beliefs.asking.answers import MAX_ANSWER_BYTES, MAX_QUESTION_BYTES, Answer, AnswerBook
from workbench.beliefs.belief import Belief, Estimator
from workbench.beliefs.guarded_estimator import EstimatorFailed, guarded_call
from workbench.errors import BadValue
from workbench.worlds.house import ItemType
from workbench.worlds.knowledge import Knowledge


class AskingEstimator(Protocol):
    """An estimator in two parts: what costs something (ask), and what does not.

    questions and probabilities are deterministic, and the answers are all that probabilities rests on besides its
    arguments; so a run can be replayed from the answers in its log.
    """

    @property
    def name(self) -> str:
        """The name with a short hash of all that shapes questions and answers: "chat-rooms@1a2b3c4d"."""
        ...

    @property
    def model(self) -> str:
        """Who answers."""
        ...

    @property
    def names_alone(self) -> bool:
        """Whether no observation changes questions and beliefs."""
        ...

    def questions(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> tuple[str, ...]:
        """What has to be asked for a belief."""
        ...

    def ask(self, question: str) -> str:
        """The answer; the only part that may be slow, cost money or fail."""
        ...

    def probabilities(
        self, knowledge: Knowledge, item_types: tuple[ItemType, ...], answers: tuple[str, ...]
    ) -> Floats:
        """Probabilities from the answers, shape (item types, unsearched containers).

        Raises:
            EstimatorFailed: an answer is of no use; it is not kept then.
        """
        ...


ASKING_METHODS = ("questions", "ask", "probabilities")


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class AnsweredEstimator:
    """An Estimator of an AskingEstimator: every question is asked once.

    Attributes:
        asking: what asks.
        book: the answers.
    """

    asking: AskingEstimator
    book: AnswerBook = field(repr=False, compare=False)

    @property
    def name(self) -> str:
        return self.asking.name

    @property
    def names_alone(self) -> bool:
        return self.asking.names_alone

    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Belief:
        """The belief over knowledge.unsearched.

        Raises:
            NotAnswered: an answer is needed that nobody recorded, and nobody may be asked.
            EstimatorFailed: no answer, or none of use.
        """
        if not knowledge.unsearched or not item_types:
            shape = (len(item_types), len(knowledge.unsearched))
            return self._belief(knowledge, item_types, np.zeros(shape))
        answers = self.answers(knowledge, item_types)
        texts = tuple(a.answer for a in answers)
        made: object = guarded_call(self.name, lambda: self.asking.probabilities(knowledge, item_types, texts))
        belief = self._belief(knowledge, item_types, made)
        self.book.keep(answers)
        return belief

    def answers(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> tuple[Answer, ...]:
        """The answers that a belief rests on, in the order of its questions; raises as believe."""
        if not knowledge.unsearched or not item_types:
            return ()
        texts = cast(object, guarded_call(self.name, lambda: self.asking.questions(knowledge, item_types)))
        if not isinstance(texts, tuple) or not all(isinstance(t, str) for t in cast("tuple[object, ...]", texts)):
            raise EstimatorFailed(self.name, "its questions are not a tuple of strings")
        asked = cast("tuple[str, ...]", texts)
        return tuple(self.book.answer(_bounded(self.name, t, "question", MAX_QUESTION_BYTES)) for t in asked)

    def _belief(self, knowledge: Knowledge, item_types: tuple[ItemType, ...], probability: object) -> Belief:
        try:
            values = np.asarray(probability, dtype=np.float64)
            return Belief(
                item_types=item_types, containers=knowledge.unsearched, probability=values, estimator=self.name
            )
        except (BadValue, TypeError, ValueError) as error:
            raise EstimatorFailed(self.name, f"its probabilities are invalid: {str(error).rstrip('.')}") from error


def answered(
    asking: AskingEstimator,
    known: Iterable[Answer] = (),
    *,
    may_ask: bool,
    stopwatch: Callable[[], float] = time.perf_counter,
) -> AnsweredEstimator:
    """An ordinary estimator of one that asks.

    Args:
        known: answers of a log.
        may_ask: whether what neither the log nor the cache holds is asked for.
        stopwatch: time source in seconds.
    """

    def ask(question: str) -> Answer:
        began = stopwatch()
        text = cast(object, guarded_call(asking.name, lambda: asking.ask(question)))
        seconds = stopwatch() - began
        if not isinstance(text, str):
            raise EstimatorFailed(asking.name, f"its answer is {type(text).__name__}, not a text")
        return Answer(
            estimator=asking.name,
            model=asking.model,
            question=question,
            answer=_bounded(asking.name, text, "answer", MAX_ANSWER_BYTES),
            seconds=seconds if math.isfinite(seconds) else 0.0,
        )

    return AnsweredEstimator(asking=asking, book=AnswerBook(asking.name, known, ask=ask if may_ask else None))


def answers_of(estimator: Estimator, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> tuple[Answer, ...]:
    """The answers that a belief which was just made rests on; none for an estimator that does not ask."""
    return estimator.answers(knowledge, item_types) if isinstance(estimator, AnsweredEstimator) else ()


def uses_names_alone(estimator: Estimator) -> bool:
    """Whether an estimator says that no observation changes its beliefs."""
    return getattr(estimator, "names_alone", False) is True


def _bounded(name: str, text: str, what: str, limit: int) -> str:
    """A text as it can be written to a log: valid Unicode of a bounded length."""
    data = text.encode("utf-8", "replace")
    if len(data) > limit:
        raise EstimatorFailed(name, f"a {what} of {len(data)} bytes is longer than {limit}")
    return data.decode("utf-8")
