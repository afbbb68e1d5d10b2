"""Faults of the simulated robot, injected immediately or at a given time.

Written `KIND@SECONDS` or `KIND@SECONDS+DURATION`, in seconds of body time:

    lost-lease@30         another client takes the body's lease
    lost-localization@30  GraphNav does not know where it is (for DURATION, or until it is localised again)
    stuck@30+10           an obstacle blocks the robot
    tag-not-seen@0        no fiducial is detected
    dropped@30+3          the network is down; the server returns on the same port
    estop@30              someone presses the emergency stop
    dropped-item@60       the gripper loses what it holds
    expired-tokens@30     every token is refused until the client logs in again
    no-route@30           GraphNav finds no route; so also constraint-fault, area-callback, overridden, impaired
    clock-skew@0+2.5      the robot's clock is ahead by DURATION seconds
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

from workbench.errors import BadValue


class FaultKind(StrEnum):
    """The faults that can be injected into the simulated robot."""

    LOST_LEASE = "lost-lease"
    LOST_LOCALIZATION = "lost-localization"
    STUCK = "stuck"
    TAG_NOT_SEEN = "tag-not-seen"
    DROPPED = "dropped"
    ESTOP = "estop"
    CLOCK_SKEW = "clock-skew"
    DROPPED_ITEM = "dropped-item"
    EXPIRED_TOKENS = "expired-tokens"
    NO_ROUTE = "no-route"
    CONSTRAINT_FAULT = "constraint-fault"
    AREA_CALLBACK = "area-callback"
    OVERRIDDEN = "overridden"
    IMPAIRED = "impaired"


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """One fault.

    Attributes:
        at_s: start in seconds of body time.
        for_s: duration in seconds; None if it does not end by itself. For clock-skew, the skew in seconds.
    """

    kind: FaultKind
    at_s: float = 0.0
    for_s: float | None = None


_WRITTEN = re.compile(r"(?P<kind>[a-z-]+)(@(?P<at>\d+(\.\d+)?))?(\+(?P<long>-?\d+(\.\d+)?))?")


def read_faults(texts: Iterable[str]) -> tuple[Fault, ...]:
    """Parse faults from the command line; sorted by time.

    Raises:
        BadValue: an unknown kind, or not of the form KIND@SECONDS+DURATION.
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
