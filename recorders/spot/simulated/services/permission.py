"""The simulated lease, emergency-stop and power services."""

from __future__ import annotations

import grpc
from bosdyn.api import (
    estop_pb2,
    estop_service_pb2_grpc,
    lease_pb2,
    lease_service_pb2_grpc,
    power_pb2,
    power_service_pb2_grpc,
)

from recorders.spot.simulated.basic_services import header_of
from recorders.spot.simulated.body import Motors, WalkState
from recorders.spot.simulated.leases import PARTS, ROOT
from recorders.spot.simulated.robot import SimulatedState


class Leases(lease_service_pb2_grpc.LeaseServiceServicer):
    """The lease service."""

    def __init__(self, state: SimulatedState) -> None:
        self._state = state

    def AcquireLease(
        self, request: lease_pb2.AcquireLeaseRequest, context: grpc.ServicerContext
    ) -> lease_pb2.AcquireLeaseResponse:
        answer = lease_pb2.AcquireLeaseResponse
        with self._state.alive() as state:
            if request.resource != ROOT:
                return answer(header=header_of(state, request), status=answer.STATUS_INVALID_RESOURCE)
            if not state.leases.is_free:
                status = answer.STATUS_RESOURCE_ALREADY_CLAIMED
                return answer(header=header_of(state, request), status=status, lease_owner=state.leases.owner)
            lease = state.leases.grant(request.header.client_name)
            owner = state.leases.owner
            return answer(header=header_of(state, request), status=answer.STATUS_OK, lease=lease, lease_owner=owner)

    def TakeLease(
        self, request: lease_pb2.TakeLeaseRequest, context: grpc.ServicerContext
    ) -> lease_pb2.TakeLeaseResponse:
        answer = lease_pb2.TakeLeaseResponse
        with self._state.alive() as state:
            if request.resource != ROOT:
                return answer(header=header_of(state, request), status=answer.STATUS_INVALID_RESOURCE)
            state.body.halt(WalkState.NO_LEASE)
            lease = state.leases.grant(request.header.client_name)
            owner = state.leases.owner
            return answer(header=header_of(state, request), status=answer.STATUS_OK, lease=lease, lease_owner=owner)

    def ReturnLease(
        self, request: lease_pb2.ReturnLeaseRequest, context: grpc.ServicerContext
    ) -> lease_pb2.ReturnLeaseResponse:
        answer = lease_pb2.ReturnLeaseResponse
        with self._state.alive() as state:
            returned = state.leases.give_back(request.lease)
            if returned:
                state.body.halt(WalkState.NO_LEASE)
            status = answer.STATUS_OK if returned else answer.STATUS_NOT_ACTIVE_LEASE
            return answer(header=header_of(state, request), status=status)

    def RetainLease(
        self, request: lease_pb2.RetainLeaseRequest, context: grpc.ServicerContext
    ) -> lease_pb2.RetainLeaseResponse:
        with self._state.alive() as state:
            used = state.leases.use(request.lease)
            return lease_pb2.RetainLeaseResponse(header=header_of(state, request), lease_use_result=used)

    def ListLeases(
        self, request: lease_pb2.ListLeasesRequest, context: grpc.ServicerContext
    ) -> lease_pb2.ListLeasesResponse:
        with self._state.alive() as state:
            book = state.leases
            resource = lease_pb2.LeaseResource(resource=ROOT, is_stale=book.owner is not None and book.is_free)
            if book.owner is not None:
                resource.lease_owner.CopyFrom(book.owner)
            if book.latest is not None:
                resource.lease.CopyFrom(book.latest)
            tree = lease_pb2.ResourceTree(
                resource=ROOT, sub_resources=[lease_pb2.ResourceTree(resource=part) for part in PARTS]
            )
            return lease_pb2.ListLeasesResponse(
                header=header_of(state, request), resources=[resource], resource_tree=tree
            )


