"""What would a strategy have cost, at least and at most, over every world that agrees with the log?

Every node of the unfolded runs carries an interval for the cost from there on: exact at an end, bounded from
outside where nobody has been yet (still_to_walk.py, most_to_walk.py), and from its children otherwise. The search
goes where the interval of the whole can still shrink: down the branch that could be cheapest, then down the branch
that could be dearest. When the budget is spent, the intervals that are left are bounds all the same, and the result
says which side is exact.

Where beliefs follow all that is seen (unfolding.Unfolding.certain), a run that goes by them is not followed beyond
its first open container: what else lay there would have moved them, and nobody can list that. Its interval from
outside holds whatever is believed.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from itertools import islice
from math import inf
from typing import Literal, final

from replayers.most_to_walk import MostToWalk
from replayers.relevance import Answer
from replayers.still_to_walk import StillToWalk
from replayers.unfolding import Filled, Leaf, Node, Question, Told, Unfolding
from workbench.worlds.knowledge import Knowledge

NEAR = 1e-6
"""Costs closer than this are one: the log rounds to six decimals."""

MOST_TOLD = 2000
"""Groups of worlds, for comparisons world by world; beyond this, the bounds alone are kept."""


class Proof(StrEnum):
    """What a bound rests on."""

    EXACT = "exact"
    """Some world that agrees with the log has exactly this cost, and none goes beyond it."""
    OUTER = "outer"
    """No world goes beyond it; whether one comes up to it is not known."""
    STRAIGHT = "outer-if-straight"
    """As outer, for strategies that go straight (most_to_walk.py)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Bounds:
    """The least and the largest cost over all worlds that agree with the log.

    Attributes:
        lower, upper: charged costs.
        lower_proof, upper_proof: what each rests on.
        least_found, largest_found: costs that some world certainly has.
        complete: every world was followed to its end.
        stretches: how many stretches of the loop it took.
        can_fail: some world makes the strategy fail, as far as it was followed.
        cheapest, dearest: ends that cost least_found and largest_found: worlds that one can look at.
        told: what is known of the cost in each group of worlds, all of them together; empty when there are too many.
    """

    lower: float
    upper: float
    lower_proof: Proof
    upper_proof: Proof
    least_found: float
    largest_found: float
    complete: bool
    stretches: int
    can_fail: bool
    cheapest: Leaf | None = None
    dearest: Leaf | None = None
    told: tuple[Told, ...] = ()

    @property
    def exact(self) -> bool:
        """Every world gives the same cost."""
        return self.upper - self.lower <= NEAR

    @property
    def width(self) -> float:
        """(upper - lower) / lower; 0 when exact."""
        return 0.0 if self.exact else (self.upper - self.lower) / self.lower if self.lower > 0 else inf


@dataclass(frozen=True, slots=True, kw_only=True)
class Budget:
    """How much work one strategy over one log may take.

    Attributes:
        stretches: stretches of the loop, each about one decision.
        finish: where fewer than this were needed, every world is followed to its end even though the bounds are
            settled: comparisons world by world need all ends.
        draws: stretches for the estimate; beyond, fewer worlds are drawn (estimates.py).
    """

    stretches: int = 400
    finish: int = 150
    draws: int = 100


def bounds_of(tree: Unfolding, *, budget: Budget, whatever_is_believed: bool = True) -> Bounds:
    """The bounds of a strategy's cost over one log.

    Args:
        whatever_is_believed: follow a run only as far as it is the same whatever else open containers held;
            otherwise as if they held nothing but the task's types.
    """
    return _Search(tree, budget, only_certain=whatever_is_believed).bounds()


Side = Literal["low", "high"]


@dataclass(slots=True)
class _Interval:
    """The cost from a node on.

    Attributes:
        low, high: of the worlds in which the task is done; (inf, -inf) when there is none.
        may_fail: some world may fail.
        found_low, found_high, fails: the same, of ends that were reached.
        whole: every end below is known.
        spent: nothing below can be followed any further, whole or not.
    """

    low: float
    high: float
    may_fail: bool
    found_low: float = inf
    found_high: float = -inf
    fails: bool = False
    whole: bool = False
    spent: bool = False

    def lower(self, cost: float, failure: float) -> float:
        return min(cost + self.low, failure if self.may_fail else inf)

    def upper(self, cost: float, failure: float) -> float:
        return max(cost + self.high, failure if self.may_fail else -inf)

    def least_found(self, cost: float, failure: float) -> float:
        return min(cost + self.found_low, failure if self.fails else inf)

    def largest_found(self, cost: float, failure: float) -> float:
        return max(cost + self.found_high, failure if self.fails else -inf)


