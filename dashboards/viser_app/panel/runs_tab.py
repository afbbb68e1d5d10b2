"""The tab of all runs that can be opened: filter, order, groups, pages, cells of an evaluation, and a scatter."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace
from typing import Any, final

import viser
from markupsafe import Markup

from dashboards.panels.folder.run_cells import run_cells
from dashboards.panels.folder.runs import COLUMNS, GROUPS, RunRow, RunsOrder, left_out, passes, runs
from dashboards.panels.folder.scatter import default_pair, scatter
from dashboards.viser_app.panel.selection_view import SelectionView
from dashboards.viser_app.session import BrowserSession

NONE_YET: tuple[str, ...] = ("",)
"""The only entry of a list before anything is known."""
NOT_GROUPED = "nothing"
ONE_LOG = Markup('<div class="lp"><p class="muted">Open a folder to choose among its runs.</p></div>')


@final
class RunsTab:
    """Builds itself into a group of tabs."""

    def __init__(self, session: BrowserSession, tabs: viser.GuiTabGroupHandle) -> None:
        gui = session.client.gui
        self._session = session
        self._listing = threading.Lock()
        self._order = RunsOrder()
        self._sent: dict[str, str] = {}
        with tabs.add_tab("Runs"):
            hint = "Words that a run must contain; also cost<50, cost>50, strategy=lios."
            self._filter = gui.add_text("Filter", "", hint=hint)
            self._filter.on_update(lambda _: self._turn(page=0))
            self._group = gui.add_dropdown("Group by", (NOT_GROUPED, *GROUPS))
            self._group.on_update(self._regroup)
            self._cells = gui.add_html("")
            self._table = gui.add_html("")
            self._first = gui.add_dropdown("Across", NONE_YET, hint="The strategy on the x axis.")
            self._second = gui.add_dropdown("Up", NONE_YET, hint="The strategy on the y axis.")
            self._scatter = gui.add_html("")
            if session.library.folder is not None:
                SelectionView(session, session.library.folder)
            for chosen in (self._first, self._second):
                chosen.on_update(lambda _: self._draw_scatter())
        session.listers.update(order=self._reorder, page=self._to_page, filter=self._refilter)

    def follow(self) -> None:
        """Shows the runs of the library as they now are."""
        self._list()
        self._offer_strategies()

    def _turn(self, **changes: Any) -> None:
        self._order = replace(self._order, **changes)
        self._list()
        if self._first.options != NONE_YET:
            self._draw_scatter()

    def _regroup(self, _: object) -> None:
        group = self._group.value
        self._turn(group="" if group == NOT_GROUPED else group, page=0)

    def _reorder(self, column: str) -> None:
        """By a column; a second time the other way round."""
        if column in COLUMNS:
            again = self._order.column == column
            self._turn(column=column, descending=again and not self._order.descending, page=0)

    def _to_page(self, number: str) -> None:
        if number.isdecimal() and len(number) < 7:
            self._turn(page=max(0, int(number) - 1))

    def _refilter(self, words: str) -> None:
        self._filter.value = words
        self._turn(page=0)

    def _rows(self) -> list[RunRow]:
        return [row for row in self._session.library.rows() if passes(row, self._filter.value)]

    def _list(self) -> None:
        library = self._session.library
        if len(library.paths) < 2:
            self._set("table", self._table, lambda: ONE_LOG)
            return
        with self._listing:  # the filter and the view call concurrently; the newer words must win
            rows, shown = self._rows(), self._session.state.runs
            total, untold = len(library.rows()), left_out(library.unreadable)
            self._set("cells", self._cells, lambda: run_cells(rows))
            self._set("table", self._table, lambda: runs(rows, shown, total=total, order=self._order) + untold)

    def _draw_scatter(self) -> None:
        self._set("scatter", self._scatter, lambda: scatter(self._rows(), self._first.value, self._second.value))

    def _set(self, what: str, handle: viser.GuiHtmlHandle, make: Callable[[], Markup]) -> None:
        content = str(make())
        if self._sent.get(what) != content:
            handle.content = self._sent[what] = content

    def _offer_strategies(self) -> None:
        """The folder's strategies, once; the two most different names first."""
        library = self._session.library
        names = sorted({row.strategy for row in library.rows()}) if len(library.paths) > 1 else []
        if len(names) > 1 and self._first.options != tuple(names):
            self._first.options = self._second.options = tuple(names)
            self._first.value, self._second.value = default_pair(names)
            self._draw_scatter()
