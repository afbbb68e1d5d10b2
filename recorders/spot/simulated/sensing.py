"""The simulated robot-state and world-object services."""

from __future__ import annotations

from math import atan2

import grpc
from bosdyn.api import (
    geometry_pb2,
    robot_state_pb2,
    robot_state_service_pb2_grpc,
    world_object_pb2,
    world_object_service_pb2_grpc,
)
from bosdyn.client.math_helpers import SE3Pose
from google.protobuf.duration_pb2 import Duration
from google.protobuf.timestamp_pb2 import Timestamp
from google.protobuf.wrappers_pb2 import DoubleValue

from recorders.spot.simulated.basic_services import header_of
from recorders.spot.simulated.body import BATTERY_S, Motors, wrapped
from recorders.spot.simulated.camera import CAMERAS, camera_frame, camera_mount
from recorders.spot.simulated.frames import frame_tree, height_of, in_body, kinematics, stamp
from recorders.spot.simulated.robot import LastSighting, SimulatedState
from recorders.spot.simulated.tag_drawing import facing
from workbench.worlds.sites.survey_schema import ROBOT_TAG_M


class State(robot_state_service_pb2_grpc.RobotStateServiceServicer):
    """Power, battery, faults, kinematics, emergency stop, arm."""

    def __init__(self, state: SimulatedState) -> None:
        self._state = state

    def GetRobotState(
        self, request: robot_state_pb2.RobotStateRequest, context: grpc.ServicerContext
    ) -> robot_state_pb2.RobotStateResponse:
        with self._state.alive() as state:
            return robot_state_pb2.RobotStateResponse(
                header=header_of(state, request), robot_state=_robot_state(state)
            )

    def GetRobotMetrics(
        self, request: robot_state_pb2.RobotMetricsRequest, context: grpc.ServicerContext
    ) -> robot_state_pb2.RobotMetricsResponse:
        with self._state.alive() as state:
            response = robot_state_pb2.RobotMetricsResponse(header=header_of(state, request))
            metrics = response.robot_metrics
            metrics.timestamp.CopyFrom(stamp(state.clock.robot_ns()))
            metrics.metrics.add(label="distance", units="m", float_value=state.body.walked_m)
            return response

    def GetRobotHardwareConfiguration(
        self, request: robot_state_pb2.RobotHardwareConfigurationRequest, context: grpc.ServicerContext
    ) -> robot_state_pb2.RobotHardwareConfigurationResponse:
        with self._state.alive() as state:
            response = robot_state_pb2.RobotHardwareConfigurationResponse(header=header_of(state, request))
            for name in ("body", *(("arm0.link_sh0", "arm0.link_fngr") if state.site.robot.arm else ())):
                response.hardware_configuration.skeleton.links.add(name=name)
            return response


def _robot_state(state: SimulatedState) -> robot_state_pb2.RobotState:
    body, now = state.body, stamp(state.clock.robot_ns())
    power = {
        Motors.OFF: robot_state_pb2.PowerState.STATE_OFF,
        Motors.POWERING_ON: robot_state_pb2.PowerState.STATE_POWERING_ON,
        Motors.ON: robot_state_pb2.PowerState.STATE_ON,
    }[body.motors]
    left = Duration(seconds=int(body.battery * BATTERY_S))
    percent = DoubleValue(value=round(body.battery * 100, 1))
    message = robot_state_pb2.RobotState(
        power_state=robot_state_pb2.PowerState(
            timestamp=now,
            motor_power_state=power,
            robot_power_state=robot_state_pb2.PowerState.ROBOT_POWER_STATE_ON,
            locomotion_charge_percentage=percent,
            locomotion_estimated_runtime=left,
            shore_power_state=(
                robot_state_pb2.PowerState.SHORE_POWER_STATE_ON
                if state.on_shore_power
                else robot_state_pb2.PowerState.SHORE_POWER_STATE_OFF
            ),
        ),
        kinematic_state=kinematics(state.body, state.clock.robot_ns()),
    )
    message.battery_states.add(
        timestamp=now,
        identifier="simulated",
        charge_percentage=percent,
        estimated_runtime=left,
        voltage=DoubleValue(value=52.0 + 6 * body.battery),
        status=robot_state_pb2.BatteryState.STATUS_DISCHARGING,
    )
    stopped = robot_state_pb2.EStopState
    message.estop_states.add(
        timestamp=now,
        name="software_estop",
        type=stopped.TYPE_SOFTWARE,
        state=stopped.STATE_ESTOPPED if state.estop.stopped else stopped.STATE_NOT_ESTOPPED,
    )
    _add_faults(message, state, now)
    message.comms_states.add(timestamp=now).wifi_state.current_mode = robot_state_pb2.WiFiState.MODE_ACCESS_POINT
    message.comms_states[0].wifi_state.essid = "simulated"
    for dx, dy in ((0.3, 0.17), (0.3, -0.17), (-0.3, 0.17), (-0.3, -0.17)):
        foot = message.foot_state.add(contact=robot_state_pb2.FootState.CONTACT_MADE)
        foot.foot_position_rt_body.x, foot.foot_position_rt_body.y = dx, dy
        foot.foot_position_rt_body.z = -height_of(body)
    if state.site.robot.arm:
        arm = message.manipulator_state
        arm.gripper_open_percentage = 100.0 if state.gripper_open else 0.0
        arm.is_gripper_holding_item = state.held is not None
        stow = robot_state_pb2.ManipulatorState
        arm.stow_state = stow.STOWSTATE_DEPLOYED if state.arm_deployed else stow.STOWSTATE_STOWED
        arm.carry_state = state.carry_state
    return message


