"""The certificate of the simulated robot: an authority and a server certificate, made anew for every server.

bosdyn-client speaks only TLS and checks the server's name against the authorities of the robot (auth.spot.robot and
others). The keys live as long as the process and protect nothing: the server listens on loopback.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

from workbench.errors import MissingExtra


@dataclass(frozen=True, slots=True, kw_only=True)
class Identity:
    """What a server shows and what its clients trust, all PEM: its private key, its chain, the authority's root."""

    key_pem: bytes
    chain_pem: bytes
    root_pem: bytes


def new_identity(names: Sequence[str], *, days: int = 7) -> Identity:
    """A fresh key and a certificate that is valid for the given DNS names for so many days, under a root of its own.

    Raises:
        MissingExtra: trustme, of the extra "spot", is not installed.
    """
    try:
        import trustme
    except ImportError as error:
        raise MissingExtra("A simulated Spot", "spot") from error
    root = trustme.CA()
    issued = root.issue_cert(*names, not_after=datetime.now(UTC) + timedelta(days=days))
    chain = b"".join(blob.bytes() for blob in issued.cert_chain_pems)
    return Identity(key_pem=issued.private_key_pem.bytes(), chain_pem=chain, root_pem=root.cert_pem.bytes())
