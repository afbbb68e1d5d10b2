"""Houses with a learnable pattern: an item's place depends on its kind, its room, and the size of the container."""

from __future__ import annotations

import numpy as np

from workbench.worlds.geometry import Pose
from workbench.worlds.house import Container, ContainerId, FloorPlan, House, Item, ItemId, ItemType, Room, RoomId

HOMES = {
    "Egg": ("Kitchen", "Fridge"),
    "Mug": ("Kitchen", "CounterTop"),
    "Fork": ("Kitchen", "CounterTop"),
    "Pillow": ("Bedroom", "Bed"),
    "Book": ("Bedroom", "Desk"),
    "Laptop": ("Bedroom", "Desk"),
}


def learnable_house(seed: int) -> House:
    """Two rooms, six containers; every item at its home nine times in ten, on the larger of two counters."""
    rng = np.random.default_rng(seed)
    rooms = [
        Room(id=RoomId("k"), kind="Kitchen", floor=((0, 0), (4, 0), (4, 4), (0, 4))),
        Room(id=RoomId("b"), kind="Bedroom", floor=((4, 0), (8, 0), (8, 4), (4, 4))),
    ]
    sizes = [(0.6, 0.8), (0.6, 3.0)] if rng.random() < 0.5 else [(0.6, 3.0), (0.6, 0.8)]
    made = [
        _container("Fridge|1", "k", 0.5, (0.7, 0.7)),
        _container("CounterTop|1", "k", 2.0, sizes[0]),
        _container("CounterTop|2", "k", 3.0, sizes[1]),
        _container("Bed|1", "b", 5.0, (2.0, 1.6)),
        _container("Desk|1", "b", 6.0, (0.6, 1.2)),
        _container("Chair|1", "b", 7.0, (0.5, 0.5)),
    ]
    large = max(made[1:3], key=lambda c: c.size_m[1])
    contents: dict[ContainerId, list[Item]] = {c.id: [] for c in made}
    for name, (_, home) in HOMES.items():
        places = [large] if home == "CounterTop" else [c for c in made if c.type == home]
        place = places[0] if rng.random() < 0.9 else made[int(rng.integers(len(made)))]
        contents[place.id].append(Item(id=ItemId(f"{name}|{seed}"), type=ItemType(name)))
    plan = FloorPlan(
        name=f"learnable:{seed}",
        rooms=tuple(rooms),
        walls=(),
        doors=(),
        windows=(),
        containers=tuple(made),
        furniture=(),
        start=Pose(x_m=1.0, y_m=1.0),
    )
    return House(plan=plan, contents={c: tuple(items) for c, items in contents.items()})


def learnable_houses(count: int, *, first: int = 0) -> list[House]:
    return [learnable_house(first + k) for k in range(count)]


def _container(name: str, room: str, x: float, size: tuple[float, float]) -> Container:
    return Container(
        id=ContainerId(name),
        type=name.partition("|")[0],
        room=RoomId(room),
        pose=Pose(x_m=x, y_m=2.0),
        size_m=(*size, 0.9),
    )
