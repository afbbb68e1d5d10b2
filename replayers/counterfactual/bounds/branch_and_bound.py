"""Best-first branch and bound for the least and the largest cost over all consistent worlds.

Every node of the run tree carries an interval for the cost from there on: exact at an end, an outer bound where the
node is not expanded (lower_bound.py, upper_bound.py), and from its children otherwise. The search goes where the
interval of the whole can still shrink: down the branch that could be cheapest, then down the one that could be most
expensive. When the budget is spent, the intervals are still bounds, and the result says which side is exact. What
holds for a node holds for its children, so that an interval only ever narrows, and with it the bounds as the budget
grows.

Where beliefs follow all that is seen, a run is not followed beyond an open container whose other contents may change
what it does next (run_tree.RunTree.certain). Its outer interval holds for all beliefs. Where the log rounded beliefs,
the same holds from the start on.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from heapq import heappop, heappush
from itertools import islice
from math import inf
from typing import Literal, final

from replayers.counterfactual.bounds.bounds import MAX_WORLD_GROUPS, Bounds, Budget
from replayers.counterfactual.bounds.search_cache import SearchCache
from replayers.counterfactual.bounds.state_bounds import StateBounds
from replayers.counterfactual.estimates.intervals import CostInterval
from replayers.counterfactual.relevance import Answer
from replayers.counterfactual.results import Assignment, Proof, WorldGroup
from replayers.counterfactual.run_tree import Leaf, Node, RunTree, UnobservedLook
from workbench.tolerances import NEAR_COST

Side = Literal["low", "high"]
Branches = list[tuple[float, Node]]
"""The nodes after a node, each with the cost from it."""

NEARLY_DONE = 0.25
"""As a share of the budget: with fewer branches left that could cost most, it is worth going on."""
HOPELESS, ENOUGH_TO_TELL = 0.5, 40
"""As a share of the budget, after so many segments: with more branches left that could cost most, few searches end
within it."""


def bounds_of(
    tree: RunTree, *, budget: Budget, whatever_is_believed: bool = True, cache: SearchCache | None = None
) -> Bounds:
    """The bounds of a strategy's cost over one log.

    Args:
        whatever_is_believed: follow a run only as far as it does not depend on what else open containers hold;
            otherwise assume that they hold nothing but the task's types.
        cache: the searches over one log; strategies may share it.
    """
    outside = (cache if cache is not None else SearchCache()).outside(tree.evidence, tree.relevance, tree.traits)
    search = BoundSearch(tree, budget, outside, only_certain=whatever_is_believed)
    bounds = search.bounds()
    if not search.needs_all_items:
        return bounds
    apart = tree.with_all_items()
    before, asked = apart.segments, apart.asked
    bounds = BoundSearch(apart, budget, outside, only_certain=whatever_is_believed).bounds()
    tree.segments += apart.segments - before
    tree.asked |= asked
    return replace(bounds, segments=tree.segments)


@final
class BoundSearch:
    """One branch-and-bound search for both ends of the interval."""

    def __init__(self, tree: RunTree, budget: Budget, outside: StateBounds, *, only_certain: bool) -> None:
        self._tree = tree
        self._only_certain = only_certain
        self._is_straight = True
        self._cut = False
        self._unfinished = False
        self._barred: list[tuple[float, float]] = []  # costs of ambiguous nodes, from below and above
        self._budget = budget
        self._failure = tree.evidence.task.failure_cost
        self._outside = outside
        self._most = outside.most
        self._intervals: dict[Node, CostInterval] = {}
        self._others: dict[Node, CostInterval] = {}
        self._followed: set[Node] = set()
        self._branches: dict[Node, Branches] = {}  # of every node that was followed
        self._parents: dict[Node, list[Node]] = {}  # that were followed, the one of the first path to it first
        self._stale: set[Node] = set()  # intervals of children changed since theirs was updated
        self._waiting: dict[Node, float] = {}  # with the most that each can cost, by that path
        self._largest = -inf  # found when _waiting was last cleared of what can no longer matter
        self._known: list[tuple[float, int, Node]] = []  # of these, those at which nothing is missing; a heap

    def bounds(self) -> Bounds:
        root = self._tree.root
        self._intervals[root] = self._outside.interval(root.knowledge)
        self._expand(root)
        began = self._tree.segments
        while not self._intervals[root].spent and not self._is_barred():
            spent = self._tree.segments - began
            side = self._unsettled_side()
            limit = self._limit(spent)
            if spent >= limit or (side is None and spent >= self._budget.finish):
                self._unfinished = side is not None
                break
            if side == "high":
                if (known := self._largest_known()) is not None:
                    self._expand_below(known)
                    continue
                if self._is_hopeless(spent, limit):
                    self._unfinished = True
                    break
            self._descend(side)
        return self._result()

    @property
    def needs_all_items(self) -> bool:
        """Whether ambiguous nodes are what the search ended at: where all items distinguish histories, there are
        none."""
        return bool(self._barred) and (self._intervals[self._tree.root].spent or self._is_barred())

    def _is_barred(self) -> bool:
        """Whether an ambiguous node, which is not followed, decides an end."""
        if not self._barred:
            return False
        whole = self._intervals[self._tree.root]
        low, high = whole.lower(0, self._failure), whole.upper(0, self._failure)
        low_open = low < whole.least_found(0, self._failure) - NEAR_COST
        high_open = high > whole.largest_found(0, self._failure) + NEAR_COST
        return any(
            (low_open and least <= low + NEAR_COST) or (high_open and most >= high - NEAR_COST)
            for least, most in self._barred
        )

    def _is_hopeless(self, spent: int, limit: int) -> bool:
        """Whether the largest cost will hardly be certain within the limit: each branch that could still cost more
        must be followed, and from most of them others go on."""
        waiting = self._open_maxima()
        return waiting > limit - spent or (spent >= ENOUGH_TO_TELL and waiting > HOPELESS * limit)

    def _limit(self, spent: int) -> int:
        """How many segments the search may take: the budget, and as many again where few branches are left that could
        cost most."""
        segments = self._budget.segments
        if spent < segments // 2:
            return segments
        return 2 * segments if self._open_maxima() <= NEARLY_DONE * segments else segments

    def _unsettled_side(self) -> Side | None:
        """The end of the root's interval that is not settled; of two, the one with the larger gap."""
        whole = self._intervals[self._tree.root]
        below = whole.least_found(0, self._failure) - whole.lower(0, self._failure)
        above = whole.upper(0, self._failure) - whole.largest_found(0, self._failure)
        if max(below, above) <= NEAR_COST:
            return None
        if below > NEAR_COST and (len(self._followed) % 2 or above <= NEAR_COST):
            return "low"
        return "high" if above > NEAR_COST else "low"

    def _open_maxima(self) -> int:
        """How many unexplored branches could cost more than the largest cost found (by the first path to each)."""
        largest = self._intervals[self._tree.root].largest_found(0, self._failure)
        if largest > self._largest:  # it only grows: what cannot exceed it now never will
            self._largest = largest
            self._waiting = {node: most for node, most in self._waiting.items() if most > largest + NEAR_COST}
        return len(self._waiting)

    def _largest_known(self) -> Node | None:
        """The waiting node without open questions that can cost most, if that is more than the largest cost found.

        Its run takes one segment, and shows how many of the others can still matter.
        """
        while self._known and self._known[0][-1] in self._followed:
            heappop(self._known)
        if not self._known:
            return None
        most, _, node = self._known[0]
        largest = self._intervals[self._tree.root].largest_found(0, self._failure)
        return node if -most > largest + NEAR_COST else None

    def _expand_below(self, node: Node) -> None:
        """Expands a waiting node, and backs up along the first path to it."""
        self._expand(node)
        while (node := self._parents[node][0]) is not self._tree.root:
            self._update_from_children(node)
        self._update_from_children(node)

    def _descend(self, side: Side | None) -> None:
        """Descends the branch that decides an end (or any that is not exhausted), expands its last node, and backs
        up."""
        node, cost, path = self._tree.root, 0.0, list[Node]()
        while node in self._followed:
            path.append(node)
            branches = self._branches[node]
            if not branches:
                break
            behind, node = self._choice(branches, side, cost)
            cost += behind
        self._expand(node)
        for passed in reversed(path):
            self._update_from_children(passed)

    def _branches_of(self, node: Node) -> Branches:
        """The nodes after a node, each with the cost from it: by what its look shows, and by a tag that is seen in
        passing before."""
        segment = self._tree.advance(node)
        options = () if segment.unobserved is None else segment.unobserved.options
        looked = [(segment.cost, self._tree.child(node, answer)) for answer in options]
        return [*looked, *self._tree.seen_in_passing(node)]

    def _choice(self, branches: Branches, side: Side | None, cost: float) -> tuple[float, Node]:
        """The branch that decides an end of the root's interval."""
        intervals, failure = self._intervals, self._failure
        left = [branch for branch in branches if not intervals[branch[1]].spent] or branches
        if side is None or len(left) == 1:
            return left[0]
        if side == "low":
            least = [intervals[node].lower(cost + behind, failure) for behind, node in left]
            return left[least.index(min(least))]
        most = [intervals[node].upper(cost + behind, failure) for behind, node in left]
        return left[most.index(max(most))]

    def _expand(self, node: Node) -> None:
        """Runs on from a node and gives its children outer bounds."""
        if node in self._followed:
            return
        self._followed.add(node)
        self._waiting.pop(node, None)
        before = self._intervals[node]
        if not self._may_expand(node):
            self._branches[node] = []
            before.spent = True
            self._cut |= not node.ambiguous
            if node.ambiguous:
                failure = self._failure
                self._barred.append((before.lower(node.cost, failure), before.upper(node.cost, failure)))
            self._stale.update(self._parents.get(node, ()))
            return
        unobserved = self._tree.advance(node).unobserved
        if unobserved is not None:
            looks = unobserved.walk is None
            self._is_straight = self._is_straight and not (
                looks and self._outside.nothing_missing(unobserved.knowledge)
            )
        self._branches[node] = self._branches_of(node)
        for behind, child in self._branches[node]:
            self._parents.setdefault(child, []).append(node)
            if child not in self._intervals:
                interval = self._outside.interval(child.knowledge, walking=child.walk is not None)
                interval.narrow_to(before, behind=behind)
                self._intervals[child] = interval
                most = interval.upper(child.cost, self._failure)
                if most > self._largest + NEAR_COST:
                    self._waiting[child] = most
                if self._tree.traits.plans_shortest and self._outside.nothing_missing(child.knowledge):
                    heappush(self._known, (-most, len(self._intervals), child))
        if unobserved is not None and unobserved.others:
            others = self._outside.interval(unobserved.knowledge, walking=unobserved.walk is not None)
            others.narrow_to(before, behind=self._tree.advance(node).cost)
            others.spent = True
            self._others[node] = others
        self._stale.add(node)
        self._update_from_children(node)
        after = self._intervals[node]
        if after.found_high > before.high + NEAR_COST or (after.fails and not before.may_fail):
            self._is_straight = False

    def _update_from_children(self, node: Node) -> None:
        """A node's interval from those of its children, no wider than before; nothing to do where none changed."""
        if node not in self._stale:
            return
        self._stale.discard(node)
        segment, before = self._tree.advance(node), self._intervals[node]
        below = [(behind, self._intervals[child]) for behind, child in self._branches[node]]
        if segment.unobserved is None:
            interval = CostInterval.over([(0.0, CostInterval.at_end(segment.cost, done=segment.done)), *below])
        else:
            if segment.unobserved.others:
                below.append((segment.cost, self._others[node]))
            interval = CostInterval.over(below)
            interval.narrow_to(before)
        if interval != before:
            self._intervals[node] = interval
            self._stale.update(self._parents.get(node, ()))

    def _attaining_leaf(self, side: Side) -> Leaf | None:
        """A run end with the least, or the greatest, cost found."""

        def choose(unobserved: UnobservedLook) -> Answer:
            nonlocal node, cost
            cost += self._tree.advance(node).cost
            below = {a: self._intervals[node.children[a]] for a in unobserved.options}
            answer = (
                min(unobserved.options, key=lambda a: below[a].least_found(cost, self._failure))
                if side == "low"
                else max(unobserved.options, key=lambda a: below[a].largest_found(cost, self._failure))
            )
            node = self._tree.child(node, answer)
            return answer

        node, cost = self._tree.root, 0.0
        whole = self._intervals[node]
        if (not whole.fails and whole.found_low == inf) or self._by_tags(side):
            return None
        return self._tree.follow(choose)

    def _by_tags(self, side: Side) -> bool:
        """Whether the least, or the greatest, cost found is that of a run in which a tag was seen in passing: such a
        run is in no assignment of contents alone."""
        sign = 1.0 if side == "low" else -1.0
        node, cost = self._tree.root, 0.0
        while True:
            sighted = self._tree.seen_in_passing(node) if self._may_expand(node) else ()
            segment = self._tree.advance(node)
            if segment.unobserved is None:
                own = cost + segment.cost if segment.done else self._failure
                return any(sign * self._found(side, child, cost + behind) < sign * own for behind, child in sighted)
            looked = [(segment.cost, node.children[answer]) for answer in segment.unobserved.options]
            branches = [(sign * self._found(side, child, cost + behind), behind, child) for behind, child in looked]
            least, behind, child = min(branches, key=lambda b: b[0])
            if any(sign * self._found(side, other, cost + more) < least for more, other in sighted):
                return True
            node, cost = child, cost + behind

    def _found(self, side: Side, node: Node, cost: float) -> float:
        """The least, or the greatest, cost found of runs through a node."""
        interval = self._intervals[node]
        if side == "low":
            return interval.least_found(cost, self._failure)
        return interval.largest_found(cost, self._failure)

    def _world_groups(self) -> Iterator[WorldGroup]:
        """The bounds of the cost for each group of worlds."""
        root = self._tree.root
        waiting: list[tuple[Node, CostInterval, float, tuple[Assignment, ...]]] = [
            (root, self._intervals[root], 0.0, ())
        ]
        while waiting:
            node, interval, cost, filled = waiting.pop()
            open_node = node in self._followed and self._may_expand(node)
            unobserved = self._tree.advance(node).unobserved if open_node else None
            if unobserved is None:
                yield self._group(interval, cost, filled)
                continue
            behind = self._tree.advance(node).cost
            cost += behind
            if unobserved.others:
                yield self._group(self._others[node].narrowed_to(interval, behind=behind), cost, filled)
            for answer in reversed(unobserved.options):
                assigned = Assignment(container=unobserved.container, live=unobserved.live, answer=answer)
                child = node.children[answer]
                below = self._intervals[child]
                if not below.whole:  # otherwise it holds nothing but costs that were attained
                    below = below.narrowed_to(interval, behind=behind)
                waiting.append((child, below, cost, (*filled, assigned)))

    def _may_expand(self, node: Node) -> bool:
        """Whether the search may continue below a node."""
        self._tree.advance(node)
        return not node.ambiguous and not (self._only_certain and not self._tree.certain(node))

    def _group(self, interval: CostInterval, cost: float, filled: tuple[Assignment, ...]) -> WorldGroup:
        lower, upper = interval.lower(cost, self._failure), interval.upper(cost, self._failure)
        if not interval.whole and not self._straight:
            lower = min(lower, self._failure)
            upper = inf
        return WorldGroup(filled=filled, least=lower, most=upper)

    @property
    def _straight(self) -> bool:
        picks = self._tree.max_picks <= self._most.max_picks
        return self._most.fits_straight and picks and self._is_straight

    def _result(self) -> Bounds:
        whole, failure = self._intervals[self._tree.root], self._failure
        lower, upper = whole.lower(0, failure), whole.upper(0, failure)
        least, largest = whole.least_found(0, failure), whole.largest_found(0, failure)
        straight = self._straight
        if not whole.whole and not straight:
            upper = inf
            lower = min(lower, failure)
        may_pass = self._followed if self._tree.evidence.tags is not None else ()
        by_tags = any(self._tree.seen_in_passing(node) for node in may_pass if self._may_expand(node))
        groups = () if by_tags else tuple(islice(self._world_groups(), MAX_WORLD_GROUPS + 1))
        above = Proof.NONE if upper == inf else Proof.STRAIGHT
        return Bounds(
            lower=least if least - lower <= NEAR_COST else lower,
            upper=largest if upper - largest <= NEAR_COST else upper,
            lower_proof=Proof.EXACT if least - lower <= NEAR_COST else Proof.OUTER,
            upper_proof=Proof.EXACT if upper - largest <= NEAR_COST else above,
            least_found=least,
            largest_found=largest,
            complete=whole.whole,
            segments=self._tree.segments,
            cut=self._cut,
            unfinished=self._unfinished,
            unlisted=bool(self._others),
            can_fail=whole.fails,
            cheapest=self._attaining_leaf("low"),
            most_expensive=self._attaining_leaf("high"),
            groups=groups if len(groups) <= MAX_WORLD_GROUPS else (),
        )
