"""Control of a robot as a context: lease, emergency stop and motors, always released at the end.

Entering takes the lease, checks that the robot may move, powers it on and lets it stand up. Leaving stops it, lets
it sit down, powers its motors off and returns the lease, retrying for GIVE_BACK_S seconds if the network is down.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from types import TracebackType
from typing import Self

from bosdyn.api import basic_command_pb2, estop_pb2, power_pb2, robot_command_pb2, robot_state_pb2
from bosdyn.client.estop import EstopEndpoint, EstopKeepAlive
from bosdyn.client.exceptions import LeaseUseError, RpcError
from bosdyn.client.lease import (
    Lease,
    LeaseKeepAlive,
    LeaseNotOwnedByWallet,
    NotActiveLeaseError,
    ResourceAlreadyClaimedError,
)
from bosdyn.client.robot_command import RobotCommandBuilder

from recorders.spot.client.battery import START_PERCENT, charge_percent
from recorders.spot.client.clock import SteppedSessionClock
from recorders.spot.client.command_status import command_end
from recorders.spot.client.connection import NOT_ON_THIS_ROBOT, ROBOT_ERRORS, Connection, reason_of
from recorders.spot.client.docking import DockOutcome, docked_at, undock
from recorders.spot.client.errors import Estopped, LeaseTaken, NoEstop, NotReady

GIVE_BACK_S = 20.0
SIT_S = 10.0
ESTOP_TIMEOUT_S, STEPPED_ESTOP_TIMEOUT_S = 9.0, 600.0
"""Seconds of silence after which the e-stop endpoint stops the robot; longer with stepped time, where a slow
machine must not trigger it."""
ESTOP_NAME = "lios-workbench"
READY_S = 30.0
POLL_S = 0.2

log = logging.getLogger("lios.spot")


_IN_WORDS = {
    "ShorePowerConnectedError": "it is on shore power: unplug it",
    "BatteryMissingError": "it has no battery",
    "DockedError": "it stands on its dock: undock it with the tablet",
    "BehaviorFaultError": "a behaviour fault is set (a fall, or a connection that broke off): clear it on the tablet",
    "KeepaliveMotorsOffError": "a keepalive policy of the robot wants the motors off",
    "FaultedError": "a fault keeps the motors off",
    "EstoppedError": "an emergency stop is engaged",
}


def not_ready_reason(error: Exception) -> str:
    """Why a robot cannot power on or stand up, and how to fix it."""
    return _IN_WORDS.get(type(error).__name__, reason_of(error))


class Control:
    """Holds the right to command the robot. A context manager.

    Args:
        connection: the robot.
        take: take the lease from its current owner.
        own_estop: set up a separate emergency-stop endpoint, whatever the stop level is; it replaces the robot's
            configuration, also a live endpoint of the tablet.
        stand: power on and stand up; off for tests of the lease alone.
        dock: the number of the dock that the robot may leave; None where a docked robot is refused.

    Attributes:
        lease_lost: an event, set when the lease is lost.
        before_rest: called before the robot sits down, while it still stands; it must not raise.
        estop_guard: names of the endpoints whose emergency stop guards the run; "" before control is taken.
        estop_replaced: names of the endpoints that ours replaced; "" if there were none.

    Raises:
        LeaseTaken, Estopped, NoEstop, NotReady, RobotUnreachable, ServiceMissing.
    """

    def __init__(
        self,
        connection: Connection,
        *,
        take: bool = False,
        own_estop: bool = False,
        stand: bool = True,
        dock: int | None = None,
    ) -> None:
        self._connection = connection
        self._take, self._own_estop, self._stand = take, own_estop, stand
        self._keep_alive: LeaseKeepAlive | None = None
        self._estop: EstopKeepAlive | None = None
        self._lease: Lease | None = None
        self.lease_lost = threading.Event()
        self._dock = dock
        self.before_rest: Callable[[], None] | None = None
        self.returned = False
        self.estop_guard = self.estop_replaced = ""

    def __enter__(self) -> Self:
        try:
            self._take_lease()
            if self._stand:
                self._allow_motion()
                self._check_battery()
                self._power_on()
                self._undock()
                self._stand_up()
        except ROBOT_ERRORS as error:
            self.give_back()
            if isinstance(error, (RpcError, *NOT_ON_THIS_ROBOT)):
                raise self._connection.as_line(error) from error
            raise NotReady(str(self._connection.address), not_ready_reason(error)) from error
        except BaseException:
            self.give_back()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.give_back()

    @property
    def held(self) -> bool:
        """Whether the lease is currently held."""
        return self._lease is not None

    def estop_in_words(self) -> str:
        """Whose emergency stop guards the run, and what it does if this program is killed."""
        if self._estop is None:
            return f"The e-stop of {self.estop_guard} guards this run: if this program is killed, the motors stay on"
        return (
            f"Our own e-stop guards this run: it stops the robot {ESTOP_TIMEOUT_S:g} s after this program is killed"
        )

    def stop(self) -> None:
        """Stop the robot where it is, if it is reachable."""
        self._try_command(RobotCommandBuilder.stop_command())

    def give_back(self) -> None:
        """Stop, sit down, power off and return the lease. Safe to call twice; never raises because of the robot."""
        if self._lease is not None and not self.lease_lost.is_set() and self._stand:
            self.stop()
            if self.before_rest is not None:
                self.before_rest()
            self._sit_down()
            self._try_command(RobotCommandBuilder.safe_power_off_command())
            self._await_motors_off()
        if self._keep_alive is not None:
            self._keep_alive.shutdown()
            self._keep_alive = None
        if self._lease is not None:
            self.returned = self._return_lease(self._lease)
            self._lease = None
        if self._estop is not None:
            self._estop.shutdown()
            self._estop = None

    def _take_lease(self) -> None:
        client = self._connection.client("lease")
        try:
            self._lease = client.take() if self._take else client.acquire()
        except ResourceAlreadyClaimedError as error:
            owner = error.response.lease_owner.client_name
            raise LeaseTaken(str(self._connection.address), owner) from None
        except ROBOT_ERRORS as error:
            raise self._connection.as_line(error) from error
        self._keep_alive = LeaseKeepAlive(
            client, rpc_interval_seconds=1, warnings=False, on_failure_callback=self._on_failure
        )

    def _on_failure(self, error: Exception) -> None:
        """Keep-alive callback: a lease taken by another client is lost, but a failed call does not lose it."""
        if isinstance(error, LeaseUseError | LeaseNotOwnedByWallet):
            self.lease_lost.set()

    def _allow_motion(self) -> None:
        client = self._connection.client("estop")
        status: estop_pb2.EstopSystemStatus = client.get_status(timeout=self._connection.timeout_s)
        guards = ", ".join(e.endpoint.name or e.endpoint.role or "unnamed" for e in status.endpoints)
        if not self._own_estop:
            if not status.endpoints:
                raise NoEstop(str(self._connection.address))
            if status.stop_level != estop_pb2.ESTOP_LEVEL_NONE:
                raise Estopped(str(self._connection.address))
            self.estop_guard = guards
            return
        self.estop_replaced = guards
        if guards:
            log.warning("--own-estop replaces the e-stop of %s", guards)
        stepped = isinstance(self._connection.clock, SteppedSessionClock)
        silent_s = STEPPED_ESTOP_TIMEOUT_S if stepped else ESTOP_TIMEOUT_S
        endpoint = EstopEndpoint(client, ESTOP_NAME, silent_s)
        try:
            endpoint.force_simple_setup()
        except ROBOT_ERRORS as error:
            what = f"an e-stop endpoint could not be set up ({reason_of(error)}); its motors must be off for that"
            raise NotReady(str(self._connection.address), what) from error
        self._estop = EstopKeepAlive(endpoint)
        self._estop.allow()
        self.estop_guard = ESTOP_NAME

    def _check_battery(self) -> None:
        charge = charge_percent(self._connection.client("robot-state").get_robot_state())
        if charge is not None and charge < START_PERCENT:
            what = f"its battery is at {charge:.0f} %, and a run begins with at least {START_PERCENT:.0f} %"
            raise NotReady(str(self._connection.address), what)

    def _undock(self) -> None:
        """Leave the dock, where the site names it: standing up on it is refused."""
        if self._dock is None or docked_at(self._connection) is None:
            return
        ended = undock(self._connection)
        if ended.kind is not DockOutcome.DONE:
            raise NotReady(str(self._connection.address), f"it did not leave its dock ({ended.message})")

    def _power_on(self) -> None:
        client, state = self._connection.client("power"), self._connection.client("robot-state")
        client.power_command(power_pb2.PowerCommandRequest.REQUEST_ON, timeout=self._connection.timeout_s)
        powered = robot_state_pb2.PowerState.STATE_ON

        def on() -> bool:
            now: robot_state_pb2.RobotState = state.get_robot_state(timeout=self._connection.timeout_s)
            return now.power_state.motor_power_state == powered

        self._wait(on, "the motors did not come on")

    def _stand_up(self) -> None:
        client = self._connection.client("robot-command")
        number: int = client.robot_command(
            RobotCommandBuilder.synchro_stand_command(), timeout=self._connection.timeout_s
        )
        standing = basic_command_pb2.StandCommand.Feedback.STATUS_IS_STANDING

        def stands() -> bool:
            answer: robot_command_pb2.RobotCommandFeedbackResponse = client.robot_command_feedback(
                number, timeout=self._connection.timeout_s
            )
            moving = answer.feedback.synchronized_feedback.mobility_command_feedback
            ended = command_end(moving.status)
            if ended is not None:
                raise NotReady(str(self._connection.address), f"it did not stand up: the command ended with {ended}")
            return moving.stand_feedback.status == standing

        self._wait(stands, "it did not stand up")

    def _wait(self, done: Callable[[], bool], otherwise: str) -> None:
        clock = self._connection.clock
        end = clock.now_ns() + round(READY_S * 1e9)
        while not done():
            if clock.now_ns() > end:
                raise NotReady(str(self._connection.address), otherwise)
            clock.sleep(POLL_S)

    def _try_command(self, command: robot_command_pb2.RobotCommand) -> int | None:
        """Send a command, tolerating failure: the robot may be unreachable, or the lease lost; None if it failed."""
        try:
            number: int = self._connection.client("robot-command").robot_command(command, timeout=2.0)
        except ROBOT_ERRORS as error:
            log.warning("the robot did not take a command: %s", reason_of(error))
            return None
        return number

    def _sit_down(self) -> None:
        """Let the robot sit down, and wait until it sits or another command has replaced this one."""
        number = self._try_command(RobotCommandBuilder.synchro_sit_command())
        client, clock = self._connection.client("robot-command"), self._connection.clock
        end, sitting = clock.now_ns() + round(SIT_S * 1e9), basic_command_pb2.SitCommand.Feedback.STATUS_IS_SITTING
        try:
            while number is not None and clock.now_ns() < end:
                answer: robot_command_pb2.RobotCommandFeedbackResponse = client.robot_command_feedback(
                    number, timeout=2.0
                )
                moving = answer.feedback.synchronized_feedback.mobility_command_feedback
                if moving.sit_feedback.status == sitting:
                    return
                ended = command_end(moving.status)
                if ended is not None:
                    log.warning("the robot does not sit down: the command ended with %s", ended)
                    return
                clock.sleep(POLL_S)
        except ROBOT_ERRORS as error:
            log.warning("the robot does not say whether it sits: %s", reason_of(error))

    def _await_motors_off(self) -> None:
        """Wait until the robot has sat down and its motors are off; returning the lease earlier would stop it
        halfway."""
        client, clock = self._connection.client("robot-state"), self._connection.clock
        end, off = clock.now_ns() + round(SIT_S * 1e9), robot_state_pb2.PowerState.STATE_OFF
        try:
            while client.get_robot_state(timeout=2.0).power_state.motor_power_state != off and clock.now_ns() < end:
                clock.sleep(POLL_S)
        except ROBOT_ERRORS as error:
            log.warning("the robot does not say whether its motors are off: %s", reason_of(error))

    def _return_lease(self, lease: Lease) -> bool:
        """Return the lease; True once we no longer hold it."""
        client = self._connection.client("lease")
        end = time.monotonic() + GIVE_BACK_S
        while True:
            try:
                client.return_lease(lease, timeout=2.0)
                return True
            except NotActiveLeaseError:
                return True
            except ROBOT_ERRORS as error:
                if time.monotonic() > end:
                    log.error("the lease could not be returned: %s", reason_of(error))
                    return False
                time.sleep(0.3)
