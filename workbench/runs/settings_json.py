"""With which settings was a run made? The attachment "settings.json": action costs and whatever else was chosen."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import msgspec

from workbench.errors import Malformed
from workbench.search.costs import ActionCosts

SETTINGS_ATTACHMENT = "settings.json"


class MalformedSettings(Malformed):
    """An attachment settings.json that holds no settings."""

    def __init__(self, reason: str) -> None:
        super().__init__(f"{SETTINGS_ATTACHMENT} holds no settings: {reason}. Run lios doctor on the log.")


class Settings(msgspec.Struct, frozen=True, kw_only=True):
    """Action costs, and free facts about how the run was made."""

    costs: ActionCosts
    more: dict[str, Any] = {}


def settings_to_json(costs: ActionCosts, more: Mapping[str, Any] | None = None) -> bytes:
    return msgspec.json.encode(Settings(costs=costs, more=dict(more or {})), order="deterministic")


def settings_from_json(data: bytes | str) -> Settings:
    """The settings again.

    Raises:
        MalformedSettings: no JSON, or no settings.
    """
    try:
        return msgspec.json.decode(data, type=Settings)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise MalformedSettings(str(error)) from error
