"""Containers that none of several runs opened: their contents are in no log, and replays stay uncertain there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dashboards.model.timeline import NEVER, Timeline
from workbench.arrays import Bools

REPLAY = "replay"


def unopened(timelines: Sequence[Timeline]) -> Bools:
    """For each container of the first run's place, whether none of these runs saw its contents; bool (n,).

    All are False unless a replay is among the runs: in a single run, colours show the same.
    """
    if not timelines:
        return np.zeros(0, dtype=np.bool_)
    plan = timelines[0].plan
    if not any(t.run.info.source == REPLAY for t in timelines):
        return np.zeros(len(plan.containers), dtype=np.bool_)
    here = [t for t in timelines if t.plan == plan]
    return np.all([(t.searched_ns == NEVER) & ~t.known for t in here], axis=0)
