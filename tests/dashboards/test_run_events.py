"""Notes and events as one list, and its panel: by time, bounded, with every note, a click away from the moment."""

from __future__ import annotations

from dataclasses import replace

from toy import COUNTER
from toy_run import action, named_run, ns, other_run, toy_run

from dashboards.model.clock import Clock
from dashboards.model.run_events import run_events
from dashboards.model.timeline import timeline_of
from dashboards.panels.events import MAX_ROWS, events
from replayers.log_tools.notes import RunNote

OURS = timeline_of(toy_run())


def _note(second: float, text: str, author: str = "") -> RunNote:
    return RunNote(text=text, start_ns=ns(second), end_ns=ns(second), author=author)


def test_all_that_happened_is_told_in_order() -> None:
    found = run_events(OURS, [_note(5, "a dog", "Ann")])
    assert [(event.kind, event.words) for event in found] == [
        ("decision", "1: start"),
        ("search", "fridge 1: 1 items"),
        ("decision", "2: searched fridge 1"),
        ("note", "Ann: a dog"),
        ("search", "countertop 1: 2 items, mug"),
        ("decision", "3: found mug in countertop 1"),
        ("end", "done"),
    ]


def test_refused_actions_are_events() -> None:
    refused = action(5, 3, "pick", 7, 12, COUNTER, item_types=("Mug",), success=False, reason="it is gone")
    found = run_events(timeline_of(replace(toy_run(), actions=(*toy_run().actions[:4], refused))), [])
    assert [e.words for e in found if e.kind == "refused"] == ["pick mug at countertop 1 (refused: it is gone)"]


def test_the_panel_goes_to_a_moment_and_lists_notes_on_other_runs() -> None:
    clock = Clock(timelines=(OURS, timeline_of(other_run())))
    shown = str(events(clock, ["lios", "greedy"], [(), (_note(2, "slow here"),)]))
    assert 'data-lios="seek 7.000000000"' in shown
    assert shown.index("Notes on the other runs") < shown.index("slow here")


def test_many_events_leave_every_note_and_say_what_is_left_out() -> None:
    many = tuple(action(i, 3, "pick", 7, 7 + i / 1e4, COUNTER, success=False) for i in range(MAX_ROWS + 50))
    clock = Clock(timelines=(timeline_of(replace(toy_run(), actions=many)),))
    shown = str(events(clock, ["lios"], [(_note(15, "at the very end"),)]))
    assert "at the very end" in shown
    assert shown.count("<tr>") == MAX_ROWS + 1
    assert "events are not listed" in shown


def test_markup_in_notes_is_text() -> None:
    name = "<script>alert(1)</script>"
    clock = Clock(timelines=(timeline_of(named_run(name)),))
    assert "<script" not in str(events(clock, [name], [(_note(1, name, name),)]))