class Estops(estop_service_pb2_grpc.EstopServiceServicer):
    """The emergency-stop service."""

    def __init__(self, state: SimulatedState) -> None:
        self._state = state

    def RegisterEstopEndpoint(
        self, request: estop_pb2.RegisterEstopEndpointRequest, context: grpc.ServicerContext
    ) -> estop_pb2.RegisterEstopEndpointResponse:
        answer = estop_pb2.RegisterEstopEndpointResponse
        with self._state.alive() as state:
            if request.target_config_id and request.target_config_id != state.estop.config_id:
                return answer(header=header_of(state, request), status=answer.STATUS_CONFIG_MISMATCH)
            wanted = estop_pb2.EstopEndpoint()
            wanted.CopyFrom(request.new_endpoint)
            wanted.unique_id = request.target_endpoint.unique_id or wanted.unique_id
            endpoint = state.estop.register(wanted)
            return answer(header=header_of(state, request), status=answer.STATUS_SUCCESS, new_endpoint=endpoint)

    def DeregisterEstopEndpoint(
        self, request: estop_pb2.DeregisterEstopEndpointRequest, context: grpc.ServicerContext
    ) -> estop_pb2.DeregisterEstopEndpointResponse:
        answer = estop_pb2.DeregisterEstopEndpointResponse
        with self._state.alive() as state:
            if state.body.motors is not Motors.OFF:
                return answer(header=header_of(state, request), status=answer.STATUS_MOTORS_ON)
            gone = state.estop.deregister(request.target_endpoint.unique_id)
            status = answer.STATUS_SUCCESS if gone else answer.STATUS_ENDPOINT_MISMATCH
            return answer(header=header_of(state, request), status=status)

    def EstopCheckIn(
        self, request: estop_pb2.EstopCheckInRequest, context: grpc.ServicerContext
    ) -> estop_pb2.EstopCheckInResponse:
        with self._state.alive() as state:
            status, challenge = state.estop.check_in(request)
            return estop_pb2.EstopCheckInResponse(
                header=header_of(state, request), request=request, challenge=challenge, status=status
            )

    def GetEstopConfig(
        self, request: estop_pb2.GetEstopConfigRequest, context: grpc.ServicerContext
    ) -> estop_pb2.GetEstopConfigResponse:
        with self._state.alive() as state:
            config = state.estop.config()
            return estop_pb2.GetEstopConfigResponse(header=header_of(state, request), active_config=config)

    def SetEstopConfig(
        self, request: estop_pb2.SetEstopConfigRequest, context: grpc.ServicerContext
    ) -> estop_pb2.SetEstopConfigResponse:
        answer = estop_pb2.SetEstopConfigResponse
        with self._state.alive() as state:
            if state.body.motors is not Motors.OFF:
                status, config = answer.STATUS_MOTORS_ON, state.estop.config()
            elif request.target_config_id and request.target_config_id != state.estop.config_id:
                status, config = answer.STATUS_INVALID_ID, state.estop.config()
            else:
                status, config = answer.STATUS_SUCCESS, state.estop.configure(request.config)
            return answer(header=header_of(state, request), status=status, active_config=config)

    def GetEstopSystemStatus(
        self, request: estop_pb2.GetEstopSystemStatusRequest, context: grpc.ServicerContext
    ) -> estop_pb2.GetEstopSystemStatusResponse:
        with self._state.alive() as state:
            status = state.estop.status()
            return estop_pb2.GetEstopSystemStatusResponse(header=header_of(state, request), status=status)


class Power(power_service_pb2_grpc.PowerServiceServicer):
    """The power service: motors on and off."""

    def __init__(self, state: SimulatedState) -> None:
        self._state = state
        self._last = power_pb2.STATUS_SUCCESS

    def PowerCommand(
        self, request: power_pb2.PowerCommandRequest, context: grpc.ServicerContext
    ) -> power_pb2.PowerCommandResponse:
        with self._state.alive() as state:
            used = state.leases.use(request.lease)
            answer = power_pb2.PowerCommandResponse(header=header_of(state, request), lease_use_result=used)
            if used.status != used.STATUS_OK:
                return answer
            answer.power_command_id = state.number("power")
            if request.request == power_pb2.PowerCommandRequest.REQUEST_OFF:
                state.body.power_off()
                answer.status = power_pb2.STATUS_SUCCESS
            elif request.request != power_pb2.PowerCommandRequest.REQUEST_ON:
                answer.status = power_pb2.STATUS_INTERNAL_ERROR
            elif state.power_refusal:
                answer.status = state.power_refusal
            elif state.estop.stopped:
                answer.status = power_pb2.STATUS_ESTOPPED
            else:
                state.body.power_on()
                answer.status = power_pb2.STATUS_IN_PROGRESS
            return answer

    def PowerCommandFeedback(
        self, request: power_pb2.PowerCommandFeedbackRequest, context: grpc.ServicerContext
    ) -> power_pb2.PowerCommandFeedbackResponse:
        with self._state.alive() as state:
            status = {
                Motors.ON: power_pb2.STATUS_SUCCESS,
                Motors.POWERING_ON: power_pb2.STATUS_IN_PROGRESS,
                Motors.OFF: power_pb2.STATUS_ESTOPPED if state.estop.stopped else power_pb2.STATUS_SUCCESS,
            }[state.body.motors]
            return power_pb2.PowerCommandFeedbackResponse(header=header_of(state, request), status=status)
