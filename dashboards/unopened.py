"""Which containers did nobody open? What stands in them no log tells, and replays over it stay uncertain there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from dashboards.timeline import NEVER, Timeline

REPLAY = "replay"


def unopened(timelines: Sequence[Timeline]) -> npt.NDArray[np.bool_]:
    """Per container of the first run's place: none of these runs ever saw into it.

    All are False unless a replay is among the runs: of a single run, colours tell the same.
    """
    if not timelines:
        return np.zeros(0, dtype=np.bool_)
    plan = timelines[0].plan
    if not any(t.run.info.source == REPLAY for t in timelines):
        return np.zeros(len(plan.containers), dtype=np.bool_)
    here = [t for t in timelines if t.plan == plan]
    return np.all([(t.searched_ns == NEVER) & ~t.known for t in here], axis=0)