@final
class _Search:
    """One search from both ends."""

    def __init__(self, tree: Unfolding, budget: Budget, *, only_certain: bool) -> None:
        self._tree = tree
        self._only_certain = only_certain
        self._is_straight = True
        self._budget = budget
        self._failure = tree.evidence.task.failure_cost
        self._least = StillToWalk(tree.evidence, tree.relevance)
        self._most = MostToWalk(tree.evidence, max_steps=tree.max_steps)
        self._intervals: dict[Node, _Interval] = {}
        self._others: dict[Node, _Interval] = {}
        self._followed: set[Node] = set()
        self._waiting = 1

    def bounds(self) -> Bounds:
        root = self._tree.root
        self._expand(root)
        began = self._tree.stretches
        while not self._intervals[root].spent:
            spent = self._tree.stretches - began
            side = self._open_side()
            if spent >= self._budget.stretches or (side is None and spent >= self._budget.finish):
                break
            if side == "high" and self._waiting > self._budget.stretches - spent:
                break  # the dearest world is certain only when nearly every branch was followed: out of reach
            self._deepen(side)
        return self._result()

    def _open_side(self) -> Side | None:
        """Which side of the whole is not settled; the one that has the more room."""
        whole = self._intervals[self._tree.root]
        below = whole.least_found(0, self._failure) - whole.lower(0, self._failure)
        above = whole.upper(0, self._failure) - whole.largest_found(0, self._failure)
        if max(below, above) <= NEAR:
            return None
        if below > NEAR and (self._tree.stretches % 2 or above <= NEAR):
            return "low"
        return "high" if above > NEAR else "low"

    def _deepen(self, side: Side | None) -> None:
        """Goes down the branch that decides a side (or any that is not spent), expands its end, and goes back."""
        node, cost, way = self._tree.root, 0.0, list[Node]()
        while node in self._followed:
            way.append(node)
            stretch = self._tree.advance(node)
            if stretch.question is None or not self._opened(node):
                break
            cost += stretch.cost
            node = self._tree.child(node, self._choice(node, stretch.question, side, cost))
        self._expand(node)
        for passed in reversed(way):
            self._gather(passed)

    def _choice(self, node: Node, question: Question, side: Side | None, cost: float) -> Answer:
        """The answer below which a side of the whole is decided."""
        below = {a: self._intervals[node.children[a]] for a in question.options}
        left = [a for a in question.options if not below[a].spent]
        among = left or list(question.options)
        if side == "low":
            return min(among, key=lambda a: below[a].lower(cost, self._failure))
        if side == "high":
            return max(among, key=lambda a: below[a].upper(cost, self._failure))
        return among[0]

    def _expand(self, node: Node) -> None:
        """Runs on from a node and bounds its children from outside."""
        if node in self._followed:
            return
        self._followed.add(node)
        self._waiting -= 1
        before = self._intervals.get(node)
        if not self._opened(node):
            assert before is not None, "the start is always certain"
            before.spent = True
            return
        stretch = self._tree.advance(node)
        question = stretch.question
        if question is None:
            own = stretch.cost
            self._intervals[node] = (
                _Interval(own, own, may_fail=False, found_low=own, found_high=own, whole=True, spent=True)
                if stretch.done
                else _Interval(inf, -inf, may_fail=True, fails=True, whole=True, spent=True)
            )
        else:
            for answer in question.options:
                child = self._tree.child(node, answer)
                if child not in self._intervals:
                    self._intervals[child] = self._from_outside(child.knowledge)
                    self._waiting += 1
            if question.others:
                self._others[node] = self._from_outside(question.knowledge)
                self._others[node].spent = True
            self._gather(node)
        after = self._intervals[node]
        if before is not None and (after.found_high > before.high + NEAR or (after.fails and not before.may_fail)):
            self._is_straight = False

    def _from_outside(self, knowledge: Knowledge) -> _Interval:
        low = self._least.from_here(knowledge)
        certain = self._most.fits_straight and self._least.certainly_possible(knowledge)
        high = self._most.going_straight(knowledge) if self._most.fits_straight else self._most.by_step_limit()
        return _Interval(low, high, may_fail=not certain)

    def _gather(self, node: Node) -> None:
        """A node's interval from its children's."""
        stretch = self._tree.advance(node)
        question = stretch.question
        if question is None or not self._opened(node):
            return
        cost = stretch.cost
        below = [self._intervals[node.children[a]] for a in question.options]
        below += [self._others[node]] if question.others else []
        self._intervals[node] = _Interval(
            low=cost + min(b.low for b in below),
            high=cost + max(b.high for b in below),
            may_fail=any(b.may_fail for b in below),
            found_low=cost + min(b.found_low for b in below),
            found_high=cost + max(b.found_high for b in below),
            fails=any(b.fails for b in below),
            whole=all(b.whole for b in below),
            spent=all(b.spent for b in below),
        )

    def _reaching(self, side: Side) -> Leaf | None:
        """An end that costs the least, or the most, that was found."""

        def choose(question: Question) -> Answer:
            nonlocal node, cost
            cost += self._tree.advance(node).cost
            below = {a: self._intervals[node.children[a]] for a in question.options}
            answer = (
                min(question.options, key=lambda a: below[a].least_found(cost, self._failure))
                if side == "low"
                else max(question.options, key=lambda a: below[a].largest_found(cost, self._failure))
            )
            node = self._tree.child(node, answer)
            return answer

        node, cost = self._tree.root, 0.0
        whole = self._intervals[node]
        if not whole.fails and whole.found_low == inf:
            return None
        return self._tree.follow(choose)

    def _told(self) -> Iterator[Told]:
        """What is known of the cost, group of worlds by group of worlds."""
        waiting: list[tuple[Node, float, tuple[Filled, ...]]] = [(self._tree.root, 0.0, ())]
        while waiting:
            node, cost, filled = waiting.pop()
            open_node = node in self._followed and self._opened(node)
            question = self._tree.advance(node).question if open_node else None
            if question is None:
                yield self._group(self._intervals[node], cost, filled)
                continue
            cost += self._tree.advance(node).cost
            if question.others:
                yield self._group(self._others[node], cost, filled)
            for answer in reversed(question.options):
                told = Filled(container=question.container, live=question.live, answer=answer)
                waiting.append((node.children[answer], cost, (*filled, told)))

    def _opened(self, node: Node) -> bool:
        """Whether the search may go on below a node that it has come to."""
        return not (self._only_certain and not self._tree.certain(node))

    def _group(self, interval: _Interval, cost: float, filled: tuple[Filled, ...]) -> Told:
        lower, upper = interval.lower(cost, self._failure), interval.upper(cost, self._failure)
        if not interval.whole and not self._straight:
            lower = min(lower, self._failure)
            upper = max(upper, self._failure, self._most.by_step_limit())
        return Told(filled=filled, least=lower, most=upper)

    @property
    def _straight(self) -> bool:
        picks = self._tree.largest_picks <= self._most.most_picks
        return self._most.fits_straight and picks and self._is_straight

    def _result(self) -> Bounds:
        whole, failure = self._intervals[self._tree.root], self._failure
        lower, upper = whole.lower(0, failure), whole.upper(0, failure)
        least, largest = whole.least_found(0, failure), whole.largest_found(0, failure)
        straight = self._straight
        if not whole.whole and not straight:
            upper = max(failure, self._most.by_step_limit())
            lower = min(lower, failure)
        told = tuple(islice(self._told(), MOST_TOLD + 1))
        above = Proof.STRAIGHT if straight else Proof.OUTER
        return Bounds(
            lower=least if least - lower <= NEAR else lower,
            upper=largest if upper - largest <= NEAR else upper,
            lower_proof=Proof.EXACT if least - lower <= NEAR else Proof.OUTER,
            upper_proof=Proof.EXACT if upper - largest <= NEAR else above,
            least_found=least,
            largest_found=largest,
            complete=whole.whole,
            stretches=self._tree.stretches,
            can_fail=whole.fails,
            cheapest=self._reaching("low"),
            dearest=self._reaching("high"),
            told=told if len(told) <= MOST_TOLD else (),
        )
