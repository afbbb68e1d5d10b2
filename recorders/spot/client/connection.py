"""The connection to a robot: address, certificate, login and time sync; the only module that opens bosdyn clients.

Credentials come from BOSDYN_CLIENT_USERNAME and BOSDYN_CLIENT_PASSWORD (the SDK's names) or a prompt, and are never
logged: the repr of `Credentials` hides the password.
"""

from __future__ import annotations

import getpass
import os
import re
import sys
import threading
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path
from types import TracebackType
from typing import Any, Self, cast

import bosdyn.client
from bosdyn.client.auth import InvalidLoginError, InvalidTokenError, TemporarilyLockedOutError
from bosdyn.client.exceptions import Error as BosdynError
from bosdyn.client.exceptions import NonexistentAuthorityError, RpcError, UnauthenticatedError, UnimplementedError
from bosdyn.client.lease import Error as LeaseClientError
from bosdyn.client.robot import UnregisteredServiceError, UnregisteredServiceNameError
from bosdyn.client.time_sync import TimeSyncError, TimeSyncThread

from recorders.spot.client.clock import SessionClock, SteppedSessionClock, SyncedClock
from recorders.spot.client.errors import BadLogin, LockedOut, NoTimeSync, RobotUnreachable, ServiceMissing
from recorders.spot.client.software import SoftwareVersion, fit_to
from recorders.spot.client.time_source import SteppedClock
from workbench.errors import BadValue, FileMissing, MalformedFile

NOT_ON_THIS_ROBOT = (UnregisteredServiceError, NonexistentAuthorityError, UnimplementedError)
"""Errors of a robot whose software has no such service or call."""
ROBOT_ERRORS = (BosdynError, LeaseClientError)
"""The two base classes of errors raised by bosdyn-client."""

