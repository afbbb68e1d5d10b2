"""Loading ProcTHOR houses in all three of its JSON layouts, from files or from parsed JSON."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

import msgspec

from workbench.errors import BadValue, MalformedFile
from workbench.worlds.house import FloorPlan, House
from workbench.worlds.house_yaml import is_house_yaml, load_house_yaml
from workbench.worlds.maps.connectivity import require_connected
from workbench.worlds.procthor.assets import Asset, read_assets
from workbench.worlds.procthor.building import opening_of, room_of, walls_of
from workbench.worlds.procthor.house_files import (
    HouseIndexMissing,
    explain_bad_json,
    house_line,
    house_lines,
    house_stem,
    is_many,
    split_address,
)
from workbench.worlds.procthor.objects import start_of, things_of
from workbench.worlds.procthor.schema import HouseJson
from workbench.worlds.procthor.unity_frame import pose_from_unity

__all__ = ["house_from_json", "house_name", "house_of", "iter_houses", "load_house", "load_houses", "pose_from_unity"]

MAX_ROOMS = 500
"""Most rooms of a house that is accepted."""


def load_house(address: str, *, assets: Path | None = None) -> House:
    """One house: "FILE:17" of a file with one house a line, a .json file with a single house, or a .yaml of yours.

    Args:
        address: the file and the index, counted from 0.
        assets: a table of asset sizes and types (asset_id, object_type, size_x_m, size_y_m, size_z_m), for exact
            sizes; without it types come from the vocabulary and sizes are usual ones.

    Raises:
        InputError: no such file, index or house; the message says what is wrong.
    """
    if is_house_yaml(address):
        return load_house_yaml(Path(address))
    path, index = split_address(address)
    if index is None and is_many(path):
        raise HouseIndexMissing(path)
    line = house_line(path, index or 0)
    return _decoded(path, index or 0, line, read_assets(assets))


def load_houses(path: Path, *, assets: Path | None = None) -> list[House]:
    """All houses of a file, in order. Raises as load_house does."""
    return list(iter_houses(path, assets=assets))


def iter_houses(path: Path, *, assets: Path | None = None) -> Iterator[House]:
    """All houses of a file, one after another, for files that do not fit into memory. Raises as load_house does."""
    table = read_assets(assets)
    for index, line in house_lines(Path(path)):
        yield _decoded(Path(path), index, line, table)


def house_from_json(data: object, *, name: str, assets: Mapping[str, Asset] | Path | None = None) -> House:
    """A house from parsed JSON.

    Raises:
        MalformedFile: it is not a ProcTHOR house; the message gives `name` as the file.
        InputError: rooms are not connected, a wall is missing, or a coordinate is not finite.
    """
    try:
        record = msgspec.convert(data, HouseJson)
    except (msgspec.ValidationError, RecursionError) as error:
        raise MalformedFile(name, f"no ProcTHOR house ({error})", "Compare it with a house of ProcTHOR-10K") from None
    table = read_assets(assets) if isinstance(assets, Path) else assets
    return house_of(record, name=name, assets=table or {})


def house_of(record: HouseJson, *, name: str, assets: Mapping[str, Asset]) -> House:
    """A house from its typed record. Raises as house_from_json does."""
    if not record.rooms:
        raise BadValue(f"rooms of {name}", [], "at least one room")
    if len(record.rooms) > MAX_ROOMS:
        raise BadValue(f"number of rooms of {name}", len(record.rooms), f"at most {MAX_ROOMS}")
    rooms = tuple(room_of(room, name) for room in record.rooms)
    if len({room.id for room in rooms}) < len(rooms):
        raise BadValue(f"room ids of {name}", [room.id for room in rooms], "different from one another")
    walls, by_id = walls_of(record.walls, {room.id for room in rooms}, name)
    doors = tuple(opening_of(door, by_id, rooms, name) for door in record.doors)
    windows = tuple(opening_of(window, by_id, rooms, name) for window in record.windows)
    containers, furniture, contents = things_of(record.objects, rooms, assets, name)
    plan = FloorPlan(
        name=name,
        rooms=rooms,
        walls=walls,
        doors=doors,
        windows=windows,
        containers=containers,
        furniture=furniture,
        start=start_of(record.metadata.agent if record.metadata else None, rooms, name),
    )
    require_connected(plan)
    return House(plan=plan, contents=contents)


def house_name(path: Path, index: int) -> str:
    """The name of a house in a file."""
    return f"{house_stem(path)}:{index}"


def _decoded(path: Path, index: int, line: bytes, assets: Mapping[str, Asset]) -> House:
    name = house_name(path, index)
    try:
        record = msgspec.json.decode(line, type=HouseJson)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        explain_bad_json(path, index, line, str(error))
    return house_of(record, name=name, assets=assets)
