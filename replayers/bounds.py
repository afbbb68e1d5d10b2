"""What would a strategy have cost, at least and at most, over every world that agrees with the log?

The tree of its runs (unfolding.py) is searched best first from both ends: the branch that could be cheapest with
luck, the branch that could be dearest without. A branch is dropped only when neither end can be moved by it. When
the tree outgrows its budget, what is left is bounded from outside, and the result says which side is exact.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass, field
from enum import StrEnum
from itertools import count
from typing import final

from replayers.most_to_walk import MostToWalk
from replayers.still_to_walk import StillToWalk
from replayers.unfolding import Question, Script, Unfolding
from workbench.execution.events import RunStatus

NEAR = 1e-6
"""Costs closer than this are one: the log rounds to six decimals."""


class Proof(StrEnum):
    """What a bound rests on."""

    EXACT = "exact"
    """Some world that agrees with the log has exactly this cost, and none goes beyond it."""
    OUTER = "outer"
    """No world goes beyond it; whether one comes up to it is not known."""
    STRAIGHT = "outer-if-straight"
    """As outer, for strategies that fetch each part of the goal once (most_to_walk.py)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Bounds:
    """The least and the largest cost over all worlds that agree with the log.

    Attributes:
        lower, upper: charged costs.
        lower_proof, upper_proof: what each rests on.
        least_found, largest_found: costs that some world certainly has.
        complete: every world was followed to its end.
        leaves: how many ends were found.
        can_fail: some world makes the strategy fail (as far as it was followed).
    """

    lower: float
    upper: float
    lower_proof: Proof
    upper_proof: Proof
    least_found: float
    largest_found: float
    complete: bool
    leaves: int
    can_fail: bool

    @property
    def exact(self) -> bool:
        return self.upper - self.lower <= NEAR

    @property
    def width(self) -> float:
        """(upper - lower) / lower; 0 when exact."""
        return 0.0 if self.exact else (self.upper - self.lower) / self.lower if self.lower > 0 else float("inf")


@dataclass(frozen=True, slots=True, kw_only=True)
class Budget:
    """How much work a tree may take.

    Attributes:
        runs: how many times the loop may run for the bounds.
        finish: trees of up to this many runs are followed to every end, even where the bounds are settled: paired
            comparisons need all ends.
    """

    runs: int = 400
    finish: int = 64


def bounds_of(tree: Unfolding, *, budget: Budget, max_steps: int = 500) -> Bounds:
    """The bounds of a strategy's cost over one log."""
    return _Search(tree, budget, max_steps).bounds()


@dataclass(frozen=True, slots=True, order=True)
class _Branch:
    """An answer not followed yet, with what its worlds can cost at least and at most."""

    rank: float
    number: int
    script: Script = field(compare=False)
    least: float = field(compare=False)
    most: float = field(compare=False)
    limit: float = field(compare=False)


@final
class _Search:
    """One search from both ends."""

    def __init__(self, tree: Unfolding, budget: Budget, max_steps: int) -> None:
        evidence = tree.evidence
        self._tree = tree
        self._budget = budget
        self._least = StillToWalk(evidence, tree.relevance)
        self._most = MostToWalk(evidence, max_steps=max_steps)
        self._failure = evidence.task.failure_cost
        self._straight = self._most.fits_straight
        self._numbers = count()
        self._by_least: list[_Branch] = []
        self._by_most: list[_Branch] = []
        self._waiting: dict[Script, _Branch] = {}
        self._found: list[float] = []
        self._failed = False
        self._ends = 0

    def bounds(self) -> Bounds:
        self._follow((), rich=False)
        side = 0
        spent = 1
        while self._waiting and spent < self._budget.runs:
            branch = self._next(side)
            if branch is None:
                if spent >= self._budget.finish:
                    break
                branch = self._any()
            self._follow(branch.script, rich=side == 0)
            side, spent = 1 - side, spent + 1
        return self._result()

    def _next(self, side: int) -> _Branch | None:
        """The branch that could move an end the furthest, this side's end first."""
        for low in (side == 0, side != 0):
            heap = self._by_least if low else self._by_most
            while heap and heap[0].script not in self._waiting:
                heapq.heappop(heap)
            if not heap:
                continue
            branch = heap[0]
            moves = branch.least < min(self._found) - NEAR if low else branch.most > max(self._found) + NEAR
            if moves:
                return branch
        return None

    def _any(self) -> _Branch:
        return next(iter(self._waiting.values()))

    def _follow(self, script: Script, *, rich: bool) -> None:
        """Follows a branch to an end, through rich answers or through empty ones; the others wait."""
        self._waiting.pop(script, None)
        planned = len(script)

        def choose(question: Question) -> tuple:
            depth = len(question.script)
            if depth < planned:
                return script[depth]
            return question.options[-1] if rich else question.options[0]

        leaf, questions = self._tree.follow(choose)
        self._ends += 1
        self._found.append(leaf.ended.cost)
        self._straight = self._straight and leaf.picks <= self._most.most_picks
        self._failed = self._failed or leaf.ended.status is not RunStatus.DONE
        for question in questions[planned:]:
            taken = leaf.script[len(question.script)]
            for option in question.options:
                if option != taken:
                    self._wait(question, option)

    def _wait(self, question: Question, option: tuple) -> None:
        script = (*question.script, option)
        if script in self._waiting:
            return
        settled = frozenset(question.asked)
        still = self._least.after(question.knowledge, question.container, option, settled)
        least = min(self._failure, question.own_cost + still)
        limit = self._most.by_step_limit(question.own_cost)
        most = limit
        if self._straight:
            most = self._most.going_straight(question.own_cost, question.knowledge, question.container)
        number = next(self._numbers)
        self._waiting[script] = _Branch(least, number, script, least, most, limit)
        heapq.heappush(self._by_least, _Branch(least, number, script, least, most, limit))
        heapq.heappush(self._by_most, _Branch(-most, number, script, least, most, limit))

    def _result(self) -> Bounds:
        least, largest = min(self._found), max(self._found)
        lower = min([least, *(b.least for b in self._waiting.values())])
        outer = Proof.STRAIGHT if self._straight else Proof.OUTER
        most = [b.most if self._straight else b.limit for b in self._waiting.values()]
        upper = max([largest, *most])
        return Bounds(
            lower=least if least - lower <= NEAR else lower,
            upper=largest if upper - largest <= NEAR else upper,
            lower_proof=Proof.EXACT if least - lower <= NEAR else Proof.OUTER,
            upper_proof=Proof.EXACT if upper - largest <= NEAR else outer,
            least_found=least,
            largest_found=largest,
            complete=not self._waiting,
            leaves=self._ends,
            can_fail=self._failed,
        )
