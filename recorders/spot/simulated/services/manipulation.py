"""The simulated manipulation service: a grasp at a point takes PICK_S seconds."""

from __future__ import annotations

import grpc
from bosdyn.api import manipulation_api_pb2, manipulation_api_service_pb2_grpc

from recorders.spot.simulated.basic_services import header_of
from recorders.spot.simulated.body import Motors
from recorders.spot.simulated.frames import frame_tree, point_in_map
from recorders.spot.simulated.robot import PICK_S, SimulatedState


class Manipulation(manipulation_api_service_pb2_grpc.ManipulationApiServiceServicer):
    """Grasps the item at a point within PICK_S seconds."""

    def __init__(self, state: SimulatedState) -> None:
        self._state = state

    def ManipulationApi(
        self, request: manipulation_api_pb2.ManipulationApiRequest, context: grpc.ServicerContext
    ) -> manipulation_api_pb2.ManipulationApiResponse:
        with self._state.alive() as state:
            used = state.leases.use(request.lease)
            response = manipulation_api_pb2.ManipulationApiResponse(
                header=header_of(state, request), lease_use_result=used
            )
            if used.status != used.STATUS_OK:
                return response
            if request.HasField("pick_object") and state.body.motors is Motors.ON:
                wanted = request.pick_object
                point = (wanted.object_rt_frame.x, wanted.object_rt_frame.y, wanted.object_rt_frame.z)
                at = point_in_map(state.body, wanted.frame_name, point)
                response.manipulation_cmd_id = state.begin_grasp(at) if at is not None else state.number("grasp")
            else:
                response.manipulation_cmd_id = state.number("grasp")
            return response

    def ManipulationApiFeedback(
        self, request: manipulation_api_pb2.ManipulationApiFeedbackRequest, context: grpc.ServicerContext
    ) -> manipulation_api_pb2.ManipulationApiFeedbackResponse:
        api = manipulation_api_pb2
        with self._state.alive() as state:
            grasp = state.grasp
            known = grasp is not None and grasp.number == request.manipulation_cmd_id
            if not known or grasp is None or state.body.motors is not Motors.ON:
                status = api.MANIP_STATE_GRASP_FAILED
            elif (took := state.body.lived_s - grasp.began_s) < PICK_S:
                phases = (
                    api.MANIP_STATE_SEARCHING_FOR_GRASP,
                    api.MANIP_STATE_MOVING_TO_GRASP,
                    api.MANIP_STATE_GRASPING_OBJECT,
                )
                status = phases[min(2, int(3 * took / PICK_S))]
            elif grasp.thing is not None and grasp.thing.held:
                status = api.MANIP_STATE_GRASP_SUCCEEDED
            else:
                status = api.MANIP_STATE_GRASP_FAILED
            return api.ManipulationApiFeedbackResponse(
                header=header_of(state, request),
                manipulation_cmd_id=request.manipulation_cmd_id,
                current_state=status,
                transforms_snapshot_manipulation_data=frame_tree(state.body),
            )

    def OverrideGrasp(
        self, request: manipulation_api_pb2.ApiGraspOverrideRequest, context: grpc.ServicerContext
    ) -> manipulation_api_pb2.ApiGraspOverrideResponse:
        with self._state.alive() as state:
            if state.held is not None:
                state.carry_state = request.carry_state_override.override_request
        return manipulation_api_pb2.ApiGraspOverrideResponse(header=header_of(self._state, request))
