"""The errors of the connection to and control of a robot."""

from __future__ import annotations

import os
from collections.abc import Sequence

from workbench.errors import Failed, InputError, MissingExtra, Unsupported


class RobotUnreachable(Failed):
    """There is no answer at the address, or not from a robot."""

    def __init__(self, host: str, reason: str) -> None:
        super().__init__(
            f"{host}: the robot does not answer ({reason}). "
            "Check the address, the network, the port, and for a simulated robot --certificate."
        )


class BadLogin(InputError):
    """The robot refuses the user name and password."""

    def __init__(self, host: str) -> None:
        super().__init__(
            f"{host}: the robot refuses this name and password. "
            "Set BOSDYN_CLIENT_USERNAME and BOSDYN_CLIENT_PASSWORD, or answer the prompt."
        )


class LockedOut(InputError):
    """The robot refuses all logins for a while, after several wrong ones."""

    def __init__(self, host: str) -> None:
        super().__init__(
            f"{host}: this user is locked out for a while, after several wrong passwords. Wait some minutes, "
            "then give the right one."
        )


class ServiceMissing(InputError):
    """The robot's software does not have a service, or not a call of it.

    Args:
        missing: names of services or calls; empty where the robot does not say which.
        software: the robot's version.
    """

    def __init__(self, host: str, missing: Sequence[str], software: object) -> None:
        what = f"service {', '.join(missing)}" if missing else "such service"
        super().__init__(
            f"{host}: the robot has no {what}. Its software is {software}: update it, or use the bosdyn-client of "
            "its version; some services also need a licence or an arm."
        )


class NoTimeSync(Failed):
    """Time sync with the robot failed."""

    def __init__(self, host: str) -> None:
        super().__init__(
            f"{host}: time sync with the robot was not reached. Its clock cannot be converted; try again."
        )


class LeaseTaken(Failed):
    """Another client holds the lease."""

    def __init__(self, host: str, owner: str) -> None:
        super().__init__(
            f"{host}: {owner or 'someone else'} holds the lease. Release it there, or give --take-lease."
        )


class Estopped(Failed):
    """The emergency stop is engaged by another endpoint."""

    def __init__(self, host: str) -> None:
        super().__init__(f"{host}: the robot is e-stopped. Release it at the tablet, or give --own-estop.")


class NoEstop(Failed):
    """Nobody can stop the robot: its emergency-stop configuration has no endpoint."""

    def __init__(self, host: str) -> None:
        super().__init__(
            f"{host}: no e-stop endpoint guards the robot. Take the e-stop at the tablet, or give --own-estop."
        )


class NotReady(Failed):
    """The robot did not power on, stand up or localise."""

    def __init__(self, host: str, what: str) -> None:
        super().__init__(f"{host}: {what}. Look at the robot's faults on the tablet, then try again.")


class NoMap(Unsupported):
    """The robot holds no GraphNav map: it was restarted, or never had one."""

    def __init__(self, host: str) -> None:
        super().__init__(
            f"{host}: the robot holds no GraphNav map. Load it with the tablet, or give --map with the map's folder."
        )


class MapRefused(Failed):
    """The robot refuses an uploaded map."""

    def __init__(self, host: str, reason: str) -> None:
        super().__init__(
            f"{host}: the robot rejects the map ({reason}). It must not be recording, and the map must be of "
            "this kind of robot. Try it with the tablet."
        )


class MapUploadBrokeOff(Failed):
    """The network failed while a map was uploaded."""

    def __init__(self, host: str, reason: str) -> None:
        super().__init__(
            f"{host}: the upload of the map broke off ({reason}), and the robot holds a part of it now. "
            "Go nearer to it or its access point, then give --map again."
        )


class WaypointMissing(Unsupported):
    """The site names waypoints that are missing or ambiguous in the robot's map."""

    def __init__(self, host: str, missing: list[str], ambiguous: list[str]) -> None:
        listed = ", ".join(missing[:6]) + (", ..." if len(missing) > 6 else "")
        several = f" ({', '.join(ambiguous)}: several of that name)" if ambiguous else ""
        super().__init__(
            f"{host}: the robot's map has no waypoint {listed}{several}. "
            "Load the right map, or correct the waypoints of the site: ids, or names that are unique."
        )


class NotLocalized(Failed):
    """The robot cannot localise on its map."""

    def __init__(self, host: str) -> None:
        super().__init__(
            f"{host}: the robot cannot find itself on its map. Stand it where it sees a fiducial of the map, "
            "then try again."
        )


class StillHolding(Failed):
    """The gripper holds something that is in no log."""

    def __init__(self, host: str) -> None:
        super().__init__(
            f"{host}: the gripper holds something. Take it out, put it into or onto a container, and name that one "
            "with --held-at."
        )


class RunStopped(Failed):
    """A run on the robot cannot continue: stop key, lost lease, or network down. The run ends with a status."""

    def __init__(self, reason: str) -> None:
        self.reason = reason
        super().__init__(f"{reason}. The robot was told to stop.")


def require_bosdyn() -> None:
    """Check that the Spot SDK is installed, and silence gRPC's messages on standard error.

    Raises:
        MissingExtra: it is not installed.
    """
    os.environ.setdefault("GRPC_VERBOSITY", "NONE")
    try:
        import bosdyn.client  # noqa: F401  # pyright: ignore[reportUnusedImport] (whether it is there)
    except ImportError as error:
        raise MissingExtra("Spot", "spot") from error
