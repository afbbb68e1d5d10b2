"""Tables of values in notebooks: escaped, short, by themselves."""

from __future__ import annotations

from math import inf

from replayers.tables.html_tables import MAX_ROWS, html_table


def test_markup_in_any_place_stays_text() -> None:
    evil = "<script>alert(1)</script>"
    shown = html_table(evil, (evil,), [(evil,)], note=evil)
    assert "<script" not in shown
    assert shown.count("&lt;script&gt;") == 4


def test_long_and_turning_texts_are_tamed() -> None:
    shown = html_table("t", (), [("x" * 5000, "a\u202eb")])
    assert len(shown) < 600
    assert "\u202e" not in shown


def test_numbers_are_rounded_and_what_is_missing_is_a_dash() -> None:
    shown = html_table("t", ("a", "b", "c", "d"), [(1.25, None, True, inf)])
    cells = [part.partition(">")[2].partition("<")[0] for part in shown.split("<td")[1:]]
    assert cells == ["1.2", "-", "yes", "-"]


def test_of_many_rows_the_rest_is_counted() -> None:
    shown = html_table("t", (), [(i,) for i in range(MAX_ROWS + 3)])
    assert shown.count("<tr>") == MAX_ROWS
    assert "and 3 more rows" in shown
