"""Files that come with this package: style sheets and scripts of its pages."""

from __future__ import annotations

from functools import lru_cache
from importlib.resources import files


@lru_cache(maxsize=64)
def resource(name: str) -> str:
    """The text of a file by its folder in this package and its name: "panels/panels.css"."""
    folder, _, file = name.rpartition("/")
    return files("dashboards." + folder.replace("/", ".")).joinpath(file).read_text(encoding="utf-8")
