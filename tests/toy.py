"""A small house worked out by hand, for tests that need no real one.

Two rooms side by side: kitchen x in [0, 4], bedroom x in [4, 8], both y in [0, 4]; a door at x = 4, y in [1.5, 2.5].

    kitchen: fridge (0.5, 3.5), counter (2.0, 3.6), table (2.0, 1.0)
    bedroom: bed (7.0, 3.0), desk (7.5, 0.6)
    start (1.0, 2.0)
"""

from __future__ import annotations

import numpy as np

from workbench.worlds.geometry import Pose
from workbench.worlds.house import (
    START,
    Container,
    ContainerId,
    FloorPlan,
    House,
    Item,
    ItemId,
    ItemType,
    LocationId,
    Opening,
    Room,
    RoomId,
    Wall,
)
from workbench.worlds.travel import TravelCosts

KITCHEN, BEDROOM = RoomId("room|1"), RoomId("room|2")
FRIDGE, COUNTER, TABLE, BED, DESK = (
    ContainerId(name) for name in ("Fridge|1", "CounterTop|1", "DiningTable|1", "Bed|2", "Desk|2")
)


def item(name: str) -> Item:
    """An item "Mug|1" of type "Mug"."""
    return Item(id=ItemId(name), type=ItemType(name.partition("|")[0]))


def toy_plan() -> FloorPlan:
    def container(
        cid: ContainerId, kind: str, room: RoomId, x: float, y: float, size: tuple[float, float, float]
    ) -> Container:
        return Container(id=cid, type=kind, room=room, pose=Pose(x_m=x, y_m=y), size_m=size)

    def wall(name: str, a: tuple[float, float], b: tuple[float, float], room: RoomId) -> Wall:
        return Wall(id=name, start=a, end=b, room=room)

    return FloorPlan(
        name="toy",
        rooms=(
            Room(id=KITCHEN, kind="Kitchen", floor=((0, 0), (4, 0), (4, 4), (0, 4))),
            Room(id=BEDROOM, kind="Bedroom", floor=((4, 0), (8, 0), (8, 4), (4, 4))),
        ),
        walls=(
            wall("w1", (0, 0), (8, 0), KITCHEN),
            wall("w2", (8, 0), (8, 4), BEDROOM),
            wall("w3", (8, 4), (0, 4), BEDROOM),
            wall("w4", (0, 4), (0, 0), KITCHEN),
            wall("w5", (4, 0), (4, 4), KITCHEN),
        ),
        doors=(Opening(id="door|1|2", start=(4, 1.5), end=(4, 2.5), rooms=(KITCHEN, BEDROOM), passable=True),),
        windows=(Opening(id="window|1", start=(1, 0), end=(2, 0), bottom_m=0.9, top_m=2.0, rooms=(KITCHEN,)),),
        containers=(
            container(FRIDGE, "Fridge", KITCHEN, 0.5, 3.5, (0.7, 0.7, 1.8)),
            container(COUNTER, "CounterTop", KITCHEN, 2.0, 3.6, (1.6, 0.6, 0.9)),
            container(TABLE, "DiningTable", KITCHEN, 2.0, 0.8, (1.2, 0.8, 0.75)),
            container(BED, "Bed", BEDROOM, 6.8, 3.0, (2.0, 1.6, 0.6)),
            container(DESK, "Desk", BEDROOM, 7.4, 0.6, (1.0, 0.6, 0.75)),
        ),
        furniture=(),
        start=Pose(x_m=1.0, y_m=2.0),
    )


def toy_house() -> House:
    return House(
        plan=toy_plan(),
        contents={
            FRIDGE: (item("Egg|1"), item("Tomato|1"), item("Apple|1")),
            COUNTER: (item("Mug|1"), item("Knife|1"), item("Pot|1"), item("Toaster|1")),
            TABLE: (item("Plate|1"), item("Bread|1"), item("Bowl|1")),
            BED: (item("Pillow|1"), item("Book|1")),
            DESK: (item("CellPhone|1"), item("Mug|2"), item("Pencil|1")),
        },
    )


def toy_travel() -> TravelCosts:
    """Round numbers, a metric: kitchen places within 3 m of each other, the bedroom 6 to 7 m away."""
    locations = tuple(LocationId(n) for n in (START, FRIDGE, COUNTER, TABLE, BED, DESK))
    metres = np.array(
        [
            [0, 2, 2, 1, 6, 7],
            [2, 0, 1, 3, 7, 8],
            [2, 1, 0, 3, 6, 7],
            [1, 3, 3, 0, 6, 6],
            [6, 7, 6, 6, 0, 2],
            [7, 8, 7, 6, 2, 0],
        ],
        dtype=float,
    )
    return TravelCosts(locations=locations, metres=metres)
