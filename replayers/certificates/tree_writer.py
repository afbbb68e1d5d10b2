"""Writes out the tree of a strategy's runs branch by branch, for its certificate.

A branch that is not followed gets an outer bound of its own, whose arithmetic is plain: what was spent on the way to
it is the least that it can cost, or the failure cost if that is less. Where all branches are too many, one that comes
to a state in which another was before is said to go on as that one does.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import inf
from typing import Literal, final

from msgspec import structs

from replayers.certificates.claim import (
    BELIEFS,
    NOT_FOLLOWED,
    UNLISTED,
    ClaimedAnswer,
    ClaimedBound,
    ClaimedEnd,
    ClaimedItem,
    ClaimedLook,
    ClaimedNode,
    ClaimedOuter,
    ClaimedStep,
)
from replayers.certificates.known_state import KnownState, state_at_start
from replayers.counterfactual.relevance import Answer, imputed_items
from replayers.counterfactual.run_tree import Node, RunTree
from workbench.errors import Unsupported
from workbench.execution.events import ActionEnded, RunStatus
from workbench.planning.tasks import AllOf, AnyOf, Goal


class NotCertifiable(Unsupported):
    """A log or a strategy that certificates do not cover."""

    def __init__(self, log: str, why: str) -> None:
        super().__init__(f"{log}: {why}, and certificates do not cover that. Use lios replay: its bounds do.")


World = Mapping[str, Answer]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Reached:
    """How one branch ends: with the goal met, failed, or not followed; with what was spent and what was answered."""

    kind: Literal["done", "failed", "outer"]
    spent: float
    world: World

    def cost(self, failure: float, *, low: bool) -> float:
        if self.kind == "failed":
            return failure
        if self.kind == "outer":
            return min(self.spent, failure) if low else inf
        return self.spent


@dataclass(frozen=True, slots=True, kw_only=True)
class _Written:
    """A branch that was written out: where it began, and those of its ends that can be the least or the greatest."""

    number: int
    needs: frozenset[str]
    begun: Hashable
    spent: float
    world: World
    reached: tuple[_Reached, ...]
    branches: int


@final
@dataclass(slots=True, kw_only=True)
class TreeWriter:
    """Writes out a tree of runs, and keeps how its branches end.

    Attributes:
        left: how many more branches are written out.
        shares: whether a branch may go on as another does.
        named: the branches that others go on as, with how many do, known from writing the tree once before.
        branches: the number of branches in all, those that go on as others do counted one by one.
    """

    tree: RunTree
    left: int
    shares: bool
    named: Mapping[int, int] = field(default_factory=dict[int, int])
    branches: int = 0
    reached: list[_Reached] = field(default_factory=list[_Reached])
    repeated: Counter[int] = field(default_factory=Counter[int])
    written: dict[int, list[_Written]] = field(default_factory=dict[int, list[_Written]])
    count: int = 0
    used: set[str] = field(default_factory=set[str])
    steps: dict[int, tuple[ClaimedStep, ...]] = field(default_factory=dict[int, tuple[ClaimedStep, ...]])

    @property
    def failure(self) -> float:
        return self.tree.evidence.task.failure_cost

    def root(self) -> ClaimedNode:
        return self._node(self.tree.root, 0.0, {}, state_at_start(self.tree.evidence))

    def bound(self, *, low: bool) -> ClaimedBound:
        """The least, or the greatest, over all branches; a leaf's where one has it."""
        ends = [one.cost(self.failure, low=low) for one in self.reached]
        cost = min(ends) if low else max(ends)
        if cost == inf:
            return ClaimedBound(cost=None, kind="outer", world=None, path=None)
        at = zip(self.reached, ends, strict=True)
        leaf = next((one for one, end in at if one.kind != "outer" and end == cost), None)
        if leaf is None:
            return ClaimedBound(cost=cost, kind="outer", world=None, path=None)
        return ClaimedBound(cost=cost, kind="leaf", world=dict(leaf.world), path=self._path_in(leaf.world))

    def _path_in(self, world: World) -> tuple[int, ...]:
        """The numbers of the answers that a world gives, one after the other."""
        path, node = list[int](), self.tree.root
        while (unobserved := self.tree.advance(node).unobserved) is not None:
            answer = world[unobserved.container]
            path.append(unobserved.options.index(answer))
            node = self.tree.child(node, answer)
        return tuple(path)

    def _node(self, node: Node, spent: float, world: World, state: KnownState) -> ClaimedNode:
        among = self.written.setdefault(id(node), []) if self.shares else []
        before = next((one for one in among if self._key(node, state, one.needs) == one.begun), None)
        if before is not None:
            self.repeated[before.number] += 1
            self.used |= before.needs
            self.reached += [_rebased(one, before, spent, world) for one in before.reached]
            self.branches += before.branches
            return ClaimedNode(same=before.number)
        start, count, used, self.used = len(self.reached), self.branches, self.used, set()
        made = self._written_out(node, spent, world, state)
        needs = frozenset(self.used & state.items.keys())
        self.used |= used
        if not self.shares or made.outer is not None:
            return made
        self.count += 1
        done = _Written(
            number=self.count,
            needs=needs,
            begun=self._key(node, state, needs),
            spent=spent,
            world=world,
            reached=_extremes(self.reached[start:]),
            branches=self.branches - count,
        )
        among.append(done)
        times = self.named.get(done.number)
        if times is None:
            return made
        return structs.replace(made, id=done.number, times=times, needs=tuple(sorted(needs)))

    def _written_out(self, node: Node, spent: float, world: World, state: KnownState) -> ClaimedNode:
        if self.left <= 0:
            return ClaimedNode(outer=self._outer(spent, world, NOT_FOLLOWED))
        if not self.tree.certain(node):
            return ClaimedNode(outer=self._outer(spent, world, BELIEFS))
        segment = self.tree.advance(node)
        steps = self._steps(node)
        self.used.update(item for step in steps for item in step.items)
        spent += sum(step.cost for step in steps)
        if segment.ended is not None:
            self._end(RunStatus(segment.ended.status), segment.ended.reason)
            self.reached.append(_Reached(kind="done" if segment.done else "failed", spent=spent, world=world))
            charged = spent if segment.done else self.failure
            return ClaimedNode(steps=steps, end=ClaimedEnd(done=segment.done, charged=charged))
        return ClaimedNode(steps=steps, look=self._look(node, spent, world, state.after(steps)))

    def _look(self, node: Node, spent: float, world: World, state: KnownState) -> ClaimedLook:
        unobserved = self.tree.advance(node).unobserved
        assert unobserved is not None, "a segment ends or asks"
        cost, container = self.tree.evidence.costs.search, unobserved.container
        spent += cost
        answers: list[ClaimedAnswer] = []
        for answer in unobserved.options:
            items = tuple(ClaimedItem(id=i.id, type=i.type) for i in imputed_items(answer, container))
            after, known = self.tree.child(node, answer), state.answered(container, items)
            then = self._node(after, spent, {**world, container: answer}, known)
            answers.append(ClaimedAnswer(items=items, then=then))
        others = self._outer(spent, world, UNLISTED) if unobserved.others else None
        return ClaimedLook(
            container=container, live=unobserved.live, cost=cost, answers=tuple(answers), others=others
        )

    def _end(self, status: RunStatus, reason: str) -> None:
        self.left -= 1
        self.branches += 1
        if status is RunStatus.PLANNER_FAILED:
            why = f"{self.tree.strategy.name} breaks in some world ({reason})"
            raise NotCertifiable(self.tree.evidence.path, why)

    def _outer(self, spent: float, world: World, why: str) -> ClaimedOuter:
        self.left -= 1
        self.branches += 1
        self.reached.append(_Reached(kind="outer", spent=spent, world=world))
        return ClaimedOuter(least=min(spent, self.failure), why=why)

    def _key(self, node: Node, state: KnownState, needs: frozenset[str]) -> Hashable:
        relevance, evidence = self.tree.relevance, self.tree.evidence
        sure = (relevance.must_exist - evidence.seen_types()) & set(relevance.live(node.knowledge))
        return state.key(needs, _wanted(evidence.task.goal), sure)

    def _steps(self, node: Node) -> tuple[ClaimedStep, ...]:
        found = self.steps.get(id(node))
        if found is None:
            found = self.steps[id(node)] = tuple(self._run(node))
        return found

    def _run(self, node: Node) -> Iterator[ClaimedStep]:
        for event in self.tree.segment_events(node):
            if isinstance(event, ActionEnded):
                step = event.step
                yield ClaimedStep(
                    action=step.action,
                    origin=step.origin,
                    target=step.target,
                    items=tuple(event.items),
                    cost=float(event.cost),
                )


