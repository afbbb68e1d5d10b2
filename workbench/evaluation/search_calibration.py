"""Do beliefs hold all along a search? Of every look of a policy: the chance that was said, and how often it found.

What is believed before a search can be judged without one (evaluate belief). What is believed in the middle of a
search, after looks that found nothing, is what find costs rest on.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from workbench.evaluation.search_trials import SearchTrial

LOOKS = 5
"""Looks of a search that are told one by one; few searches go on for longer."""


def looks(trials: Sequence[SearchTrial]) -> list[dict[str, Any]]:
    """A row for each policy that believes, kind of item and number of the look, from 1.

    `queries` is how many searches made that look, `said` the mean chance that it finds an instance, `found` the share
    of those searches in which it did.
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
