"""The memory of a run in its settings: what earlier runs saw, as far as the robot remembered it, with its rates.

The log holds all of it, so that a replay needs neither the earlier logs nor the table of rates.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import msgspec

from workbench.beliefs.memory.memory import REARRANGED_BEFORE, Memory, PastLook
from workbench.beliefs.memory.move_rates import MoveRates
from workbench.errors import LiosError
from workbench.log_schema.settings_json import MalformedSettings
from workbench.worlds.house import ContainerId, ItemType

SETTING = "memory"
"""The key among a run's settings; left out where nothing is remembered."""


class _Look(msgspec.Struct, frozen=True, kw_only=True):
    container: str
    seen_ns: int
    item_types: tuple[str, ...]
    run: str
    missed: float = 0.0
    changed: bool = False
    corrected: tuple[str, ...] = ()


class _Stored(msgspec.Struct, frozen=True, kw_only=True):
    at_ns: int
    looks: tuple[_Look, ...]
    moves_per_day: dict[str, float]
    others_per_day: float
    pace: float
    runs: tuple[str, ...]
    rearranged: float = REARRANGED_BEFORE


def memory_to_settings(memory: Memory | None) -> dict[str, Any]:
    """The entry for a run's settings; empty where nothing is remembered."""
    if memory is None:
        return {}
    looks = tuple(
        _Look(
            container=look.container,
            seen_ns=look.seen_ns,
            item_types=look.item_types,
            run=look.run,
            missed=look.missed,
            changed=look.changed,
            corrected=look.corrected,
        )
        for look in memory.looks
    )
    stored = _Stored(
        at_ns=memory.at_ns,
        looks=looks,
        moves_per_day={str(t): rate for t, rate in sorted(memory.rates.by_type.items())},
        others_per_day=memory.rates.others,
        pace=memory.pace,
        runs=memory.runs,
        rearranged=memory.rearranged,
    )
    return {SETTING: msgspec.to_builtins(stored)}


def memory_from_settings(settings: Mapping[str, Any]) -> Memory | None:
    """The memory that a run's settings hold; None where they hold none.

    Raises:
        MalformedSettings: the entry is invalid.
    """
    if SETTING not in settings:
        return None
    try:
        stored = msgspec.convert(settings[SETTING], _Stored)
        looks = tuple(
            PastLook(
                container=ContainerId(look.container),
                seen_ns=look.seen_ns,
                item_types=tuple(ItemType(t) for t in look.item_types),
                run=look.run,
                missed=look.missed,
                changed=look.changed,
                corrected=tuple(ItemType(t) for t in look.corrected),
            )
            for look in stored.looks
        )
        rates = MoveRates(
            others=stored.others_per_day, by_type={ItemType(t): rate for t, rate in stored.moves_per_day.items()}
        )
        return Memory(
            at_ns=stored.at_ns,
            looks=looks,
            rates=rates,
            pace=stored.pace,
            runs=stored.runs,
            rearranged=stored.rearranged,
        )
    except (msgspec.ValidationError, LiosError) as error:
        raise MalformedSettings(f"{SETTING}: {error}") from error
