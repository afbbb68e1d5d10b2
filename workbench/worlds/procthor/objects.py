"""The objects of a ProcTHOR house: containers with their items, other furniture, and the robot's start pose."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import inf, isfinite

from workbench.errors import BadValue
from workbench.worlds.geometry import MAX_COORDINATE_M, Pose
from workbench.worlds.house import Container, ContainerId, Furniture, Item, ItemId, ItemType, Room
from workbench.worlds.maps.connectivity import room_at
from workbench.worlds.names import is_container, size_of_asset_m, type_of_asset, usual_size_m
from workbench.worlds.procthor.assets import Asset
from workbench.worlds.procthor.room_fit import clip_to_room
from workbench.worlds.procthor.schema import AgentJson, ObjectJson
from workbench.worlds.procthor.unity_frame import pose_from_unity

MAX_FLOOR_CENTRE_M = 1.2
"""An object with a lower centre stands on the floor, so that its height is twice that of its centre."""


def things_of(
    records: Iterable[ObjectJson], rooms: tuple[Room, ...], assets: Mapping[str, Asset], name: str
) -> tuple[tuple[Container, ...], tuple[Furniture, ...], dict[ContainerId, tuple[Item, ...]]]:
    """Containers, other furniture and contents of the containers; every id becomes "Type|place"."""
    containers: list[Container] = []
    furniture: list[Furniture] = []
    contents: dict[ContainerId, tuple[Item, ...]] = {}
    used: dict[str, int] = {}
    for record in records:
        type_name = _type(record, assets)
        try:
            pose = pose_from_unity(record.position, record.rotation)
        except BadValue as error:
            raise BadValue(f"position of {record.id} in {name}", str(error), "finite numbers of metres") from None
        home = room_at(rooms, pose.point)
        room = home.id
        size, base = _size(record, type_name, assets, f"{record.id} in {name}")
        if (record.assetId or "") not in assets:
            size = clip_to_room(size, pose, home.floor)
        thing_id = _own_id(type_name, record.id, used)
        if is_container(type_name) or record.children:
            container_id = ContainerId(thing_id)
            containers.append(
                Container(id=container_id, type=type_name, room=room, pose=pose, size_m=size, base_m=base)
            )
            contents[container_id] = tuple(
                Item(id=ItemId(_own_id(_type(child, assets), child.id, used)), type=ItemType(_type(child, assets)))
                for child in record.children or ()
            )
        else:
            furniture.append(Furniture(id=thing_id, type=type_name, room=room, pose=pose, size_m=size, base_m=base))
    return tuple(containers), tuple(furniture), contents


def _type(record: ObjectJson, assets: Mapping[str, Asset]) -> str:
    """The objectType; in the older layout, the type by the asset table or by the asset's id."""
    if record.objectType:
        return record.objectType
    asset_id = record.assetId or ""
    known = assets.get(asset_id)
    return known.type if known else type_of_asset(asset_id) or "ObjaUnknown"


def _own_id(type_name: str, source_id: str, used: dict[str, int]) -> str:
    """An id with its type: "Bed|4|0" stays; "2|0" becomes "Fridge|2|0" and "small|2|1" "Egg|2|1"; duplicates get
    "#2"."""
    head, bar, tail = source_id.partition("|")
    name = f"{type_name}|{tail if bar and not head.isdigit() else source_id}"
    used[name] = used.get(name, 0) + 1
    unique = name if used[name] == 1 else f"{name}#{used[name]}"
    if unique != name:
        used[unique] = used.get(unique, 0) + 1
    return unique


def _size(
    record: ObjectJson, type_name: str, assets: Mapping[str, Asset], where: str
) -> tuple[tuple[float, float, float], float]:
    """(depth, width, height) and the height of the underside above the floor. Positions are those of object
    centres."""
    middle = record.position.y
    if not isfinite(middle) or abs(middle) > MAX_COORDINATE_M:
        raise BadValue(f"height of {where}", middle, f"finite and within {MAX_COORDINATE_M:.0f} m")
    asset = assets.get(record.assetId or "")
    if asset:
        size = asset.size_m
    else:
        depth, width, height = size_of_asset_m(record.assetId or "") or usual_size_m(type_name)
        size = (depth, width, 2 * middle if 0.02 < middle < MAX_FLOOR_CENTRE_M else height)
    return size, max(0.0, middle - size[2] / 2)


def start_of(agent: AgentJson | None, rooms: tuple[Room, ...], name: str) -> Pose:
    """The agent's pose; without one, the centre of the largest room, which navigation moves to a free cell."""
    if agent is not None:
        try:
            return pose_from_unity(agent.position, agent.rotation)
        except BadValue as error:
            raise BadValue(f"metadata.agent of {name}", str(error), "finite numbers of metres") from None
    extent, middle = -inf, (0.0, 0.0)
    for room in rooms:
        xs, ys = [x for x, _ in room.floor], [y for _, y in room.floor]
        area = (max(xs) - min(xs)) * (max(ys) - min(ys))
        if area > extent:
            extent, middle = area, ((max(xs) + min(xs)) / 2, (max(ys) + min(ys)) / 2)
    return Pose(x_m=middle[0], y_m=middle[1])
