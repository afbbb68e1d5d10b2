"""What can go wrong with a robot? The failures that a simulated one can be told to have, now or at a given time.

Written `KIND@SECONDS` or `KIND@SECONDS+DURATION`, seconds of the body's life:

    lost-lease@30         another client takes the body's lease
    lost-localization@30  GraphNav does not know where it is (for DURATION, else until it is set again)
    stuck@30+10           something stands in the way
    tag-not-seen@0        no fiducial is detected
    dropped@30+3          the network is gone; the server comes back on the same port
    estop@30              someone presses the emergency stop
    clock-skew@0+2.5      the robot's clock is ahead by DURATION seconds
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

from workbench.errors import BadValue


class FaultKind(StrEnum):
    LOST_LEASE = "lost-lease"
    LOST_LOCALIZATION = "lost-localization"
    STUCK = "stuck"
    TAG_NOT_SEEN = "tag-not-seen"
    DROPPED = "dropped"
    ESTOP = "estop"
    CLOCK_SKEW = "clock-skew"


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """One failure.

    Attributes:
        at_s: seconds of the body's life at which it begins.
        for_s: how long it lasts; None for what does not end by itself. For clock-skew, the seconds of skew.
    """

    kind: FaultKind
    at_s: float = 0.0
    for_s: float | None = None


_WRITTEN = re.compile(r"(?P<kind>[a-z-]+)(@(?P<at>\d+(\.\d+)?))?(\+(?P<long>-?\d+(\.\d+)?))?")


def read_faults(texts: Iterable[str]) -> tuple[Fault, ...]:
    """Faults as they are written on a command line, in the order of their time.

    Raises:
        BadValue: a kind that is not known, or not of the form KIND@SECONDS+DURATION.
    """
    faults: list[Fault] = []
    kinds = [kind.value for kind in FaultKind]
    for text in texts:
        match = _WRITTEN.fullmatch(text.strip())
        if match is None or match["kind"] not in kinds:
            raise BadValue("fault", text, f"KIND@SECONDS or KIND@SECONDS+DURATION with a kind of {', '.join(kinds)}")
        lasts = None if match["long"] is None else float(match["long"])
        faults.append(Fault(kind=FaultKind(match["kind"]), at_s=float(match["at"] or 0.0), for_s=lasts))
    return tuple(sorted(faults, key=lambda fault: (fault.at_s, fault.kind)))
