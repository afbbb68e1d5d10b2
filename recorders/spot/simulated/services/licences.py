"""The simulated licence service."""

from __future__ import annotations

import grpc
from bosdyn.api import license_pb2, license_service_pb2_grpc

from recorders.spot.simulated.basic_services import header_of
from recorders.spot.simulated.robot import SimulatedState

FEATURES = ("arm", "graph-nav")


class Licences(license_service_pb2_grpc.LicenseServiceServicer):
    """The licence service."""

    def __init__(self, state: SimulatedState) -> None:
        self._state = state

    def GetLicenseInfo(
        self, request: license_pb2.GetLicenseInfoRequest, context: grpc.ServicerContext
    ) -> license_pb2.GetLicenseInfoResponse:
        with self._state.alive() as state:
            info = license_pb2.LicenseInfo(status=state.licence, id="simulated", licensed_features=FEATURES)
            return license_pb2.GetLicenseInfoResponse(header=header_of(state, request), license=info)

    def GetFeatureEnabled(
        self, request: license_pb2.GetFeatureEnabledRequest, context: grpc.ServicerContext
    ) -> license_pb2.GetFeatureEnabledResponse:
        with self._state.alive() as state:
            valid = state.licence == license_pb2.LicenseInfo.STATUS_VALID
            answer = license_pb2.GetFeatureEnabledResponse(header=header_of(state, request))
            for feature in request.feature_codes:
                answer.feature_enabled[feature] = valid and feature in FEATURES
            return answer
