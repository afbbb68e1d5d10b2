"""Tags that count when seen in passing, in a run's settings: within which distance, and in what furniture."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import msgspec

from workbench.errors import LiosError
from workbench.log_schema.place import Place
from workbench.log_schema.settings_json import MalformedSettings
from workbench.worlds.house import ContainerId
from workbench.worlds.sight.lines_of_sight import checked_radius
from workbench.worlds.sight.tags_in_passing import TagsInPassing

SETTING = "tags_in_passing"
"""The key among a run's settings; left out where tags in passing do not count."""


class _Stored(msgspec.Struct, frozen=True, kw_only=True):
    radius_m: float
    containers: tuple[str, ...]


def tags_to_settings(tags: TagsInPassing | None) -> dict[str, Any]:
    """The entry for a run's settings; empty where tags in passing do not count."""
    if tags is None:
        return {}
    return {SETTING: msgspec.to_builtins(_Stored(radius_m=tags.radius_m, containers=tags.containers))}


def tags_from_settings(settings: Mapping[str, Any], place: Place) -> TagsInPassing | None:
    """The ways of a robot for which tags in passing counted; None where a run's settings do not say so.

    Raises:
        MalformedSettings: the entry is invalid.
    """
    if SETTING not in settings:
        return None
    try:
        stored = msgspec.convert(settings[SETTING], _Stored)
        radius_m = checked_radius(stored.radius_m)
    except (msgspec.ValidationError, LiosError) as error:
        raise MalformedSettings(f"{SETTING}: {error}") from error
    return tags_of(place, radius_m, tuple(ContainerId(c) for c in stored.containers)) if radius_m else None


def tags_of(place: Place, radius_m: float, containers: tuple[ContainerId, ...]) -> TagsInPassing:
    """The ways of a robot in a logged place for which tags in these containers count."""
    return TagsInPassing(place.plan, place.travel, place.paths(), radius_m, containers)
