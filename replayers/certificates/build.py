"""Builds the certificate of a strategy over one log: the tree of its runs, written out branch by branch.

Only what a checker can follow with the log and little code is certified: whole logs without refused actions, and
finds and plain deliveries. A branch that is not followed gets an outer bound of its own, whose arithmetic is plain:
what was spent on the way to it is the least that it can cost, or the failure cost if that is less.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from math import inf
from typing import final

from recorders.code_revision import revision
from replayers.certificates.claim import (
    ClaimedAnswer,
    ClaimedBound,
    ClaimedEnd,
    ClaimedItem,
    ClaimedLook,
    ClaimedNode,
    ClaimedOuter,
    ClaimedStep,
    CostClaim,
)
from replayers.counterfactual.evidence import Evidence
from replayers.counterfactual.prepared_log import PreparedLog
from replayers.counterfactual.relevance import Assumptions, imputed_items
from replayers.counterfactual.replay import run_tree_of
from replayers.counterfactual.run_tree import Node, RunTree
from replayers.log_tools.log_paths import shown
from workbench import __version__
from workbench.errors import Unsupported
from workbench.execution.events import ActionEnded, RunStatus
from workbench.planning.actions import prepares
from workbench.planning.strategy import Strategy

MAX_BRANCHES = 5000
"""Number of branches to write out; the others get outer bounds."""

SHORT = 12
"""Digits of a revision in a certificate."""


class NotCertifiable(Unsupported):
    """A log or a strategy that certificates do not cover."""

    def __init__(self, log: str, why: str) -> None:
        super().__init__(f"{log}: {why}, and certificates do not cover that. Use lios replay: its bounds do.")


def certificate(prepared: PreparedLog, planner: Strategy, *, max_branches: int = MAX_BRANCHES) -> CostClaim:
    """The certificate of a strategy over a prepared log.

    Raises:
        NotCertifiable: a log that is not whole or shows refused actions, or a goal with preparations; or a strategy
            that breaks in some world.
    """
    evidence = prepared.evidence
    _require_plain(prepared, evidence)
    tree, failure = run_tree_of(prepared, planner), evidence.task.failure_cost
    writer = _TreeWriter(tree=tree, left=max_branches, failure=failure)
    root = writer.node(tree.root, 0.0, {})
    if tree.ambiguous:
        writer = _TreeWriter(tree=tree.with_all_items(), left=max_branches, failure=failure)
        root = writer.node(writer.tree.root, 0.0, {})
    return CostClaim(
        log=shown(evidence.path.rpartition("/")[2]),
        log_sha256=evidence.sha256,
        strategy=planner.name,
        strategy_version=_version(),
        estimator=prepared.estimator_of(planner).name,
        types=tree.relevance.types,
        failure_cost=evidence.task.failure_cost,
        lower=writer.bound(low=True),
        upper=writer.bound(low=False),
        tree=root,
    )


def _version() -> str:
    """Release and revision, with a plus where the working tree was modified."""
    code = revision()
    return f"{__version__} {code.commit[:SHORT]}{'+' * code.dirty}".strip()


def _require_plain(prepared: PreparedLog, evidence: Evidence) -> None:
    log = evidence.path
    if not prepared.claims:
        raise NotCertifiable(
            log, f"the recorded strategy does not do here what was recorded ({prepared.reproduction.why})"
        )
    if not evidence.complete or evidence.gaps.lost:
        raise NotCertifiable(log, "the log is not whole")
    if evidence.corrections:
        raise NotCertifiable(log, "a person corrected what its looks show")
    if evidence.partly:
        raise NotCertifiable(log, "something was picked up, or seen in passing, in it where no look counts")
    if evidence.imputed:
        raise NotCertifiable(log, "the log is of an imagined world")
    if evidence.misses:
        raise NotCertifiable(log, "looks in it may have missed something")
    if evidence.refused_searches or evidence.refused_moves or evidence.refused_picks:
        raise NotCertifiable(log, "actions were refused in it")
    if prepares(evidence.task.goal):
        raise NotCertifiable(log, "its goal needs preparations")
    if evidence.passing is not None:
        raise NotCertifiable(log, "its robot sees open furniture in passing")
    if evidence.tags is not None:
        raise NotCertifiable(log, "its robot stops for tags that it sees in passing")
    if prepared.settings.assumptions != Assumptions():
        raise NotCertifiable(log, "other assumptions than the usual ones are made")


@dataclass(frozen=True, slots=True, kw_only=True)
class _Reached:
    """What one branch costs in the end; an infinite most is none. world is None for an outer bound."""

    least: float
    most: float
    world: dict[str, tuple[str, ...]] | None


@final
@dataclass(slots=True, kw_only=True)
class _TreeWriter:
    """Writes out a tree of runs branch by branch, and keeps what each costs."""

    tree: RunTree
    left: int
    failure: float
    reached: list[_Reached] = field(default_factory=list[_Reached])
    steps: dict[int, tuple[ClaimedStep, ...]] = field(default_factory=dict[int, tuple[ClaimedStep, ...]])

    def node(self, node: Node, spent: float, world: dict[str, tuple[str, ...]]) -> ClaimedNode:
        if self.left <= 0:
            return ClaimedNode(outer=self._outer(spent, "not followed"))
        if not self.tree.certain(node):
            return ClaimedNode(outer=self._outer(spent, "beliefs are not known here"))
        segment = self.tree.advance(node)
        steps = self._steps(node)
        spent += sum(step.cost for step in steps)
        if segment.ended is not None:
            self.left -= 1
            if segment.ended.status is RunStatus.PLANNER_FAILED:
                why = f"{self.tree.strategy.name} breaks in some world ({segment.ended.reason})"
                raise NotCertifiable(self.tree.evidence.path, why)
            charged = spent if segment.done else self.failure
            self.reached.append(_Reached(least=charged, most=charged, world=world))
            return ClaimedNode(steps=steps, end=ClaimedEnd(done=segment.done, charged=charged))
        unobserved = segment.unobserved
        assert unobserved is not None, "a segment ends or asks"
        cost = self.tree.evidence.costs.search
        spent += cost
        answers = [
            ClaimedAnswer(
                items=tuple(ClaimedItem(id=i.id, type=i.type) for i in imputed_items(answer, unobserved.container)),
                then=self.node(self.tree.child(node, answer), spent, {**world, unobserved.container: answer}),
            )
            for answer in unobserved.options
        ]
        others = self._outer(spent, "more answers than are listed") if unobserved.others else None
        look = ClaimedLook(
            container=unobserved.container, live=unobserved.live, cost=cost, answers=tuple(answers), others=others
        )
        return ClaimedNode(steps=steps, look=look)

    def bound(self, *, low: bool) -> ClaimedBound:
        """The least, or the greatest, over all branches; a leaf's where one has it."""
        ends = [one.least if low else one.most for one in self.reached]
        cost = min(ends) if low else max(ends)
        if cost == inf:
            return ClaimedBound(cost=None, kind="outer", world=None)
        leaf = next(
            (r for r, end in zip(self.reached, ends, strict=True) if r.world is not None and end == cost), None
        )
        return ClaimedBound(cost=cost, kind="leaf" if leaf else "outer", world=leaf.world if leaf else None)

    def _outer(self, spent: float, why: str) -> ClaimedOuter:
        self.left -= 1
        least = min(spent, self.failure)
        self.reached.append(_Reached(least=least, most=inf, world=None))
        return ClaimedOuter(least=least, why=why)

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
