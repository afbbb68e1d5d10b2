"""Whose beliefs replays follow, in names: one strategy with two estimators is two planners."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from types import MappingProxyType

import msgspec

from replayers.batch.store import StoredReplay


def estimator_labels(names: Iterable[str]) -> Mapping[str, str]:
    """What estimators are called in tables: without the hash of their weights, where no other one is called so."""
    distinct = tuple(dict.fromkeys(names))
    short = Counter(name.partition("@")[0] for name in distinct)
    return MappingProxyType({n: n.partition("@")[0] if short[n.partition("@")[0]] == 1 else n for n in distinct})


def estimators_in(replays: Iterable[StoredReplay]) -> tuple[str, ...]:
    """The estimators whose beliefs replays followed, sorted; without those of replays that were stored without."""
    return tuple(sorted({r.estimator for r in replays if r.estimator}))


def named_by_estimator(replays: Iterable[StoredReplay]) -> tuple[StoredReplay, ...]:
    """Replays whose strategies are called STRATEGY by ESTIMATOR, where they follow the beliefs of several."""
    listed = tuple(replays)
    labels = estimator_labels(estimators_in(listed))
    if len(labels) < 2:
        return listed
    return tuple(
        msgspec.structs.replace(r, strategy=f"{r.strategy} by {labels[r.estimator]}") if r.estimator else r
        for r in listed
    )
