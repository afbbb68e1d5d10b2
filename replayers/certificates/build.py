"""Builds the certificate of a strategy over one log: the tree of its runs, written out branch by branch.

Only what a checker can follow with the log and little code is certified: whole logs without refused actions, and
finds and plain deliveries. A branch that is not followed gets an outer bound of its own, whose arithmetic is plain:
what was spent on the way to it is the least that it can cost, or the failure cost if that is less.
"""

from __future__ import annotations

from recorders.code_revision import revision
from replayers.certificates.claim import (
    CostClaim,
)
from replayers.certificates.tree_writer import NotCertifiable, written_tree
from replayers.counterfactual.evidence import Evidence
from replayers.counterfactual.logged_belief import LoggedBelief
from replayers.counterfactual.prepared_log import PreparedLog
from replayers.counterfactual.relevance import Assumptions
from replayers.counterfactual.replay import run_tree_of
from replayers.log_tools.log_paths import shown
from workbench import __version__
from workbench.planning.actions import prepares
from workbench.planning.strategy import Strategy

MAX_BRANCHES = 5000
"""Number of branches to write out; the others get outer bounds."""

SHORT = 12
"""Digits of a revision in a certificate."""


def certificate(prepared: PreparedLog, planner: Strategy, *, max_branches: int = MAX_BRANCHES) -> CostClaim:
    """The certificate of a strategy over a prepared log.

    Raises:
        NotCertifiable: a log that is not whole or shows refused actions, or a goal with preparations; or a strategy
            that breaks in some world.
    """
    evidence = prepared.evidence
    _require_plain(prepared, evidence)
    tree = run_tree_of(prepared, planner)
    writer, root = written_tree(tree, max_branches)
    if tree.ambiguous:
        writer, root = written_tree(tree.with_all_items(), max_branches)
    return CostClaim(
        log=shown(evidence.path.rpartition("/")[2]),
        log_sha256=evidence.sha256,
        strategy=planner.name,
        strategy_version=_version(),
        estimator=_estimator(prepared, planner),
        types=tree.relevance.types,
        failure_cost=evidence.task.failure_cost,
        lower=writer.bound(low=True),
        upper=writer.bound(low=False),
        tree=root,
    )


def _estimator(prepared: PreparedLog, planner: Strategy) -> str:
    """Whose beliefs the strategy goes by; one that would follow what is seen is another where its first belief is
    held."""
    found = prepared.estimator_of(planner)
    held = isinstance(found, LoggedBelief) and not prepared.evidence.static_beliefs
    return f"{found.name} (first belief held)" if held else found.name


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
