"""Names of the metadata records that the log tools write."""

from __future__ import annotations

RECOVERED_METADATA = "lios.recovered"
"""Metadata of every recovered log: the source file, the number of damages, the number of messages saved, how many
messages its index counted ("expected", where it had one), and whether anything was dropped ("lossy")."""
