"""The perception of a run in its settings: the detection probabilities that the robot assumed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import msgspec

from workbench.errors import LiosError
from workbench.log_schema.settings_json import MalformedSettings
from workbench.worlds.house import ItemType
from workbench.worlds.perception import PERFECT, Perception, Source

SETTING = "perception"
"""The key among a run's settings; left out where looks show everything."""


class _Stored(msgspec.Struct, frozen=True, kw_only=True):
    p_detect: float
    by_type: dict[str, float] = {}
    source: Source = "assumed"
    detector: str = ""


def perception_to_settings(perception: Perception) -> dict[str, Any]:
    """The entry for a run's settings; empty where looks show everything."""
    if perception.perfect:
        return {}
    stored = _Stored(
        p_detect=perception.p_detect,
        by_type={str(t): p for t, p in sorted(perception.by_type.items())},
        source=perception.source,
        detector=perception.detector,
    )
    return {SETTING: msgspec.to_builtins(stored)}


def perception_from_settings(settings: Mapping[str, Any]) -> Perception:
    """The perception that a run's settings name; perfect where they name none.

    Raises:
        MalformedSettings: the entry is invalid.
    """
    if SETTING not in settings:
        return PERFECT
    try:
        stored = msgspec.convert(settings[SETTING], _Stored)
        return Perception(
            p_detect=stored.p_detect,
            by_type={ItemType(t): p for t, p in stored.by_type.items()},
            source=stored.source,
            detector=stored.detector,
        )
    except (msgspec.ValidationError, LiosError) as error:
        raise MalformedSettings(f"{SETTING}: {error}") from error