USERNAME, PASSWORD, CERTIFICATE = "BOSDYN_CLIENT_USERNAME", "BOSDYN_CLIENT_PASSWORD", "LIOS_SPOT_CERTIFICATE"
TIME_SYNC_EVERY_S = 5.0
RPC_TIMEOUT_S = 5.0
CHANNEL_OPTIONS = (
    ("grpc.initial_reconnect_backoff_ms", 200),
    ("grpc.min_reconnect_backoff_ms", 3000),
    ("grpc.max_reconnect_backoff_ms", 1000),
    ("grpc.keepalive_time_ms", 5000),
    ("grpc.keepalive_timeout_ms", 4000),
    ("grpc.http2.ping_timeout_ms", 4000),
    ("grpc.http2.max_pings_without_data", 0),
)
"""gRPC options for reconnecting within seconds. By default gRPC waits up to two minutes between attempts, and
without keep-alive a connection that died silently (a robot out of Wi-Fi range) is kept until the kernel gives up
after many minutes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Credentials:
    """User name and password for the robot."""

    username: str
    password: str = field(repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotAddress:
    """The address of a robot: HOST or HOST:PORT."""

    host: str
    port: int = 443

    @classmethod
    def read(cls, text: str) -> RobotAddress:
        host, colon, port = text.rpartition(":")
        if not colon:
            host, port = text, "443"
        if not host or not port.isdigit() or not 0 < int(port) < 65536:
            raise BadValue("--robot", text, "HOST or HOST:PORT")
        return cls(host=host, port=int(port))

    def __str__(self) -> str:
        return self.host if self.port == 443 else f"{self.host}:{self.port}"


def find_credentials() -> Credentials:
    """Credentials from the environment, else from a prompt on the terminal.

    Raises:
        BadValue: neither is available.
    """
    username, password = os.environ.get(USERNAME, ""), os.environ.get(PASSWORD, "")
    if username and password:
        return Credentials(username=username, password=password)
    if not sys.stdin.isatty():
        raise BadValue("login of the robot", None, f"in {USERNAME} and {PASSWORD} where no terminal can be asked")
    username = username or input("Robot user: ")
    return Credentials(username=username, password=getpass.getpass("Password: "))


class Connection:
    """A logged-in, time-synced connection to a robot. A context manager.

    Args:
        address: address of the robot.
        credentials: user name and password.
        certificate: the root certificate to trust; default: Boston Dynamics' own.
        stepped: the clock of a stepped simulated robot in this process.
        timeout_s: timeout of each call in seconds.

    Raises:
        RobotUnreachable, BadLogin, NoTimeSync, FileMissing.
    """

    def __init__(
        self,
        address: RobotAddress,
        credentials: Credentials,
        *,
        certificate: Path | None = None,
        stepped: SteppedClock | None = None,
        timeout_s: float = RPC_TIMEOUT_S,
    ) -> None:
        certificate = certificate or (Path(os.environ[CERTIFICATE]) if os.environ.get(CERTIFICATE) else None)
        if certificate is not None:
            _check_certificate(certificate)
        self.address = address
        self.timeout_s = timeout_s
        self._credentials = credentials
        self._clients = threading.Lock()
        self.software = SoftwareVersion(0)
        root = str(certificate or _shipped_root())
        sdk = bosdyn.client.create_standard_sdk("lios-workbench", cert_resource_glob=root)
        self.robot = sdk.create_robot(address.host)
        self.robot.update_secure_channel_port(address.port)
        try:
            self._log_in()
            robot_id = self.client("robot-id").get_id(timeout=timeout_s)
            self.serial, self.software = str(robot_id.serial_number), SoftwareVersion.of(robot_id)
            self.client("directory")
            self.robot.sync_with_directory()
            self.clock: SessionClock = self._start_time_sync(stepped)
        except RpcError as error:
            self.close()
            raise self.as_line(error) from error
        except BaseException:
            self.close()
            raise

    def client(self, service: str) -> Any:
        """The SDK's client of a service (untyped); shared by all threads."""
        with self._clients:
            client: Any = self.robot.ensure_client(service, options=list(CHANNEL_OPTIONS))
            fit_to(self.software, service, client)
            return client

    def as_line(self, error: Exception) -> RobotUnreachable | ServiceMissing:
        """A bosdyn error as one of ours, which is one line."""
        return _as_line(self.address, error, self.software)

    def log_in_again(self) -> None:
        """Log in again, for example after a reboot, which invalidates tokens."""
        self._log_in()

    def close(self) -> None:
        """End background threads and close channels. Safe to call twice."""
        self.robot.__exit__(None, None, None)  # ends its threads
        self.robot.shutdown()  # closes its channels
        self.robot.channels_by_authority.clear()
        self.robot.service_clients_by_name.clear()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _log_in(self) -> None:
        try:
            self.client("auth")
            self.robot.authenticate(self._credentials.username, self._credentials.password, timeout=self.timeout_s)
        except (InvalidLoginError, InvalidTokenError, UnauthenticatedError):
            raise BadLogin(str(self.address)) from None
        except TemporarilyLockedOutError:
            raise LockedOut(str(self.address)) from None
        except BosdynError as error:
            raise self.as_line(error) from error

    def _start_time_sync(self, stepped: SteppedClock | None) -> SessionClock:
        try:
            self.client("time-sync")
            self.robot.start_time_sync(TIME_SYNC_EVERY_S)
            thread = cast("TimeSyncThread", self.robot.time_sync)  # None only before it was started
            thread.wait_for_sync(timeout_sec=2 * self.timeout_s)
        except NOT_ON_THIS_ROBOT as error:
            raise self.as_line(error) from error
        except (TimeSyncError, RpcError) as error:
            raise NoTimeSync(str(self.address)) from error
        return SyncedClock(thread) if stepped is None else SteppedSessionClock(stepped, thread.endpoint)


def _check_certificate(path: Path) -> None:
    if not path.is_file():
        raise FileMissing(path)
    with path.open("rb") as stream:
        if b"-----BEGIN CERTIFICATE-----" not in stream.read(65536):
            raise MalformedFile(path, "no certificate (PEM)", "Give the file that lios spot simulate writes")


def _shipped_root() -> Path:
    """Boston Dynamics' own root certificate, as the SDK ships it."""
    return Path(str(files("bosdyn.client.resources") / "robot.pem"))


def reason_of(error: Exception) -> str:
    """A bosdyn error in a few words: its class name as words, without gRPC details."""
    if isinstance(error, UnregisteredServiceError):
        return "the robot has no such service"
    name = type(error).__name__.removesuffix("Error")
    words = "".join(f" {ch.lower()}" if ch.isupper() and i else ch.lower() for i, ch in enumerate(name))
    return words.strip()


@contextmanager
def talking_to(host: RobotAddress) -> Generator[None]:
    """Convert bosdyn errors into one-line errors."""
    try:
        yield
    except ROBOT_ERRORS as error:
        raise _as_line(host, error) from error


def _as_line(
    host: RobotAddress, error: Exception, software: SoftwareVersion | None = None
) -> RobotUnreachable | ServiceMissing:
    if isinstance(error, NOT_ON_THIS_ROBOT):
        return ServiceMissing(str(host), _missing_name(error), software or "other than this client's")
    return RobotUnreachable(str(host), reason_of(error))


def _missing_name(error: Exception) -> tuple[str, ...]:
    """The service that an error of the SDK is about, where it names one."""
    named = re.search(r'"([^"]+)"', str(error)) if isinstance(error, UnregisteredServiceNameError) else None
    return () if named is None else (named[1],)
