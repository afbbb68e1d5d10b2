"""Encapsulations of CDR, the encoding of ROS 2's messages (OMG DDSI-RTPS 2.5, 10.2; DDS-XTypes 1.3, 7.6.2)."""

from __future__ import annotations

from collections.abc import Mapping

PLAIN = frozenset({0x0000, 0x0001})
"""Plain CDR, big and little endian: what ROS 2 writes, and what decoders here read."""
OTHERS: Mapping[int, str] = {
    0x0002: "parameter lists",
    0x0003: "parameter lists",
    0x0006: "XCDR2",
    0x0007: "XCDR2",
    0x0008: "XCDR2, delimited",
    0x0009: "XCDR2, delimited",
    0x000A: "XCDR2, parameter lists",
    0x000B: "XCDR2, parameter lists",
}


class NotPlainCdr(ValueError):
    """A message in an encapsulation that places its fields otherwise, so that a decoder would misread it."""


def require_plain_cdr(data: bytes) -> None:
    """Refuses a message that is not in plain CDR.

    Raises:
        NotPlainCdr: it is in another encapsulation, or too short to name one.
    """
    if len(data) < 4:
        raise NotPlainCdr(f"it has {len(data)} bytes, and the head of CDR has 4")
    number = int.from_bytes(data[:2], "big")
    if number not in PLAIN:
        name = OTHERS.get(number, "an unknown encapsulation")
        raise NotPlainCdr(f"it is encoded as {name} ({number:#06x}), and only plain CDR is read")
