"""The selection of a folder in one browser's panel: worked out once, in a thread, since it reads every log
and loads what the dashboard needs for nothing else.
"""

from __future__ import annotations

import threading
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, final

from markupsafe import Markup

from dashboards.panels.markup import error_line
from dashboards.viser_app.session import BrowserSession
from replayers.batch.store import SUFFIX
from workbench.errors import LiosError

if TYPE_CHECKING:
    from dashboards.model.selection import FolderSelection


@final
class SelectionView:
    """The panel "Drive next". Empty until it is worked out.

    Args:
        session: of the browser; its library has a folder.
    """

    def __init__(self, session: BrowserSession, folder: Path) -> None:
        self._handle = session.client.gui.add_html("")
        self._folder = folder
        threading.Thread(target=self._fill, name="selection", daemon=True).start()

    def _fill(self) -> None:
        from dashboards.panels.folder.selection import selection

        try:
            content = selection(_selection(self._folder, _version(self._folder)), self._folder)
        except LiosError as error:
            content = error_line(str(error))
        self._show(content)

    def _show(self, content: Markup) -> None:
        self._handle.content = str(content)


@lru_cache(maxsize=4)
def _selection(folder: Path, version: tuple[tuple[str, int], ...]) -> FolderSelection:
    """Worked out once for all browsers, and again when replays are added."""
    from dashboards.model.selection import selection_in

    del version
    return selection_in(folder)


def _version(folder: Path) -> tuple[tuple[str, int], ...]:
    from replayers.selection.kept_answer import FILE

    return tuple(
        (str(path), path.stat().st_mtime_ns)
        for pattern in (f"*{SUFFIX}", FILE)
        for path in sorted(folder.rglob(pattern))
    )
