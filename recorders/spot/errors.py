"""What can go wrong between us and a robot, each said in one line."""

from __future__ import annotations

import os

from workbench.errors import Failed, InputError, MissingExtra, Unsupported


class RobotUnreachable(Failed):
    """Nobody answers at the address, or the answer is no robot's."""

    def __init__(self, host: str, reason: str) -> None:
        super().__init__(
            f"{host}: the robot does not answer ({reason}). "
            "Check the address, the network, the port, and for a simulated robot --certificate."
        )


class BadLogin(InputError):
    """The robot refuses name and password."""

    def __init__(self, host: str) -> None:
        super().__init__(
            f"{host}: the robot refuses this name and password. "
            "Set BOSDYN_CLIENT_USERNAME and BOSDYN_CLIENT_PASSWORD, or answer the prompt."
        )


class NoTimeSync(Failed):
    """The robot's clock could not be compared with ours."""

    def __init__(self, host: str) -> None:
        super().__init__(
            f"{host}: time sync with the robot was not reached. Its clock cannot be converted; try again."
        )


class LeaseTaken(Failed):
    """Someone else commands the robot."""

    def __init__(self, host: str, owner: str) -> None:
        super().__init__(
            f"{host}: {owner or 'someone else'} holds the lease. Release it there, or give --take-lease."
        )


class Estopped(Failed):
    """The emergency stop is engaged and it is not ours to release."""

    def __init__(self, host: str) -> None:
        super().__init__(f"{host}: the robot is e-stopped. Release it at the tablet, or give --own-estop.")


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
    """The robot does not take a map that was uploaded."""

    def __init__(self, host: str, reason: str) -> None:
        super().__init__(
            f"{host}: the robot does not take the map ({reason}). It must not be recording, and the map must be of "
            "this kind of robot. Try it with the tablet."
        )


class WaypointMissing(Unsupported):
    """The site names waypoints that the robot's map does not have, or has several of."""

    def __init__(self, host: str, missing: list[str], ambiguous: list[str]) -> None:
        listed = ", ".join(missing[:6]) + (", ..." if len(missing) > 6 else "")
        several = f" ({', '.join(ambiguous)}: several of that name)" if ambiguous else ""
        super().__init__(
            f"{host}: the robot's map has no waypoint {listed}{several}. "
            "Load the right map, or correct the waypoints of the site: ids, or names that are unique."
        )


class NotLocalized(Failed):
    """The robot does not find itself on its map."""

    def __init__(self, host: str) -> None:
        super().__init__(
            f"{host}: the robot cannot find itself on its map. Stand it where it sees a fiducial of the map, "
            "then try again."
        )


class RunStopped(Failed):
    """A run on the robot cannot go on: a key, a lost lease, a network that stays away. Ends as a status."""

    def __init__(self, reason: str) -> None:
        self.reason = reason
        super().__init__(f"{reason}. The robot was told to stop.")


def require_bosdyn() -> None:
    """Raises MissingExtra when the Spot SDK is not installed; keeps gRPC's own lines from standard error."""
    os.environ.setdefault("GRPC_VERBOSITY", "NONE")
    try:
        import bosdyn.client  # noqa: F401  # pyright: ignore[reportUnusedImport] (whether it is there)
    except ImportError as error:
        raise MissingExtra("Spot", "spot") from error
