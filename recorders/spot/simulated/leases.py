"""Simulated leases: one tree (body over mobility, full-arm and gripper), as on a Spot.

A lease is a sequence of numbers that only grows; requests with an older one are refused
(bosdyn.client.lease.Lease). An owner that is silent for STALE_S seconds of wall time loses exclusivity.
"""

from __future__ import annotations

import time
import uuid
from dataclasses import dataclass, field

from bosdyn.api import lease_pb2
from bosdyn.client.lease import Lease

STALE_S = 20.0
ROOT = "body"
PARTS = ("mobility", "full-arm", "arm", "gripper")


@dataclass(slots=True)
class LeaseBook:
    """The lease of the whole body, which includes its parts."""

    epoch: str = field(default_factory=lambda: uuid.uuid4().hex[:16])
    number: int = 0
    owner: lease_pb2.LeaseOwner | None = None
    latest: lease_pb2.Lease | None = None
    heard_s: float = 0.0

    @property
    def is_free(self) -> bool:
        return self.owner is None or time.monotonic() - self.heard_s > STALE_S

    def grant(self, client_name: str) -> lease_pb2.Lease:
        """Grant a newer lease to a client."""
        self.number += 1
        self.latest = lease_pb2.Lease(
            resource=ROOT, epoch=self.epoch, sequence=[self.number], client_names=[client_name]
        )
        self.owner = lease_pb2.LeaseOwner(client_name=client_name, user_name="user")
        self.heard_s = time.monotonic()
        return self.latest

    def give_back(self, lease: lease_pb2.Lease) -> bool:
        """End the ownership; False if the lease is not the active one."""
        if self.owner is None or not self._is_current(lease):
            return False
        self.number += 1
        self.owner, self.latest = None, None
        return True

    def use(self, lease: lease_pb2.Lease) -> lease_pb2.LeaseUseResult:
        """Whether a request with this lease is allowed."""
        result = lease_pb2.LeaseUseResult(attempted_lease=lease)
        if self.owner is not None:
            result.owner.CopyFrom(self.owner)
        if not lease.resource or not lease.sequence:
            result.status = lease_pb2.LeaseUseResult.STATUS_INVALID_LEASE
        elif lease.epoch != self.epoch:
            result.status = lease_pb2.LeaseUseResult.STATUS_WRONG_EPOCH
        elif lease.resource != ROOT and lease.resource not in PARTS:
            result.status = lease_pb2.LeaseUseResult.STATUS_UNMANAGED
        elif self.owner is None:
            result.status = lease_pb2.LeaseUseResult.STATUS_REVOKED
        elif self._is_current(lease):
            result.status = lease_pb2.LeaseUseResult.STATUS_OK
            self.heard_s = time.monotonic()
        else:
            result.status = lease_pb2.LeaseUseResult.STATUS_OLDER
        if self.latest is not None:
            result.latest_known_lease.CopyFrom(self.latest)
        return result

    def _is_current(self, lease: lease_pb2.Lease) -> bool:
        if self.latest is None or not lease.sequence:
            return False
        compared = Lease(lease, ignore_is_valid_check=True).compare(
            Lease(self.latest, ignore_is_valid_check=True), ignore_resources=True
        )
        return compared in (Lease.CompareResult.SAME, Lease.CompareResult.SUB_LEASE)
