"""Corrections of a run by a person: their checks, and the run's contents with them.

It is about a look: the container was looked into, the item was not shown, and it had not been carried before.
"""

from __future__ import annotations

from collections.abc import Mapping

from replayers.runs.contents import contents_at_start
from replayers.runs.run import Run
from workbench.errors import BadValue, InputError, UnknownName
from workbench.log_schema.corrections import Correction, made_up_id
from workbench.log_schema.events import NANO
from workbench.planning.actions import relevant_types
from workbench.worlds.house import ContainerId, Contents, Item, ItemId, ItemType

AT = "@"
LEFT_OUT = "a correction is left out: "
"""How a note on a correction begins that is not used."""


class NotCorrectable(InputError):
    """A correction that says nothing of this run, or contradicts it."""

    def __init__(self, run: Run, correction: Correction, why: str) -> None:
        super().__init__(f"{run.path}: cannot note that {correction.words}: {why}.")


def read_correction(
    text: str, run: Run, contents: Contents, known: Contents, *, stamp_ns: int | None = None, author: str = ""
) -> Correction:
    """A correction as a person writes it, checked against the run.

    Args:
        text: "ITEM@CONTAINER", the item by its type or by its id ("mug@desk", "Mug|2@Desk|1"), in any case.
        run: which run.
        contents: what its containers held at the start, as far as it shows (Evidence.contents).
        known: of them, those that it knew before it started.
        stamp_ns: the moment; None for that of the first look into the container.
        author: who says so.

    Raises:
        BadValue: not of that form, or a moment outside the run.
        UnknownName: no such container, or no such item type in this run.
        NotCorrectable: nobody looked there, the item is known to be there or elsewhere, or it had been carried.
    """
    what, _, where = (part.strip() for part in text.partition(AT))
    if not what or not where:
        raise BadValue("--seen", text, "ITEM@CONTAINER, such as mug@desk")
    container = ContainerId(_named("container", where, [c.id for c in run.place.plan.containers], run))
    found = Correction(
        item=_item(what, container, run),
        container=container,
        stamp_ns=_first_look_ns(run, container) if stamp_ns is None else stamp_ns,
        author=author,
    )
    start_ns, end_ns = _span_ns(run)
    if not start_ns <= found.stamp_ns <= end_ns:
        seconds = (found.stamp_ns - start_ns) / NANO
        raise BadValue("--at", f"{seconds:.3f} s", f"within the run, 0 to {(end_ns - start_ns) / NANO:.3f} seconds")
    _check(found, run, contents, known)
    return found


def with_corrections(
    contents: Mapping[ContainerId, tuple[Item, ...]], known: Contents, run: Run
) -> tuple[dict[ContainerId, tuple[Item, ...]], tuple[Correction, ...], tuple[str, ...]]:
    """The contents at the start with the corrections of the run; those used; a note for each, used or left out."""
    held = dict(contents)
    used: list[Correction] = []
    notes: list[str] = []
    for correction in sorted(run.corrections, key=lambda c: (c.stamp_ns, c.container, c.item.id)):
        try:
            _check(correction, run, held, known)
        except InputError as error:
            notes.append(f"{LEFT_OUT}{error}")
            continue
        held[correction.container] = (*held[correction.container], correction.item)
        used.append(correction)
        who = correction.author or "a person"
        notes.append(f"{who} says that {correction.words}, which no look showed: taken as certain")
    return held, tuple(used), tuple(notes)


def corrections_of(run: Run) -> tuple[tuple[Correction, ...], tuple[str, ...]]:
    """The corrections of a run that its looks do not contradict, and a note for each, used or left out."""
    if not run.corrections:
        return (), ()
    contents, _ = contents_at_start(run.observations, run.actions, tuple(c.id for c in run.place.plan.containers))
    at_start = {ContainerId(o.container) for o in run.observations if o.known_at_start}
    known = {c: items for c, items in contents.items() if c in at_start}
    _, used, notes = with_corrections(contents, known, run)
    return used, notes


def _check(correction: Correction, run: Run, contents: Contents, known: Contents) -> None:
    container, item = correction.container, correction.item
    if container in known:
        raise NotCorrectable(
            run, correction, "its contents were known at the start, so no look missed anything there"
        )
    if container not in contents:
        raise NotCorrectable(run, correction, "nobody looked into it in this run, so no look missed anything there")
    named_by_type = item.id == made_up_id(item.type, container)
    here = next((i for i in contents[container] if i.id == item.id or (named_by_type and i.type == item.type)), None)
    if here is not None:
        raise NotCorrectable(
            run, correction, f"the log knows of {here.id} there; to add another instance, give its id"
        )
    elsewhere = next((c for c, items in sorted(contents.items()) if any(i.id == item.id for i in items)), None)
    if elsewhere is not None:
        raise NotCorrectable(run, correction, f"the log shows it in {elsewhere}")
    if any(a.success and item.id in a.items and a.action in ("pick", "place") for a in run.actions):
        raise NotCorrectable(run, correction, "the robot carried it in this run, so where it was put down is known")


def _item(text: str, container: ContainerId, run: Run) -> Item:
    shown = {i.id: i.type for o in run.observations for i in o.items}
    if text in shown:
        return Item(id=ItemId(text), type=ItemType(shown[text]))
    kind, _, number = text.partition("|")
    item_type = ItemType(_named("item type", kind, _types_of(run), run))
    return Item(id=ItemId(f"{item_type}|{number}") if number else made_up_id(item_type, container), type=item_type)


def _types_of(run: Run) -> set[str]:
    """Every item type that the log speaks of."""
    found = {str(t) for t in (*relevant_types(run.task.goal), *run.task.available)}
    found |= {item_type for belief in run.beliefs for item_type in belief.item_types}
    return found | {item.type for o in run.observations for item in o.items}


def _named(kind: str, name: str, known: list[str] | set[str] | list[ContainerId], run: Run) -> str:
    found = next((one for one in sorted(known) if one.lower() == name.lower()), None)
    if found is None:
        raise UnknownName(kind, name, known, where=str(run.path))
    return found


def _first_look_ns(run: Run, container: ContainerId) -> int:
    looks = [o.stamp.ns for o in run.observations if o.container == container and not o.known_at_start]
    return min(looks, default=run.info.started.ns)


def _span_ns(run: Run) -> tuple[int, int]:
    ends = [e.stamp.ns for e in (*run.observations, *run.actions, *run.plans)]
    if run.outcome is not None:
        ends.append(run.outcome.stamp.ns)
    return run.info.started.ns, max(ends, default=run.info.started.ns)
