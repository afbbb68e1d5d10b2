"""Simulated emergency-stop endpoints, which must check in regularly for the motors to run (Spot SDK, "E-Stop").

An endpoint answers each challenge with its complement; one that is silent for its timeout stops the robot. Timeouts
use wall time, independent of body time.
"""

from __future__ import annotations

import itertools
import time
from dataclasses import dataclass, field

from bosdyn.api import estop_pb2

CUT, NONE = estop_pb2.ESTOP_LEVEL_CUT, estop_pb2.ESTOP_LEVEL_NONE


@dataclass(slots=True)
class Endpoint:
    """One registered emergency-stop endpoint, with its last check-in."""

    proto: estop_pb2.EstopEndpoint
    level: estop_pb2.EstopStopLevel.ValueType = CUT
    challenge: int = 1
    heard_s: float = 0.0

    @property
    def allows(self) -> bool:
        timeout = self.proto.timeout.seconds + self.proto.timeout.nanos * 1e-9
        return self.level == NONE and time.monotonic() - self.heard_s <= timeout


@dataclass(slots=True)
class EstopBoard:
    """The configuration and its endpoints.

    Attributes:
        open_without_endpoints: a robot without endpoints reports ESTOP_LEVEL_NONE and lets its motors run.
    """

    config_id: str = "config-1"
    endpoints: dict[str, Endpoint] = field(default_factory=dict)
    pressed: bool = False
    open_without_endpoints: bool = True
    _count: itertools.count[int] = field(default_factory=lambda: itertools.count(2))

    @property
    def stopped(self) -> bool:
        if not self.endpoints:
            return self.pressed or not self.open_without_endpoints
        return self.pressed or not all(e.allows for e in self.endpoints.values())

    def press(self) -> None:
        self.pressed = True

    def release(self) -> None:
        self.pressed = False

    def configure(self, config: estop_pb2.EstopConfig) -> estop_pb2.EstopConfig:
        """Set a new configuration, whose endpoints still have to register."""
        self.config_id = f"config-{next(self._count)}"
        self.endpoints = {}
        for endpoint in config.endpoints:
            self.register(endpoint)
        return self.config()

    def config(self) -> estop_pb2.EstopConfig:
        return estop_pb2.EstopConfig(unique_id=self.config_id, endpoints=[e.proto for e in self.endpoints.values()])

    def register(self, endpoint: estop_pb2.EstopEndpoint) -> estop_pb2.EstopEndpoint:
        kept = estop_pb2.EstopEndpoint()
        kept.CopyFrom(endpoint)
        kept.unique_id = endpoint.unique_id or f"endpoint-{next(self._count)}"
        self.endpoints[kept.unique_id] = Endpoint(kept)
        return kept

    def deregister(self, unique_id: str) -> bool:
        return self.endpoints.pop(unique_id, None) is not None

    def check_in(
        self, request: estop_pb2.EstopCheckInRequest
    ) -> tuple[estop_pb2.EstopCheckInResponse.Status.ValueType, int]:
        """The status and the next challenge."""
        endpoint = self.endpoints.get(request.endpoint.unique_id)
        if endpoint is None:
            return estop_pb2.EstopCheckInResponse.STATUS_ENDPOINT_UNKNOWN, 0
        right = request.response == (~endpoint.challenge) & 0xFFFFFFFFFFFFFFFF
        endpoint.challenge = next(self._count) * 7919
        if not right:
            return estop_pb2.EstopCheckInResponse.STATUS_INCORRECT_CHALLENGE_RESPONSE, endpoint.challenge
        endpoint.level, endpoint.heard_s = request.stop_level, time.monotonic()
        return estop_pb2.EstopCheckInResponse.STATUS_OK, endpoint.challenge

    def status(self) -> estop_pb2.EstopSystemStatus:
        return estop_pb2.EstopSystemStatus(
            stop_level=CUT if self.stopped else NONE,
            stop_level_details="pressed" if self.pressed else "",
            endpoints=[
                estop_pb2.EstopEndpointWithStatus(endpoint=e.proto, stop_level=e.level)
                for e in self.endpoints.values()
            ],
        )
