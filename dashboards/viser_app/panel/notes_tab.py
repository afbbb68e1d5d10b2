"""The tab of notes and events: what happened, and a note at the moment shown, written into the log at once."""

from __future__ import annotations

from typing import Any, final

import viser
from markupsafe import Markup

from dashboards.panels.events import events
from dashboards.viser_app.session import BrowserSession

MAX_NOTE_CHARS = 2000


@final
class NotesTab:
    """Made inside the tab that holds it."""

    def __init__(self, session: BrowserSession) -> None:
        gui = session.client.gui
        self._session = session
        self._words = gui.add_text("Note", "", multiline=True, hint="About the moment shown, in the run in focus.")
        self._author = gui.add_text("Author", "", hint="The author; may be empty.")
        add = gui.add_button("Add the note to the log")
        add.on_click(self._add)

    def panel(self, names: list[str]) -> Markup:
        """Notes and events of the runs on show."""
        return events(self._session.clock, names, self._session.notes())

    def _add(self, event: viser.GuiEvent[Any]) -> None:
        if event.client is not None and self._session.add_note(
            self._words.value[:MAX_NOTE_CHARS].strip(), author=self._author.value.strip()
        ):
            self._words.value = ""
