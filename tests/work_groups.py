"""Which tests share a worker of pytest-xdist, and in which order workers take them.

A worker takes a module at a time, so that what a module sets up is set up once, or a group of modules. By path, not
by the mark xdist_group: xdist 3.8 writes it into ids of tests, which pytest 9.2 no longer lets it change.
"""

from __future__ import annotations

from pathlib import PurePosixPath

PLANNING, SEARCH, SOURCE, BROWSER = "compiles planning", "compiles search", "reads our source", "browser"
FIRST = (PLANNING, SEARCH, SOURCE, BROWSER)
"""The groups that come first. Where numba has kept nothing yet, one worker compiles the kernels of planning while the
other compiles those of search and then reads our source, and what comes after finds them compiled. The browser's
group is the longest, and must not be the last."""

_GROUPS = {
    PLANNING: ("test_kernels",),
    SEARCH: ("search",),
    SOURCE: (
        "test_architecture",
        "test_caches",
        "test_dependencies",
        "test_docstrings",
        "test_files",
        "test_frozen_values",
        "test_markup_is_safe",
        "test_message_enum",
        "test_run_identity",
        "test_tolerances",
    ),
    BROWSER: ("test_panels_colours", "test_serving_in_firefox"),
}
_GROUP_OF = {part: group for group, parts in _GROUPS.items() for part in parts}


def group_of(file: str) -> str:
    """The group of a test module, by its path or the first part of a test's id; a module alone is its own."""
    path = PurePosixPath(file)
    if path.stem.endswith("_in_chromium"):
        return BROWSER
    return _GROUP_OF.get(path.stem) or _GROUP_OF.get(path.parent.name) or file


def turn_of(file: str) -> tuple[int, int, str]:
    """By which to sort modules: the first groups, then modules beside this one (some are long), then folders."""
    path, group = PurePosixPath(file), group_of(file)
    turn = FIRST.index(group) if group in FIRST else len(FIRST)
    return turn, 0 if path.parent.name == "tests" else 1, str(path.parent)
