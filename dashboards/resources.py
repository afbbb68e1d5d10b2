"""Files that come with this package: style sheets and scripts of its pages."""

from __future__ import annotations

from functools import cache
from importlib.resources import files


@cache
def resource(name: str) -> str:
    """The text of a file by its folder in this package and its name: "panels/panels.css"."""
    folder, _, file = name.rpartition("/")
    return files("dashboards." + folder.replace("/", ".")).joinpath(file).read_text(encoding="utf-8")
