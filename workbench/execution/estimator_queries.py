"""Queries of a run to its estimator: beliefs for decisions, and their answers, each reported once."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import final

from workbench.beliefs.after_looks import after_looks
from workbench.beliefs.asking.answered_estimator import answers_of
from workbench.beliefs.asking.answers import Answer
from workbench.beliefs.belief import Belief, Estimator
from workbench.planning.scenarios.added_items import believe_scenario_items
from workbench.planning.tasks import Task
from workbench.worlds.house import ItemType
from workbench.worlds.knowledge import Knowledge
from workbench.worlds.perception import Perception


@final
@dataclass(slots=True)
class EstimatorQueries:
    """The beliefs of one run.

    Attributes:
        reported: the questions whose answers were reported.
    """

    estimator: Estimator
    task: Task
    perception: Perception
    reported: set[str] = field(default_factory=set)

    def belief(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Belief:
        """The belief for a decision: the estimator's, with what the task says of its own items, after all looks.

        Raises:
            EstimatorFailed: one from outside gave no belief.
        """
        believed = self.estimator.believe(knowledge, item_types)
        return after_looks(believe_scenario_items(believed, self.task, knowledge.plan), knowledge, self.perception)

    def new_answers(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> tuple[Answer, ...]:
        """The answers on which that belief rests and that were not reported before."""
        answers = {a.question: a for a in answers_of(self.estimator, knowledge, item_types)}
        new = tuple(answer for question, answer in answers.items() if question not in self.reported)
        self.reported.update(answers)
        return new
