"""An evaluation ends where its estimator fails: runs without beliefs measure nothing."""

from __future__ import annotations

from workbench.beliefs.guarded_estimator import EstimatorFailed
from workbench.errors import Unsupported
from workbench.execution.events import RunEnded, RunStatus


class RunWithoutBeliefs(Unsupported):
    """The estimator of a run gave no belief; the message is the estimator's own."""


ESTIMATOR_FAULTS = (EstimatorFailed, RunWithoutBeliefs)
"""What ends an evaluation where other errors of a house or a trial only skip it."""


def require_beliefs(ended: RunEnded) -> RunEnded:
    """The end of a run, which the estimator did not bring about.

    Raises:
        RunWithoutBeliefs: it did.
    """
    if ended.status is RunStatus.ESTIMATOR_FAILED:
        raise RunWithoutBeliefs(ended.reason)
    return ended
