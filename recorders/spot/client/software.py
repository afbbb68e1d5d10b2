"""The version of a robot's software, and how this client adapts to older ones."""

from __future__ import annotations

from importlib.metadata import version
from typing import Any, NamedTuple

from bosdyn.api import robot_id_pb2

from workbench.errors import BadValue


class SoftwareVersion(NamedTuple):
    """The release of a robot's software."""

    major: int
    minor: int = 0
    patch: int = 0

    @classmethod
    def of(cls, robot_id: robot_id_pb2.RobotId) -> SoftwareVersion:
        """What a robot says of itself; 0.0.0 if it says nothing."""
        has = robot_id.software_release.version
        return cls(has.major_version, has.minor_version, has.patch_level)

    @classmethod
    def read(cls, where: str, text: str) -> SoftwareVersion:
        """Parse MAJOR, MAJOR.MINOR or MAJOR.MINOR.PATCH.

        Raises:
            BadValue: something else, or older than 3.0.0. `where` names the option.
        """
        parts = text.split(".")
        if len(parts) > 3 or not all(part.isascii() and part.isdigit() and len(part) < 6 for part in parts):
            raise BadValue(where, text, "a release such as 4.1.1")
        read = cls(*(int(part) for part in parts))
        if read < MIN_SOFTWARE:
            raise BadValue(where, text, f"{MIN_SOFTWARE} or later")
        return read

    def __str__(self) -> str:
        return f"{self.major}.{self.minor}.{self.patch}"


MIN_SOFTWARE = SoftwareVersion(3)
"""The oldest release whose services and fields the client knows."""
GRAPH_STREAMING_SINCE = SoftwareVersion(4, 1)
"""Since this release a graph goes up and down in a stream (UploadGraphStreaming, DownloadGraphStreaming in
graph_nav_service.proto: in bosdyn-api 4.1.1, not in 4.0.0)."""


def client_version() -> str:
    """The version of the installed bosdyn-client."""
    return version("bosdyn-client")


def fit_to(software: SoftwareVersion, service: str, client: Any) -> None:
    """Let a client of GraphNav not try to stream a graph where the robot's software cannot.

    Otherwise the SDK tries, fails, and says so on standard output (graph_nav.py, download_graph), amid what a command
    prints for scripts.
    """
    if service == "graph-nav-service" and (0, 0, 0) < software < GRAPH_STREAMING_SINCE:
        client._use_streaming_graph_upload = False
