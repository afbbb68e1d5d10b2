"""`lios houses generate | info | stats`: generate houses, show their contents, compare generated and real ones."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

from workbench.options import Assets, Force, Json
from workbench.parameters import Argument, Option

if TYPE_CHECKING:
    from workbench.worlds.house import House
    from workbench.worlds.maps.reach import RoomReach


def generate(
    output: Annotated[Path, Option("--output", "-o", help="The file to write: .jsonl.gz or .jsonl.")] = Path(
        "houses.jsonl.gz"
    ),
    count: Annotated[int, Option("--count", "-n", help="How many houses.")] = 24,
    rooms: Annotated[str, Option("--rooms", help="Number of rooms: 5, or a range: 2-10.")] = "2-10",
    seed: Annotated[int | None, Option("--seed", help="Seed; random and shown if not given.")] = None,
    stocked: Annotated[
        bool, Option("--stocked", help="Kitchens get what the scenarios need: egg, toaster, kettle, ...")
    ] = False,
    force: Force = False,
    json: Json = False,
) -> None:
    """Generate houses in ProcTHOR's JSON, drawn from statistics of real ones.

    Examples:

        lios houses generate -n 100 --seed 7 -o houses.jsonl.gz

        lios houses generate -n 24 --seed 2082 --stocked --rooms 2-10 -o houses.jsonl.gz
    """
    from secrets import randbelow

    from workbench.errors import BadValue, OutputExists
    from workbench.terminal import counted, emit_json, progress, say
    from workbench.worlds.generator.generate import generate_houses, write_houses
    from workbench.worlds.procthor.house_files import is_many

    if output.exists() and not force:
        raise OutputExists(output)
    if not is_many(output):
        raise BadValue("-o/--output", str(output), "a name that ends in .jsonl.gz or .jsonl")
    _require_folder(output, "-o/--output")
    chosen = randbelow(1_000_000) if seed is None else seed
    if chosen < 0:
        raise BadValue("--seed", chosen, "at least 0")
    houses = generate_houses(count, seed=chosen, rooms=_range(rooms), stocked=stocked)
    written = write_houses(output, progress(houses, title="Generating", total=count))
    if json:
        emit_json({"file": str(output), "houses": written, "seed": chosen, "rooms": rooms, "stocked": stocked})
    else:
        say(f"{counted(written, 'house')} in {output}, seed {chosen}. Next: lios houses info {output}:0")


def info(
    house: Annotated[
        str, Argument(help="FILE:index or a house's .json; a whole FILE is summarised; default: shipped.")
    ] = "",
    assets: Assets = None,
    json: Json = False,
) -> None:
    """Show what is in a house: rooms, containers, items, and what cannot be reached and why.

    Rooms are joined by doors or by open walls. A container is reached from within its own room. Where one cannot be
    reached, the reason is given: furniture, a passage narrower than the robot, or the cells of the grid.

    Examples:

        lios houses info houses.jsonl.gz:17

        lios houses info houses.jsonl.gz
    """
    from workbench.terminal import emit_json, emit_table, emit_text
    from workbench.worlds.procthor.house_files import is_many, split_address
    from workbench.worlds.procthor.load import load_house
    from workbench.worlds.shipped import shipped_houses

    address = house or str(shipped_houses())
    path, index = split_address(address)
    if index is None and is_many(path):
        answer = _summary(path, assets)
    else:
        answer = _one_house(load_house(address, assets=assets))
    if json:
        emit_json(answer)
        return
    rows = answer.pop("containers_in_order", None) or answer.pop("houses_with_unreachable", [])
    reach = answer.pop("reach", [])
    for name, value in answer.items():
        emit_text(f"{name.replace('_', ' '):>24}  {_shown(value)}")
    if reach:
        emit_table([{**row, "unreachable": ", ".join(row["unreachable"])} for row in reach], title="Reach of rooms")
    if rows:
        emit_table(rows)


def stats(
    files: Annotated[list[Path] | None, Argument(help="Files of houses; default: the shipped ones.")] = None,
    split: Annotated[
        str, Option("--split", help="Which houses of the shared ProcTHOR files: train, validation, test, all.")
    ] = "all",
    count: Annotated[int, Option("--generated", "-n", help="Also generate this many houses.")] = 0,
    seed: Annotated[int, Option("--seed", help="Seed of the generated houses.")] = 0,
    rooms: Annotated[str, Option("--rooms", help="Rooms of the generated houses: 5, or from-to.")] = "2-10",
    min_rooms: Annotated[int, Option("--at-least", help="Leave out houses of fewer rooms.")] = 1,
    assets: Assets = None,
    measure: Annotated[
        Path | None, Option("--measure", help="Write the generator's statistics, measured on these houses.")
    ] = None,
    force: Annotated[bool, Option("--force", help="Replace the output of --measure.")] = False,
    json: Json = False,
) -> None:
    """Compare houses: sizes, contents, and search costs.

    Examples:

        lios houses stats multi_room_train.jsonl.gz --split validation --at-least 2 --generated 100

        lios houses stats multi_room_train.jsonl.gz --split train --measure statistics.json
    """
    from workbench.errors import BadValue, OutputExists
    from workbench.terminal import emit_json, say

    if measure is not None:
        _require_folder(measure, "--measure")
        if measure.exists() and not force:
            raise OutputExists(measure)
    columns = _columns(files or [], split=split, assets=assets)
    if measure is not None:
        _write_measured(measure, [h for houses in columns.values() for h in houses], files or [], split)
        say(f"Figures of {sum(map(len, columns.values()))} houses in {measure}.")
        return
    if count:
        columns[f"generated ({count}, seed {seed})"] = _generated(count, seed, rooms)
    kept = {t: [h for h in hs if len(h.plan.rooms) >= min_rooms] for t, hs in columns.items()}
    if not any(kept.values()):
        most = max((len(h.plan.rooms) for hs in columns.values() for h in hs), default=0)
        raise BadValue("--at-least", min_rooms, f"at most {most}, the rooms of the largest of these houses")
    answer = _compared(kept)
    if json:
        emit_json(answer)
    else:
        _show_compared(answer)


def _require_folder(output: Path, option: str) -> None:
    from workbench.errors import BadValue

    if not output.absolute().parent.is_dir():
        raise BadValue(f"folder of {option}", output.absolute().parent, "a folder that exists")


def _range(text: str) -> tuple[int, int]:
    """ "2-10" -> (2, 10), "5" -> (5, 5)."""
    from workbench.errors import BadValue

    low, dash, high = text.partition("-")
    if not (low.isascii() and low.isdigit() and (not dash or (high.isascii() and high.isdigit()))) or len(text) > 9:
        raise BadValue("--rooms", text, "a number or a range such as 2-10")
    return int(low), int(high if dash else low)


def _one_house(house: House) -> dict[str, Any]:
    from collections import Counter

    from workbench.worlds.generator.statistics import area_m2
    from workbench.worlds.house import LocationId
    from workbench.worlds.maps.navigation import navigate
    from workbench.worlds.maps.reach import rooms_reached
    from workbench.worlds.names import readable_name

    plan = house.plan
    navigation = navigate(plan)
    travel = navigation.travel
    kinds = Counter(room.kind for room in plan.rooms)
    start = travel.metres[0]
    return {
        "house": plan.name,
        "rooms": dict(sorted(kinds.items())),
        "area_m2": round(sum(area_m2(room.floor) for room in plan.rooms), 1),
        "doors": sum(door.passable for door in plan.doors),
        "containers": len(plan.containers),
        "items": sum(len(items) for items in house.contents.values()),
        "item_types": [readable_name(item_type) for item_type in house.item_types()],
        "farthest_m": round(float(start.max()), 1),
        "unreachable": list(travel.unreachable),
        "reach": [_reach_row(reach) for reach in rooms_reached(plan, navigation)],
        "containers_in_order": [
            {
                "container": container.id,
                "room": next(room.kind for room in plan.rooms if room.id == container.room),
                "from_start_m": travel.between(travel.locations[0], LocationId(container.id)),
                "holds": ", ".join(readable_name(item.type) for item in house.contents[container.id]),
            }
            for container in plan.containers
        ],
    }


def _reach_row(reach: RoomReach) -> dict[str, Any]:
    return {
        "room": reach.room,
        "kind": reach.kind,
        "joined": ", ".join(f"{room} by {by}" for room, by in reach.joined),
        "free_m2": reach.free_m2,
        "cut_off": reach.cut_off,
        "containers": reach.containers,
        "unreachable": list(reach.unreachable),
        "why": reach.access.message,
    }


def _summary(path: Path, assets: Path | None) -> dict[str, Any]:
    from workbench.terminal import progress
    from workbench.worlds.maps.navigation import navigate
    from workbench.worlds.maps.reach import RoomAccess, rooms_reached
    from workbench.worlds.procthor.load import iter_houses

    houses = rooms = containers = items = open_plan = rooms_cut_off = 0
    lost: list[dict[str, Any]] = []
    for house in progress(iter_houses(path, assets=assets), title="Reading"):
        houses += 1
        rooms += len(house.plan.rooms)
        containers += len(house.plan.containers)
        items += sum(len(held) for held in house.contents.values())
        navigation = navigate(house.plan)
        unreachable = navigation.travel.unreachable
        reached = rooms_reached(house.plan, navigation)
        open_plan += any(_joined_by_open_wall_alone(reach) for reach in reached)
        rooms_cut_off += sum(reach.cut_off for reach in reached)
        if unreachable or any(reach.cut_off for reach in reached):
            why = "; ".join(
                f"{reach.kind} {reach.room}: {reach.access.message}"
                for reach in reached
                if reach.access.kind is not RoomAccess.WHOLE
            )
            lost.append(
                {
                    "house": house.plan.name,
                    "unreachable": ", ".join(unreachable),
                    "count": len(unreachable),
                    "why": why,
                }
            )
    used = containers - sum(row["count"] for row in lost)
    return {
        "file": str(path),
        "houses": houses,
        "rooms": rooms,
        "containers": containers,
        "items": items,
        "reachable_containers": used,
        "reachable_share": round(used / containers, 5) if containers else 1.0,
        "houses_with_rooms_joined_without_a_door": open_plan,
        "rooms_cut_off": rooms_cut_off,
        "houses_with_unreachable": lost,
    }


def _joined_by_open_wall_alone(reach: RoomReach) -> bool:
    """Whether some room beside this one is joined to it by an open wall and by no door."""
    doors = {room for room, by in reach.joined if by == "door"}
    return any(by == "open wall" and room not in doors for room, by in reach.joined)


def _columns(files: list[Path], *, split: str, assets: Path | None) -> dict[str, list[House]]:
    """The houses of the requested part, by file."""
    from workbench.evaluation.splits import is_shared, split_indices
    from workbench.worlds.procthor.house_files import house_stem
    from workbench.worlds.procthor.load import load_houses
    from workbench.worlds.shipped import house_file, shipped_houses

    columns: dict[str, list[House]] = {}
    for path in map(house_file, files or [shipped_houses()]):
        houses = load_houses(path, assets=assets)
        chosen = [houses[i] for i in split_indices(path, split, houses=len(houses))]
        title = house_stem(path) if files else "shipped"
        columns[f"{title} ({split})" if is_shared(path) and split != "all" else title] = chosen
    return columns


def _generated(count: int, seed: int, rooms: str) -> list[House]:
    from workbench.terminal import progress
    from workbench.worlds.generator.generate import generate_houses
    from workbench.worlds.procthor.load import house_from_json

    made = progress(generate_houses(count, seed=seed, rooms=_range(rooms)), title="Generating", total=count)
    return [house_from_json(record, name=f"generated:{i}") for i, record in enumerate(made)]


def _write_measured(output: Path, houses: list[House], files: list[Path], split: str) -> None:
    from workbench.files import write_atomically
    from workbench.worlds.generator.statistics import measure, statistics_json

    made_by = f"lios houses stats {' '.join(map(str, files))} --split {split} --measure {output}"
    write_atomically(output, statistics_json(measure(houses, made_by=made_by)))


def _compared(columns: dict[str, list[House]]) -> dict[str, Any]:
    from workbench.evaluation.house_statistics import house_figures, where_items_are

    return {
        "columns": [{"title": title, **house_figures(houses)} for title, houses in columns.items()],
        "rows": where_items_are(columns),
    }


def _show_compared(answer: dict[str, Any]) -> None:
    from workbench.terminal import emit_table

    columns = answer["columns"]
    names = [name for name in columns[0] if name not in ("title", "room_area_m2")]
    rows: list[dict[str, Any]] = [
        {"figure": name.replace("_", " "), **{column["title"]: column[name] for column in columns}} for name in names
    ]
    for kind in sorted({kind for column in columns for kind in column["room_area_m2"]}):
        sizes = {column["title"]: column["room_area_m2"].get(kind) for column in columns}
        rows.append({"figure": f"area of a {kind} (m2)", **sizes})
    emit_table(rows, title="Houses")
    shown = [
        {**row, "where": ", ".join(f"{place} {share:.0%}" for place, share in row["where"])} for row in answer["rows"]
    ]
    emit_table(shown, title="Where the commonest items are")


def _shown(value: Any) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{n} {kind}" for kind, n in cast(dict[str, int], value).items())
    if isinstance(value, list):
        return ", ".join(map(str, cast(list[object], value))) or "-"
    return str(value)
