"""pyarrow, an optional part: whatever makes tables imports it from here."""

from workbench.errors import MissingExtra

try:
    import pyarrow as pa
except ModuleNotFoundError as error:
    raise MissingExtra("making tables", "tables") from error

__all__ = ["pa"]
