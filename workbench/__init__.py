"""LIOS workbench: robot object search and task planning with missing objects.

Rooms, each knowing only those before it: worlds <- beliefs <- search <- planning <- execution <- log_schema <-
evaluation.
"""

__version__: str


def __getattr__(name: str) -> str:
    """Look up `__version__` on first access: reading it from the package metadata takes longer than all other
    start-up imports."""
    if name != "__version__":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib.metadata import PackageNotFoundError, version

    try:
        found = version("lios-workbench")
    except PackageNotFoundError:  # a source tree that was never installed
        found = "0.0.0"
    globals()["__version__"] = found
    return found
