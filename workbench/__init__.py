"""LIOS workbench: robot object search and task planning with missing objects.

Rooms, each knowing only those before it:
worlds <- beliefs <- search <- planning <- execution <- runs <- evaluation.
"""

from importlib.metadata import PackageNotFoundError, version

try:
    __version__ = version("lios-workbench")
except PackageNotFoundError:  # a source tree that was never installed
    __version__ = "0.0.0"
