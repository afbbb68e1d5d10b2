"""pandas, an optional part: whatever makes data frames imports it from here."""

from workbench.errors import MissingExtra

try:
    import pandas as pd
except ModuleNotFoundError as error:
    raise MissingExtra("making tables", "tables") from error

__all__ = ["pd"]
