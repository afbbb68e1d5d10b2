"""TLS certificates of the simulated robot, created anew for every server.

bosdyn-client speaks only TLS and checks the server's name against the authorities of the robot (auth.spot.robot and
others). The simulated robot therefore creates a self-signed certificate (X.509 v3, ECDSA over P-256, RFC 5280 and
5480) with the standard library alone. Its key exists only as long as the process and protects nothing, since the
server listens on loopback.
"""

from __future__ import annotations

import base64
import hashlib
import secrets
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

P = 2**256 - 2**224 + 2**192 + 2**96 - 1
N = 0xFFFFFFFF00000000FFFFFFFFFFFFFFFFBCE6FAADA7179E84F3B9CAC2FC632551
G = (
    0x6B17D1F2E12C4247F8BCE6E563A440F277037D812DEB33A0F4A13945D898C296,
    0x4FE342E2FE1A7F9B8EE7EB4A7C0F9E162BCE33576B315ECECBB6406837BF51F5,
)
"""The curve P-256 (FIPS 186-4, D.1.2.3): field, order, generator."""

Spot = tuple[int, int] | None
"""A point of the curve; None is the one at infinity."""

OID_COMMON_NAME = (2, 5, 4, 3)
OID_ALTERNATIVE_NAMES = (2, 5, 29, 17)
OID_BASIC_CONSTRAINTS = (2, 5, 29, 19)
OID_EC_PUBLIC_KEY = (1, 2, 840, 10045, 2, 1)
OID_P256 = (1, 2, 840, 10045, 3, 1, 7)
OID_ECDSA_SHA256 = (1, 2, 840, 10045, 4, 3, 2)


@dataclass(frozen=True, slots=True, kw_only=True)
class Identity:
    """A private key and its self-signed certificate, both PEM."""

    key_pem: bytes
    certificate_pem: bytes


def new_identity(names: Sequence[str], *, days: int = 7) -> Identity:
    """A new key with a self-signed certificate, valid for the given DNS names from yesterday on."""
    secret = secrets.randbelow(N - 1) + 1
    public = _times(secret, G)
    assert public is not None
    point = b"\x04" + public[0].to_bytes(32, "big") + public[1].to_bytes(32, "big")
    body = _to_be_signed(names, point, days)
    signature = _sign(secret, body)
    algorithm = _sequence(_oid(OID_ECDSA_SHA256))
    certificate = _sequence(body, algorithm, _bits(signature))
    inner = _sequence(_integer(1), _tagged(0x04, secret.to_bytes(32, "big")), _tagged(0xA1, _bits(point)))
    key = _sequence(_integer(0), _sequence(_oid(OID_EC_PUBLIC_KEY), _oid(OID_P256)), _tagged(0x04, inner))
    return Identity(key_pem=_pem("PRIVATE KEY", key), certificate_pem=_pem("CERTIFICATE", certificate))


def _to_be_signed(names: Sequence[str], point: bytes, days: int) -> bytes:
    now = datetime.now(UTC)
    name = _sequence(_tagged(0x31, _sequence(_oid(OID_COMMON_NAME), _tagged(0x0C, b"simulated spot"))))
    dns = _sequence(*(_tagged(0x82, each.encode("ascii")) for each in names))
    extensions = _sequence(
        _sequence(_oid(OID_BASIC_CONSTRAINTS), _tagged(0x01, b"\xff"), _tagged(0x04, _sequence(_tagged(1, b"\xff")))),
        _sequence(_oid(OID_ALTERNATIVE_NAMES), _tagged(0x04, dns)),
    )
    return _sequence(
        _tagged(0xA0, _integer(2)),
        _integer(secrets.randbits(120) | 1),
        _sequence(_oid(OID_ECDSA_SHA256)),
        name,
        _sequence(_time(now - timedelta(days=1)), _time(now + timedelta(days=days))),
        name,
        _sequence(_sequence(_oid(OID_EC_PUBLIC_KEY), _oid(OID_P256)), _bits(point)),
        _tagged(0xA3, extensions),
    )


def _sign(secret: int, message: bytes) -> bytes:
    """ECDSA with SHA-256 (FIPS 186-4, 6.4)."""
    digest = int.from_bytes(hashlib.sha256(message).digest(), "big")
    while True:
        nonce = secrets.randbelow(N - 1) + 1
        point = _times(nonce, G)
        assert point is not None
        r = point[0] % N
        s = pow(nonce, -1, N) * (digest + r * secret) % N
        if r and s:
            return _sequence(_integer(r), _integer(s))


def _plus(a: Spot, b: Spot) -> Spot:
    if a is None or b is None:
        return a or b
    if a[0] == b[0] and (a[1] + b[1]) % P == 0:
        return None
    slope = (3 * a[0] * a[0] - 3) * pow(2 * a[1], -1, P) if a == b else (b[1] - a[1]) * pow(b[0] - a[0], -1, P)
    x = (slope * slope - a[0] - b[0]) % P
    return (x, (slope * (a[0] - x) - a[1]) % P)


def _times(factor: int, point: Spot) -> Spot:
    total: Spot = None
    while factor:
        if factor & 1:
            total = _plus(total, point)
        point, factor = _plus(point, point), factor >> 1
    return total


def _tagged(tag: int, content: bytes) -> bytes:
    """DER: a tag, the length, the content (X.690, 8.1)."""
    size = len(content)
    if size < 0x80:
        return bytes((tag, size)) + content
    length = size.to_bytes((size.bit_length() + 7) // 8, "big")
    return bytes((tag, 0x80 | len(length))) + length + content


def _sequence(*parts: bytes) -> bytes:
    return _tagged(0x30, b"".join(parts))


def _integer(value: int) -> bytes:
    return _tagged(0x02, value.to_bytes(value.bit_length() // 8 + 1, "big"))


def _bits(content: bytes) -> bytes:
    return _tagged(0x03, b"\x00" + content)


def _oid(arcs: Sequence[int]) -> bytes:
    content = bytearray((arcs[0] * 40 + arcs[1],))
    for arc in arcs[2:]:
        digits = [arc & 0x7F]
        while arc := arc >> 7:
            digits.append(0x80 | (arc & 0x7F))
        content.extend(reversed(digits))
    return _tagged(0x06, bytes(content))


def _time(moment: datetime) -> bytes:
    return _tagged(0x17, moment.strftime("%y%m%d%H%M%SZ").encode("ascii"))


def _pem(label: str, content: bytes) -> bytes:
    text = base64.b64encode(content).decode("ascii")
    lines = "\n".join(text[i : i + 64] for i in range(0, len(text), 64))
    return f"-----BEGIN {label}-----\n{lines}\n-----END {label}-----\n".encode("ascii")