def _add_faults(message: robot_state_pb2.RobotState, state: SimulatedState, now: Timestamp) -> None:
    body = state.body
    if state.critical_fault:
        message.system_fault_state.faults.add(
            name=state.critical_fault,
            onset_timestamp=now,
            severity=robot_state_pb2.SystemFault.SEVERITY_CRITICAL,
            error_message="it needs service",
        )
    if state.behaviour_fault:
        message.behavior_fault_state.faults.add(
            behavior_fault_id=1,
            onset_timestamp=now,
            cause=robot_state_pb2.BehaviorFault.CAUSE_FALL,
            status=robot_state_pb2.BehaviorFault.STATUS_CLEARABLE,
        )
    if body.stuck or not state.localized:
        name = "obstacle" if body.stuck else "lost"
        message.system_fault_state.faults.add(
            name=name,
            onset_timestamp=now,
            severity=robot_state_pb2.SystemFault.SEVERITY_WARN,
            error_message="something stands in the way" if body.stuck else "not localized to the map",
        )


class WorldObjects(world_object_service_pb2_grpc.WorldObjectServiceServicer):
    """Recently detected tags with their detection times."""

    def __init__(self, state: SimulatedState) -> None:
        self._state = state

    def ListWorldObjects(
        self, request: world_object_pb2.ListWorldObjectRequest, context: grpc.ServicerContext
    ) -> world_object_pb2.ListWorldObjectResponse:
        with self._state.alive() as state:
            response = world_object_pb2.ListWorldObjectResponse(header=header_of(state, request))
            wanted = not request.object_type or world_object_pb2.WORLD_OBJECT_APRILTAG in request.object_type
            since = request.timestamp_filter
            for tag, seen in sorted(state.sightings.items()):
                at = stamp(seen.robot_ns)
                if not wanted or (since.seconds, since.nanos) > (at.seconds, at.nanos):
                    continue
                camera, body_tform_camera, where = _as_detected(seen)
                names = (f"fiducial_{tag}", f"filtered_fiducial_{tag}")
                frames = {camera: ("body", body_tform_camera), **dict.fromkeys(names, ("body", where))}
                found = response.world_objects.add(
                    id=tag,
                    name=f"world_obj_apriltag_{tag:03d}",
                    acquisition_time=at,
                    transforms_snapshot=frame_tree(seen.body, frames),
                    object_lifetime=Duration(seconds=15),
                )
                mark = found.apriltag_properties
                mark.tag_id, mark.dimensions.x, mark.dimensions.y = tag, ROBOT_TAG_M, ROBOT_TAG_M
                mark.frame_name_fiducial, mark.frame_name_fiducial_filtered = names
                mark.frame_name_camera = camera
                mark.fiducial_pose_status = (
                    world_object_pb2.AprilTagProperties.STATUS_OK if tag in state.fiducials else state.tag_status
                )
                mark.fiducial_filtered_pose_status = world_object_pb2.AprilTagProperties.STATUS_OK
            return response

    def MutateWorldObjects(
        self, request: world_object_pb2.MutateWorldObjectRequest, context: grpc.ServicerContext
    ) -> world_object_pb2.MutateWorldObjectResponse:
        answer = world_object_pb2.MutateWorldObjectResponse
        return answer(header=header_of(self._state, request), status=answer.STATUS_NO_PERMISSION)


def _as_detected(seen: LastSighting) -> tuple[str, geometry_pb2.SE3Pose, geometry_pb2.SE3Pose]:
    """The camera that saw a tag, body_tform_camera, and body_tform_tag as the detector places it.

    It takes each tag for one of ROBOT_TAG_M: a smaller one seems as much farther away along the line of sight.
    """
    tag = facing(in_body(seen.body, seen.position))
    bearing = atan2(tag.y, tag.x)
    body_cameras = {name: heading for name, heading in CAMERAS.items() if not name.startswith("hand")}
    name = min(body_cameras, key=lambda n: abs(wrapped(bearing - body_cameras[n])))
    camera = SE3Pose.from_proto(camera_mount(name))
    at = camera.inverse().mult(tag)
    stretch = ROBOT_TAG_M / seen.size_m
    far = SE3Pose(x=at.x * stretch, y=at.y * stretch, z=at.z * stretch, rot=at.rot)
    return camera_frame(name), camera_mount(name), camera.mult(far).to_proto()
