"""Certificates for servers on loopback: an authority and a server certificate, created for every server.

The simulated Spot needs one because bosdyn-client speaks only TLS and checks the server's name against the
authorities of the robot (auth.spot.robot and others); the viewers' server, so that only our own relay can talk to it.
The keys live as long as the process.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

from workbench.errors import MissingExtra

VALID_DAYS = 7


@dataclass(frozen=True, slots=True, kw_only=True)
class Identity:
    """What a server shows and what its clients trust, all PEM: its private key, its chain, the authority's root."""

    key_pem: bytes
    chain_pem: bytes
    root_pem: bytes


def new_identity(names: Sequence[str], *, needed_by: str = "A simulated Spot", extra: str = "spot") -> Identity:
    """A fresh key and a certificate that is valid for the given DNS names for VALID_DAYS, under a root of its own.

    Args:
        needed_by, extra: what the error names if trustme is missing, and which extra brings it.

    Raises:
        MissingExtra: trustme is not installed.
    """
    try:
        import trustme
    except ImportError as error:
        raise MissingExtra(needed_by, extra) from error
    root = trustme.CA()
    issued = root.issue_cert(*names, not_after=datetime.now(UTC) + timedelta(days=VALID_DAYS))
    chain = b"".join(blob.bytes() for blob in issued.cert_chain_pems)
    return Identity(key_pem=issued.private_key_pem.bytes(), chain_pem=chain, root_pem=root.cert_pem.bytes())
