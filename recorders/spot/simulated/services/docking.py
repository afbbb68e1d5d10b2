"""The simulated docking service: docks stand at the site's start; docking and undocking take DOCK_S seconds."""

from __future__ import annotations

from math import hypot

import grpc
from bosdyn.api.docking import docking_pb2, docking_service_pb2_grpc

from recorders.spot.simulated.basic_services import header_of
from recorders.spot.simulated.body import Motors, WalkState
from recorders.spot.simulated.robot import SimulatedState

DOCK_S = 5.0
NEAR_M = 1.5
"""Distance in metres from a dock within which the robot finds it."""
Feedback = docking_pb2.DockingCommandFeedbackResponse


class Docking(docking_service_pb2_grpc.DockingServiceServicer):
    """The docking service."""

    def __init__(self, state: SimulatedState) -> None:
        self._state = state
        self._began_s = 0.0
        self._wanted: int | None = None

    def DockingCommand(
        self, request: docking_pb2.DockingCommandRequest, context: grpc.ServicerContext
    ) -> docking_pb2.DockingCommandResponse:
        answer = docking_pb2.DockingCommandResponse
        with self._state.alive() as state:
            used = state.leases.use(request.lease)
            response = answer(header=header_of(state, request), lease_use_result=used, status=answer.STATUS_OK)
            undock = request.prep_pose_behavior == docking_pb2.PREP_POSE_UNDOCK
            if used.status != used.STATUS_OK:
                response.status = answer.STATUS_ERROR_LEASE
            elif undock and state.dock is None:
                response.status = answer.STATUS_ERROR_NOT_DOCKED
            elif not undock and request.docking_station_id not in state.docks:
                response.status = answer.STATUS_ERROR_DOCK_NOT_FOUND
            elif not undock and state.held is not None:
                response.status = answer.STATUS_ERROR_GRIPPER_HOLDING_ITEM
            else:
                self._began_s, self._wanted = state.body.lived_s, None if undock else request.docking_station_id
                state.body.halt(WalkState.STOPPED)
                state.body.stand(True)
                response.docking_command_id = state.number("dock")
            return response

    def DockingCommandFeedback(
        self, request: docking_pb2.DockingCommandFeedbackRequest, context: grpc.ServicerContext
    ) -> docking_pb2.DockingCommandFeedbackResponse:
        with self._state.alive() as state:
            return Feedback(header=header_of(state, request), status=self._advance(state))

    def GetDockingConfig(
        self, request: docking_pb2.GetDockingConfigRequest, context: grpc.ServicerContext
    ) -> docking_pb2.GetDockingConfigResponse:
        with self._state.alive() as state:
            answer = docking_pb2.GetDockingConfigResponse(header=header_of(state, request))
            for number in state.docks:
                answer.dock_configs.add(id_range_start=number, id_range_end=number)
            return answer

    def GetDockingState(
        self, request: docking_pb2.GetDockingStateRequest, context: grpc.ServicerContext
    ) -> docking_pb2.GetDockingStateResponse:
        with self._state.alive() as state:
            dock_state = docking_pb2.DockState
            docked = dock_state.DOCK_STATUS_UNDOCKED if state.dock is None else dock_state.DOCK_STATUS_DOCKED
            return docking_pb2.GetDockingStateResponse(
                header=header_of(state, request), dock_state=dock_state(status=docked, dock_id=state.dock or 0)
            )

    def _advance(self, state: SimulatedState) -> docking_pb2.DockingCommandFeedbackResponse.Status.ValueType:
        start, here = state.site.plan.start, state.body.pose
        if self._wanted is not None and hypot(here.x_m - start.x_m, here.y_m - start.y_m) > NEAR_M:
            return Feedback.STATUS_ERROR_TOO_DISTANT
        if state.body.motors is not Motors.ON or state.body.lived_s - self._began_s < DOCK_S:
            return Feedback.STATUS_IN_PROGRESS
        state.dock = self._wanted
        return Feedback.STATUS_AT_PREP_POSE if self._wanted is None else Feedback.STATUS_DOCKED
