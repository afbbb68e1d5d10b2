"""Calibration of beliefs during searches: predicted and observed success of every look.

Beliefs before a search are evaluated by `lios evaluate belief`. Find costs also depend on beliefs during a search,
after unsuccessful looks, which are evaluated here.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from workbench.evaluation.search.trials import SearchTrial

LOOKS = 5
"""Number of looks that are reported individually; few searches are longer."""


def look_calibration(trials: Sequence[SearchTrial]) -> list[dict[str, Any]]:
    """One row for each policy that uses beliefs, kind of item, and number of the look (from 1).

    `queries` is the number of searches with that look, `said` the mean predicted probability of success, `found`
    the observed share of successes.
    """
    groups: dict[tuple[str, str, int], list[tuple[float, bool]]] = {}
    for trial in trials:
        for k, said in enumerate(trial.said[:LOOKS]):
            found = k + 1 == len(trial.order)
            groups.setdefault((trial.policy, trial.kind, k + 1), []).append((said, found))
    return [
        {
            "policy": policy,
            "kind": kind,
            "look": look,
            "queries": len(group),
            "said": sum(said for said, _ in group) / len(group),
            "found": sum(found for _, found in group) / len(group),
        }
        for (policy, kind, look), group in sorted(groups.items())
    ]
