"""Options that the `lios spot` commands share, and the checks of their values."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, final

from workbench.options import Force, Json, ServePort
from workbench.parameters import Option

if TYPE_CHECKING:
    from recorders.spot.run.run_settings import RunSettings
    from recorders.spot.session.session import Rates

Robot = Annotated[str, Option("--robot", help="HOST or HOST:PORT of the robot.")]
SiteOption = Annotated[str, Option("--site", help="Survey file (site.yaml) or a shipped site: paper_home.")]
OperatorName = Annotated[str, Option("--operator", help="Who is at the robot, for the log.")]
LogSerial = Annotated[
    bool, Option("--serial/--no-serial", help="Whether the log names the robot: its serial number and nickname.")
]
Certificate = Annotated[
    Path | None,
    Option("--certificate", help="Root certificate to trust; default Boston Dynamics' own."),
]
SpeedLimit = Annotated[float | None, Option("--speed", help="Speed limit in m/s.")]
StopWithin = Annotated[
    float,
    Option(
        "--stop-within",
        help="Metres that the robot walks on at most when this program or the network dies; more metres ride out "
        "longer hiccups of the network.",
    ),
]
LookSeconds = Annotated[float, Option("--look", help="Duration of a look in seconds.")]
SeesTags = Annotated[
    float,
    Option(
        "--sees",
        help="Metres from which the tag of an item that is looked for counts, seen in passing; 0 for not at all.",
    ),
]
ImagesHz = Annotated[float, Option("--images-hz", help="Pictures per second and camera; 0 for none.")]
Cameras = Annotated[str, Option("--cameras", help="Image sources, comma-separated.")]
TakeLease = Annotated[bool, Option("--take-lease", help="Take the lease from its current owner.")]
OwnEstop = Annotated[
    bool, Option("--own-estop", help="Guard the run with our own e-stop endpoint instead of the tablet's.")
]
FurnitureOpen = Annotated[
    bool, Option("--furniture-open", help="Assert that all closed furniture was opened before the run.")
]
KeepLocalization = Annotated[
    bool,
    Option(
        "--keep-localization",
        help="Assert that the robot is where it says: no fiducial need be in view at the start.",
    ),
]
ContinueAfterOutage = Annotated[
    bool, Option("--resume", help="Continue by itself after an outage in which the robot stopped.")
]
DryRun = Annotated[bool, Option("--dry-run", help="Connect, check and plan; nothing moves.")]

LOOK_S, SEES_M, IMAGES_HZ, STOP_WITHIN_M = 6.0, 3.0, 2.0, 0.5
MAX_SPEED_MPS = 1.6
"""Spot's own speed limit."""
FRONT_CAMERAS = "frontleft_fisheye_image,frontright_fisheye_image"


def check_within(option: str, value: float, minimum: float, maximum: float) -> None:
    """Raise BadValue for a number of an option that is outside of a range, whose ends belong to it."""
    from workbench.errors import BadValue

    if not minimum <= value <= maximum:
        raise BadValue(option, value, f"between {minimum:g} and {maximum:g}")


def camera_names(text: str) -> tuple[str, ...]:
    """The names of cameras in a comma-separated list."""
    return tuple(name.strip() for name in text.split(",") if name.strip())


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class RunOptions:
    """The options that `lios spot run` and `lios spot resume` have in common."""

    speed: SpeedLimit = None
    stop_within: StopWithin = STOP_WITHIN_M
    look: LookSeconds = LOOK_S
    sees: SeesTags = SEES_M
    images_hz: ImagesHz = IMAGES_HZ
    cameras: Cameras = FRONT_CAMERAS
    take_lease: TakeLease = False
    own_estop: OwnEstop = False
    furniture_open: FurnitureOpen = False
    keep_localization: KeepLocalization = False
    resume: ContinueAfterOutage = False
    dry_run: DryRun = False
    serve: ServePort = None
    operator: OperatorName = ""
    serial: LogSerial = True
    certificate: Certificate = None
    force: Force = False
    json: Json = False

    def check(self, output: Path) -> None:
        """Check the output and the values, before the robot is called.

        Raises:
            OutputExists: the output is there and is not to be replaced.
            BadValue: a speed, duration or rate out of its range.
        """
        from workbench.errors import BadValue, OutputExists

        if output.exists() and not (self.force or self.dry_run):
            raise OutputExists(output)
        if self.speed is not None and not 0 < self.speed <= MAX_SPEED_MPS:
            raise BadValue("--speed", self.speed, f"more than 0 and at most {MAX_SPEED_MPS} m/s, Spot's own limit")
        check_within("--stop-within", self.stop_within, 0.1, 5)
        check_within("--look", self.look, 0.1, 600)
        check_within("--sees", self.sees, 0, 20)
        check_within("--images-hz", self.images_hz, 0, 60)

    def settings(self) -> RunSettings:
        """The settings of motion and perception."""
        from recorders.spot.run.run_settings import RunSettings

        return RunSettings(
            speed_mps=self.speed,
            stop_within_m=self.stop_within,
            look_s=self.look,
            sees_m=self.sees,
            keep_localization=self.keep_localization,
            furniture_open=self.furniture_open,
            resume=self.resume,
        )

    def rates(self) -> Rates:
        """The polling rates of the recorded streams."""
        from recorders.spot.session.session import Rates

        return Rates(images_hz=self.images_hz, cameras=camera_names(self.cameras))
