"""The offline page inside a notebook: an iframe that carries the whole page and may not touch the notebook's."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib import import_module
from typing import final

from markupsafe import Markup

from dashboards.capsule.write import capsule_page
from dashboards.model.timeline import timeline_of
from replayers.runs.run import Run
from workbench.errors import BadValue, Unsupported

HEIGHTS_PX = (200, 4000)
"""The least and the greatest height."""


class NoNotebook(Unsupported):
    """A run was to be shown where no notebook is running."""

    def __init__(self, run: Run) -> None:
        super().__init__(
            "show() shows a run inside a notebook (Jupyter, VS Code), and none is running here. "
            f"In a browser: lios view {run.path}; as a page: lios capsule {run.path} -o run.html"
        )


@final
class EmbeddedPage:
    """Runs as a notebook shows them.

    Args:
        runs: the first is in focus; those of another place are left out, and the page says so.
        height_px: of the frame.
    """

    def __init__(self, runs: Sequence[Run], *, height_px: int = 640) -> None:
        if not HEIGHTS_PX[0] <= height_px <= HEIGHTS_PX[1]:
            raise BadValue("height_px", height_px, f"from {HEIGHTS_PX[0]} to {HEIGHTS_PX[1]}")
        self._page = capsule_page([timeline_of(run) for run in runs])
        self._height_px = height_px

    def __repr__(self) -> str:
        return f"<Embedded: a page of {len(self._page)} characters>"

    def _repr_html_(self) -> str:
        frame = Markup(
            '<iframe srcdoc="{}" sandbox="allow-scripts allow-downloads" title="LIOS run" loading="lazy"'
            ' style="width:100%;height:{}px;border:1px solid #ccc"></iframe>'
        )
        return str(frame.format(self._page, self._height_px))


def show(runs: Sequence[Run], *, height_px: int = 640) -> None:
    """Shows runs in the output of the notebook's cell.

    Raises:
        NoNotebook: none is running.
    """
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython is not None else None
    if shell is None or not hasattr(shell, "kernel"):
        raise NoNotebook(runs[0])
    import_module("IPython.display").display(EmbeddedPage(runs, height_px=height_px))
