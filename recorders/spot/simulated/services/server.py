"""The simulated robot's gRPC server: TLS on loopback, one port for all services.

The official client connects by three of its own settings: the address, `update_secure_channel_port` and
`load_robot_cert`. A network fault stops the server with its sockets and restarts it on the same port.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from concurrent import futures
from pathlib import Path
from types import TracebackType
from typing import Any, NoReturn, Self, TypeAlias

import grpc
from bosdyn.api import (
    auth_service_pb2_grpc,
    data_buffer_service_pb2_grpc,
    directory_service_pb2_grpc,
    estop_service_pb2_grpc,
    image_service_pb2_grpc,
    lease_service_pb2_grpc,
    license_service_pb2_grpc,
    local_grid_service_pb2_grpc,
    manipulation_api_service_pb2_grpc,
    power_service_pb2_grpc,
    robot_command_service_pb2_grpc,
    robot_id_service_pb2_grpc,
    robot_state_service_pb2_grpc,
    time_sync_service_pb2_grpc,
    world_object_service_pb2_grpc,
)
from bosdyn.api.docking import docking_service_pb2_grpc
from bosdyn.api.graph_nav import graph_nav_service_pb2_grpc

from recorders.certificate import new_identity
from recorders.spot.client.connection import Credentials
from recorders.spot.client.software import SoftwareVersion
from recorders.spot.client.time_source import RobotClock, RunningClock
from recorders.spot.simulated.basic_services import (
    AUTHORITIES,
    OPEN_SERVICES,
    Auth,
    DataBuffer,
    Directory,
    RobotIdentity,
)
from recorders.spot.simulated.faults import Fault, FaultKind
from recorders.spot.simulated.robot import NEWEST, SimulatedState, new_state
from recorders.spot.simulated.sensing import State, WorldObjects
from recorders.spot.simulated.services.commands import Commands
from recorders.spot.simulated.services.docking import Docking
from recorders.spot.simulated.services.graph_nav import GraphNav
from recorders.spot.simulated.services.images import Images
from recorders.spot.simulated.services.licences import Licences
from recorders.spot.simulated.services.local_grids import LocalGrids
from recorders.spot.simulated.services.manipulation import Manipulation
from recorders.spot.simulated.services.older_software import OlderSoftware
from recorders.spot.simulated.services.permission import Estops, Leases, Power
from recorders.spot.simulated.services.time_sync import TimeSync
from workbench.errors import Failed
from workbench.worlds.house import House
from workbench.worlds.sites.site import Site

HOST = "127.0.0.1"
SIMULATED_LOGIN = Credentials(username="user", password="simulated")
MAX_MESSAGE_BYTES = 100 * 1024**2
WORKERS = 24
Handler: TypeAlias = "grpc.RpcMethodHandler[Any, Any]"
"""Of a method of any service."""

log = logging.getLogger("lios.spot.simulated")


class PortTaken(Failed):
    """The requested port is in use."""

    def __init__(self, port: int) -> None:
        super().__init__(f"port {port} of {HOST} is in use. Give another --port, or 0 for a free one.")


class SimulatedSpot:
    """A running server with its state; a context manager.

    Args:
        site: the site. house: the true house.
        port: 0 for a free one.
        login: the user that it lets in.
        faults: scheduled faults.
        seed: seed of the sensor noise.
        software: the release of its software, whose services and fields it has.

    Attributes:
        address, port: the server's address.
        certificate_pem: the root certificate that a client must trust.
        state: the robot's state; change it only within `state.alive()`.

    Raises:
        PortTaken: the port is in use.
        UntaggedItem: the house holds an item without a tag.
    """

    address = HOST

    def __init__(
        self,
        site: Site,
        house: House,
        *,
        clock: RobotClock | None = None,
        port: int = 0,
        login: Credentials = SIMULATED_LOGIN,
        faults: tuple[Fault, ...] = (),
        seed: int = 0,
        software: SoftwareVersion = NEWEST,
    ) -> None:
        self.software = software
        self.clock = clock or RunningClock()
        self.state: SimulatedState = new_state(site, house, self.clock, faults=faults, seed=seed)
        self.state.software = software
        self.state.on_drop = self._drop_from_inside
        self.username, self.password = login.username, login.password
        self._identity = new_identity(AUTHORITIES)
        self.certificate_pem = self._identity.root_pem
        self._auth = Auth(self.state, login.username, login.password)
        self.state.on_expired_tokens = self._auth.tokens.clear
        self._time_sync = TimeSync(self.state)
        self._lock = threading.Lock()
        self._timers: list[threading.Timer] = []
        self._stopped = False
        self.port = port
        self._server = self._start()

    def inject(self, kind: FaultKind, for_s: float | None = None) -> None:
        """Inject a fault now."""
        with self.state.alive() as state:
            state.apply_fault(Fault(kind=kind, at_s=state.body.lived_s, for_s=for_s))
        if kind is FaultKind.CLOCK_SKEW:
            self._time_sync.forget()

    def drop(self, seconds: float) -> None:
        """Cut all connections now; the server returns on the same port after so many seconds of wall time."""
        with self._lock:
            self._server.stop(grace=0).wait()
        timer = threading.Timer(seconds, self._come_back)
        timer.daemon = True
        self._timers.append(timer)
        timer.start()

    def write_certificate(self, path: Path) -> Path:
        """Write the root certificate to a file for `Sdk.load_robot_cert`."""
        path.write_bytes(self.certificate_pem)
        return path

    def options(self, certificate: Path, site: Path | str = "paper_home") -> list[str]:
        """The options by which a command reaches this robot: its address, a written certificate, a site."""
        return ["--robot", f"{self.address}:{self.port}", "--certificate", str(certificate), "--site", str(site)]

    def close(self) -> None:
        """Stop the server. Safe to call twice."""
        self._stopped = True
        for timer in self._timers:
            timer.cancel()
        with self._lock:
            self._server.stop(grace=0).wait()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _drop_from_inside(self, seconds: float) -> None:
        """Drop the network from within a handler, which cannot wait for its own server to stop."""
        timer = threading.Timer(0.0, self.drop, args=(seconds,))
        timer.daemon = True
        self._timers.append(timer)
        timer.start()

    def _come_back(self) -> None:
        with self._lock:
            if not self._stopped:
                self._server = self._start()
                log.info("the network is back")

    def _start(self) -> grpc.Server:
        server = grpc.server(
            futures.ThreadPoolExecutor(max_workers=WORKERS, thread_name_prefix="spot"),
            interceptors=[_TokenRequired(self._auth), OlderSoftware(self.software)],
            options=[
                ("grpc.max_send_message_length", MAX_MESSAGE_BYTES),
                ("grpc.max_receive_message_length", MAX_MESSAGE_BYTES),
                ("grpc.so_reuseport", 0),
                ("grpc.http2.min_ping_interval_without_data_ms", 1000),
                ("grpc.http2.max_ping_strikes", 0),
            ],
        )
        _register(server, self.state, self._auth, self._time_sync)
        identity = [(self._identity.key_pem, self._identity.chain_pem)]
        try:
            port = server.add_secure_port(f"{HOST}:{self.port}", grpc.ssl_server_credentials(identity))
        except RuntimeError as error:
            raise PortTaken(self.port) from error
        if port == 0:
            raise PortTaken(self.port)
        self.port = port
        server.start()
        return server


class _TokenRequired(grpc.ServerInterceptor):
    """Refuses calls without a token issued by this robot, as a real robot does."""

    def __init__(self, auth: Auth) -> None:
        self._auth = auth
        self._refuse = grpc.unary_unary_rpc_method_handler(_unauthenticated)

    def intercept_service(
        self,
        continuation: Callable[[grpc.HandlerCallDetails], Handler | None],
        handler_call_details: grpc.HandlerCallDetails,
    ) -> Handler | None:
        service = handler_call_details.method.split("/")[1]
        if service in OPEN_SERVICES:
            return continuation(handler_call_details)
        given = dict(handler_call_details.invocation_metadata).get("authorization", "")
        if str(given).removeprefix("Bearer ") in self._auth.tokens:
            return continuation(handler_call_details)
        return self._refuse


def _unauthenticated(request: object, context: grpc.ServicerContext) -> NoReturn:
    context.abort(grpc.StatusCode.UNAUTHENTICATED, "401 no valid user token")


def _register(server: grpc.Server, state: SimulatedState, auth: Auth, time_sync: TimeSync) -> None:
    directory_service_pb2_grpc.add_DirectoryServiceServicer_to_server(Directory(state), server)
    auth_service_pb2_grpc.add_AuthServiceServicer_to_server(auth, server)
    robot_id_service_pb2_grpc.add_RobotIdServiceServicer_to_server(RobotIdentity(state), server)
    time_sync_service_pb2_grpc.add_TimeSyncServiceServicer_to_server(time_sync, server)
    lease_service_pb2_grpc.add_LeaseServiceServicer_to_server(Leases(state), server)
    estop_service_pb2_grpc.add_EstopServiceServicer_to_server(Estops(state), server)
    power_service_pb2_grpc.add_PowerServiceServicer_to_server(Power(state), server)
    data_buffer_service_pb2_grpc.add_DataBufferServiceServicer_to_server(DataBuffer(state), server)
    robot_state_service_pb2_grpc.add_RobotStateServiceServicer_to_server(State(state), server)
    robot_command_service_pb2_grpc.add_RobotCommandServiceServicer_to_server(Commands(state), server)
    graph_nav_service_pb2_grpc.add_GraphNavServiceServicer_to_server(GraphNav(state), server)
    manipulation_api_service_pb2_grpc.add_ManipulationApiServiceServicer_to_server(Manipulation(state), server)
    world_object_service_pb2_grpc.add_WorldObjectServiceServicer_to_server(WorldObjects(state), server)
    image_service_pb2_grpc.add_ImageServiceServicer_to_server(Images(state), server)
    local_grid_service_pb2_grpc.add_LocalGridServiceServicer_to_server(LocalGrids(state), server)
    docking_service_pb2_grpc.add_DockingServiceServicer_to_server(Docking(state), server)
    license_service_pb2_grpc.add_LicenseServiceServicer_to_server(Licences(state), server)
