"""The sight of a run in its settings: how far the robot saw open furniture in passing."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import msgspec

from workbench.errors import LiosError
from workbench.log_schema.settings_json import MalformedSettings
from workbench.worlds.sight.lines_of_sight import checked_radius

SETTING = "sight"
"""The key among a run's settings; left out where nothing is seen in passing."""


class _Stored(msgspec.Struct, frozen=True, kw_only=True):
    radius_m: float


def sight_to_settings(radius_m: float) -> dict[str, Any]:
    """The entry for a run's settings; empty where nothing is seen in passing."""
    return {SETTING: msgspec.to_builtins(_Stored(radius_m=radius_m))} if radius_m else {}


def sight_from_settings(settings: Mapping[str, Any]) -> float:
    """The sight radius in metres that a run's settings name; 0 where they name none.

    Raises:
        MalformedSettings: the entry is invalid.
    """
    if SETTING not in settings:
        return 0.0
    try:
        return checked_radius(msgspec.convert(settings[SETTING], _Stored).radius_m)
    except (msgspec.ValidationError, LiosError) as error:
        raise MalformedSettings(f"{SETTING}: {error}") from error