def written_tree(tree: RunTree, max_branches: int) -> tuple[TreeWriter, ClaimedNode]:
    """The tree written out: every branch if they are not more than max_branches, else each state once."""
    first = TreeWriter(tree=tree, left=max_branches, shares=True)
    root = first.root()
    if not first.repeated:
        return first, root
    if first.branches <= max_branches:
        again = TreeWriter(tree=tree, left=max_branches, shares=False, steps=first.steps)
    else:
        named = dict(first.repeated)
        again = TreeWriter(tree=tree, left=max_branches, shares=True, named=named, steps=first.steps)
    return again, again.root()


def _wanted(goal: Goal) -> frozenset[tuple[str, str]]:
    """The item types that a goal wants somewhere, with where."""
    if isinstance(goal, AllOf | AnyOf):
        return frozenset().union(*map(_wanted, goal.parts))
    return frozenset({(goal.item_type, goal.at)})


def _rebased(one: _Reached, before: _Written, spent: float, world: World) -> _Reached:
    """How a branch ends that goes on as another did from its own start."""
    since = {container: answer for container, answer in one.world.items() if container not in before.world}
    return replace(one, spent=one.spent + spent - before.spent, world={**world, **since})


def _extremes(reached: Sequence[_Reached]) -> tuple[_Reached, ...]:
    """Of each kind of end, the ones of least and of greatest cost."""
    kinds = [[one for one in reached if one.kind == kind] for kind in ("done", "failed", "outer")]
    return tuple(pick(some, key=lambda one: one.spent) for some in kinds if some for pick in (min, max))
