"""What does a strategy do in every world that agrees with a log? Its run, unfolded lazily into a tree.

A node is a moment when the strategy looks into a container that nobody opened; its branches are the answers that
container can give; a leaf is the end of a run. The ordinary closed loop runs from the start with a script of
answers, and every decision is remembered by the answers given before it, so that walking a known part of the tree
asks the strategy nothing. A strategy must be deterministic: the same view gives the same decision.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import final

from replayers.evidence import Evidence
from replayers.logged_world import LoggedWorld
from replayers.relevance import Answer, Relevance, imputed_items
from workbench.beliefs.belief import Belief, Estimator
from workbench.execution.events import Acted, Ended, Event
from workbench.execution.loop import run_task
from workbench.planning.strategy import Decision, Strategy, View
from workbench.planning.tasks import Task
from workbench.worlds.house import ContainerId, Item, ItemType
from workbench.worlds.knowledge import Knowledge

Script = tuple[Answer, ...]
"""The answers of the open containers, in the order in which the strategy looked into them."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Filled:
    """What an open container answered, and of which types it was asked: the others no longer mattered."""

    container: ContainerId
    live: tuple[ItemType, ...]
    answer: Answer


@dataclass(frozen=True, slots=True, kw_only=True)
class Question:
    """A moment when the log cannot tell: the strategy stands at an open container and looks into it.

    Attributes:
        script: the answers before.
        asked: the containers of those answers.
        container: the one looked into now.
        live: the item types that still matter.
        options: every answer that it can give, nothing first.
        own_cost: what the run has cost so far, the look included.
        knowledge: what the robot knows before the look.
    """

    script: Script
    asked: tuple[ContainerId, ...]
    container: ContainerId
    live: tuple[ItemType, ...]
    options: tuple[Answer, ...]
    own_cost: float
    knowledge: Knowledge


@dataclass(frozen=True, slots=True, kw_only=True)
class Leaf:
    """The end of a run in all worlds that answer as `script` says.

    Attributes:
        filled: the open containers looked into, with their answers.
        ended: status and cost.
        picks: how many times something was picked up.
    """

    script: Script
    filled: tuple[Filled, ...]
    ended: Ended
    picks: int = 0


Choose = Callable[[Question], Answer]


@final
class Unfolding:
    """A strategy's runs over one log, remembered as far as they have been followed.

    Attributes:
        runs: how many times the loop ran.
        decisions: how many decisions the strategy was asked for.
    """

    def __init__(
        self,
        evidence: Evidence,
        strategy: Strategy,
        estimator: Estimator,
        relevance: Relevance,
        *,
        seed: int = 0,
        max_steps: int = 500,
    ) -> None:
        self.evidence = evidence
        self.relevance = relevance
        self.strategy = strategy
        self.runs = 0
        self._estimator = estimator
        self._seed = seed
        self._max_steps = max_steps
        self._remembered = Remembered(strategy, estimator)
        self._questions: dict[Script, Question] = {}
        self._leaves: dict[Script, Leaf] = {}
        self._seen = evidence.seen_types()

    @property
    def decisions(self) -> int:
        return self._remembered.asked

    def leaves(self) -> tuple[Leaf, ...]:
        """Every end found so far, in the order of finding."""
        return tuple(self._leaves.values())

    def follow(self, choose: Choose) -> tuple[Leaf, tuple[Question, ...]]:
        """Runs to an end, choosing an answer at every question; also the questions passed, in order."""
        script: Script = ()
        passed: list[Question] = []
        while script in self._questions:
            question = self._questions[script]
            passed.append(question)
            script = (*script, choose(question))
        if script not in self._leaves:
            known = len(passed)
            leaf, questions = self._run(script, choose)
            self._leaves[leaf.script] = leaf
            for question in questions:
                self._questions[question.script] = question
            passed += questions[known:]
            return leaf, tuple(passed)
        return self._leaves[script], tuple(passed)

    def events(self, leaf: Leaf) -> tuple[Event, ...]:
        """The events of a run that ended in a leaf, with the ways walked; what a recording of it holds."""
        answers = {f.container: f.answer for f in leaf.filled}
        world = LoggedWorld(self.evidence, filling=lambda c, _: imputed_items(answers.get(c, ()), c))
        task, costs = self.evidence.task, self.evidence.costs
        return tuple(
            run_task(
                world,
                self.strategy,
                self._estimator,
                task,
                costs=costs,
                seed=self._seed,
                max_steps=self._max_steps,
                stopwatch=no_time,
            )
        )

    def _run(self, script: Script, choose: Choose) -> tuple[Leaf, list[Question]]:
        self.runs += 1
        filling = _Asking(self, script, choose)
        world = LoggedWorld(self.evidence, filling=filling, with_ways=False)
        filling.cost_so_far = lambda: cost
        self._remembered.begin(filling)
        task, costs = self.evidence.task, self.evidence.costs
        cost, picks = 0.0, 0
        ended: Ended | None = None
        for event in run_task(
            world,
            self._remembered,
            self._remembered,
            task,
            costs=costs,
            seed=self._seed,
            max_steps=self._max_steps,
            stopwatch=no_time,
        ):
            if isinstance(event, Ended):
                ended = event
            elif isinstance(event, Acted):
                cost += event.cost
                picks += event.success and event.step.action == "pick"
        assert ended is not None, "the loop always ends with Ended"
        filled = tuple(
            Filled(container=q.container, live=q.live, answer=answer)
            for q, answer in zip(filling.questions, filling.given, strict=True)
        )
        return Leaf(script=filling.given, filled=filled, ended=ended, picks=picks), filling.questions

    def question(
        self,
        script: Script,
        asked: tuple[ContainerId, ...],
        container: ContainerId,
        knowledge: Knowledge,
        cost: float,
    ) -> Question:
        """The question that a look into an open container puts."""
        left = len(self.evidence.open) - len(asked) - 1
        live = self.relevance.live(knowledge)
        return Question(
            script=script,
            asked=asked,
            container=container,
            live=live,
            options=self.relevance.options(live, script, left, self._seen),
            own_cost=cost + self.evidence.costs.search,
            knowledge=knowledge,
        )


