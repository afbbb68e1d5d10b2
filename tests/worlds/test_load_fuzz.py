"""Fuzzing of houses: a faulty house is refused with one line or works; nothing else happens."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st
from procthor_house import two_rooms

from workbench.errors import InputError
from workbench.worlds.maps.navigation import compute
from workbench.worlds.procthor.load import house_from_json

VALUES = [
    None,
    0,
    -1,
    1e9,
    1e308,
    1e-300,
    float("nan"),
    float("inf"),
    "",
    "x",
    [],
    {},
    True,
    "room|2",
    "wall|2|middle",
]


def places(value: object, at: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Every place in parsed JSON, but for the whole."""
    if at:
        yield at
    if isinstance(value, dict):
        for key in value:
            yield from places(value[key], (*at, key))
    elif isinstance(value, list):
        for index in range(len(value)):
            yield from places(value[index], (*at, index))


PLACES = list(places(two_rooms()))
Change = tuple[tuple[Any, ...], str, Any]


def changed(house: Any, changes: list[Change]) -> Any:
    for at, how, value in changes:
        holder = house
        try:
            for key in at[:-1]:
                holder = holder[key]
            if how == "drop":
                del holder[at[-1]]
            elif how == "twice" and isinstance(holder, list):
                holder.append(copy.deepcopy(holder[at[-1]]))
            else:
                holder[at[-1]] = value
        except (KeyError, IndexError, TypeError):
            continue  # an earlier change took the place away
    return house


@settings(max_examples=250, deadline=None)
@given(
    st.lists(
        st.tuples(st.sampled_from(PLACES), st.sampled_from(["set", "drop", "twice"]), st.sampled_from(VALUES)),
        min_size=1,
        max_size=3,
    )
)
def test_any_change_is_refused_in_one_line_or_works(changes: list[Change]) -> None:
    data = changed(copy.deepcopy(two_rooms()), changes)
    said = ""
    try:
        compute(house_from_json(data, name="changed").plan, resolution_m=0.1, robot_radius_m=0.2)
    except InputError as refused:
        said = str(refused)
    assert "\n" not in said
