"""The settings of a run as the attachment "settings.json": action costs and further choices."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import msgspec

from workbench.errors import Malformed
from workbench.search.costs import ActionCosts

SETTINGS_ATTACHMENT = "settings.json"


class MalformedSettings(Malformed):
    """The attachment settings.json is invalid."""

    def __init__(self, reason: str) -> None:
        super().__init__(f"{SETTINGS_ATTACHMENT} holds no settings: {reason}. Run lios doctor on the log.")


class Settings(msgspec.Struct, frozen=True, kw_only=True):
    """Action costs, and free-form information about how the run was made."""

    costs: ActionCosts
    more: dict[str, Any] = {}


def settings_to_json(costs: ActionCosts, more: Mapping[str, Any] | None = None) -> bytes:
    return msgspec.json.encode(Settings(costs=costs, more=dict(more or {})), order="deterministic")


def settings_from_json(data: bytes | str) -> Settings:
    """Decode the attachment.

    Raises:
        MalformedSettings: not JSON, or not settings.
    """
    try:
        return msgspec.json.decode(data, type=Settings)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise MalformedSettings(str(error)) from error


def identity_in(settings: bytes) -> dict[str, str]:
    """The run's identity as metadata, which settings.json repeats under its own checksum; empty where it does not."""
    try:
        pairs = settings_from_json(settings).more.get("run")
    except MalformedSettings:
        return {}
    return {str(key): str(value) for key, value in pairs.items()} if isinstance(pairs, dict) else {}