def no_time() -> float:
    """Planning time is not charged in a replay: it would make the answer depend on the machine."""
    return 0.0


@final
@dataclass(slots=True)
class _Asking:
    """A filling that answers from a script, then by choice, and notes every question."""

    tree: Unfolding
    planned: Script
    choose: Choose
    given: Script = ()
    asked: tuple[ContainerId, ...] = ()
    questions: list[Question] = field(default_factory=list)
    cost_so_far: Callable[[], float] = float

    def __call__(self, container: ContainerId, knowledge: Knowledge) -> tuple[Item, ...]:
        question = self.tree.question(self.given, self.asked, container, knowledge, self.cost_so_far())
        depth = len(self.given)
        answer = self.planned[depth] if depth < len(self.planned) else self.choose(question)
        self.questions.append(question)
        self.given = (*self.given, answer)
        self.asked = (*self.asked, container)
        return imputed_items(answer, container)


@final
class Remembered:
    """A strategy and its estimator with their decisions remembered by the answers given before.

    Within one tree the world is deterministic: the answers so far and the number of the decision say what the view
    is, so a decision once made need not be made again.
    """

    def __init__(self, strategy: Strategy, estimator: Estimator) -> None:
        self.asked = 0
        self._strategy = strategy
        self._estimator = estimator
        self._run: _Asking | None = None
        self._count = 0
        self._beliefs: dict[tuple[Script, int], Belief] = {}
        self._decisions: dict[tuple[Script, int], Decision] = {}

    @property
    def name(self) -> str:
        return self._strategy.name

    def begin(self, run: _Asking) -> None:
        """A new run from the start."""
        self._run, self._count = run, 0

    def relevant_types(self, task: Task) -> tuple[ItemType, ...]:
        return self._strategy.relevant_types(task)

    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Belief:
        self._count += 1
        key = self._key()
        if key not in self._beliefs:
            self._beliefs[key] = self._estimator.believe(knowledge, item_types)
        return self._beliefs[key]

    def decide(self, view: View) -> Decision:
        key = self._key()
        if key not in self._decisions:
            self.asked += 1
            self._decisions[key] = self._strategy.decide(view)
        return self._decisions[key]

    def _key(self) -> tuple[Script, int]:
        return (self._run.given if self._run else (), self._count)
