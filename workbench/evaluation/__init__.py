"""Trials, tables and statistics of evaluations, run on one machine or on a cluster.

from workbench.evaluation import SearchRequest, evaluate
evaluate(SearchRequest(policies=("lios",), queries="20")).frame
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from workbench.evaluation.beliefs.report import BeliefRequest
    from workbench.evaluation.evaluations import Evaluation, evaluate
    from workbench.evaluation.search.report import SearchRequest
    from workbench.evaluation.tasks.experiment import TaskRequest

_WHERE = {
    "BeliefRequest": "workbench.evaluation.beliefs.report",
    "Evaluation": "workbench.evaluation.evaluations",
    "SearchRequest": "workbench.evaluation.search.report",
    "TaskRequest": "workbench.evaluation.tasks.experiment",
    "evaluate": "workbench.evaluation.evaluations",
}

__all__ = ["BeliefRequest", "Evaluation", "SearchRequest", "TaskRequest", "evaluate"]


def __getattr__(name: str) -> Any:
    """Imports a public name on first use, so that the commands stay light."""
    if name not in _WHERE:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_WHERE[name]), name)
