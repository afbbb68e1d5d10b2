"""What does the robot sense? Its state, tags, pictures, and the grid of what is around it."""

from __future__ import annotations

from functools import cached_property
from math import atan2
from typing import Any

import numpy as np
from bosdyn.api import (
    image_pb2,
    image_service_pb2_grpc,
    local_grid_pb2,
    local_grid_service_pb2_grpc,
    robot_state_pb2,
    robot_state_service_pb2_grpc,
    world_object_pb2,
    world_object_service_pb2_grpc,
)
from google.protobuf.duration_pb2 import Duration
from google.protobuf.wrappers_pb2 import DoubleValue
from scipy.ndimage import distance_transform_edt

from recorders.spot.simulated.body import BATTERY_S, Motors
from recorders.spot.simulated.camera import CAMERAS, COLUMNS, FIELD_RAD, RAYS, ROWS, depth_picture, draw, jpeg
from recorders.spot.simulated.frames import frame_tree, height_of, in_body, se3, stamp
from recorders.spot.simulated.motion import kinematics
from recorders.spot.simulated.robot import RobotState
from recorders.spot.simulated.services import header_of

TAG_M = 0.146
DEPTH_SOURCE = "frontleft_depth"
GRID_CELLS, GRID_CELL_M = 128, 0.03
GRIDS = ("obstacle_distance", "no_step")
CELL_SCALE = 0.01


class State(robot_state_service_pb2_grpc.RobotStateServiceServicer):
    """Power, battery, faults, kinematics, emergency stop, arm."""

    def __init__(self, state: RobotState) -> None:
        self._state = state

    def GetRobotState(self, request: Any, context: Any) -> Any:
        with self._state.alive() as state:
            return robot_state_pb2.RobotStateResponse(
                header=header_of(state, request), robot_state=_robot_state(state)
            )

    def GetRobotMetrics(self, request: Any, context: Any) -> Any:
        with self._state.alive() as state:
            response = robot_state_pb2.RobotMetricsResponse(header=header_of(state, request))
            metrics = response.robot_metrics
            metrics.timestamp.CopyFrom(stamp(state.clock.robot_ns()))
            metrics.metrics.add(label="distance", units="m", float_value=state.body.walked_m)
            return response

    def GetRobotHardwareConfiguration(self, request: Any, context: Any) -> Any:
        with self._state.alive() as state:
            response = robot_state_pb2.RobotHardwareConfigurationResponse(header=header_of(state, request))
            for name in ("body", *(("arm0.link_sh0", "arm0.link_fngr") if state.site.robot.arm else ())):
                response.hardware_configuration.skeleton.links.add(name=name)
            return response


def _robot_state(state: RobotState) -> robot_state_pb2.RobotState:
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
        ),
        kinematic_state=kinematics(state),
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
    if body.stuck or not state.localized:
        name = "obstacle" if body.stuck else "lost"
        message.system_fault_state.faults.add(
            name=name,
            onset_timestamp=now,
            severity=robot_state_pb2.SystemFault.SEVERITY_WARN,
            error_message="something stands in the way" if body.stuck else "not localized to the map",
        )
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
        arm.carry_state = stow.CARRY_STATE_CARRIABLE if state.held is not None else stow.CARRY_STATE_NOT_CARRIABLE
    return message


class WorldObjects(world_object_service_pb2_grpc.WorldObjectServiceServicer):
    """The tags that were seen lately, each with the time when it was."""

    def __init__(self, state: RobotState) -> None:
        self._state = state

    def ListWorldObjects(self, request: Any, context: Any) -> Any:
        with self._state.alive() as state:
            response = world_object_pb2.ListWorldObjectResponse(header=header_of(state, request))
            wanted = not request.object_type or world_object_pb2.WORLD_OBJECT_APRILTAG in request.object_type
            since = request.timestamp_filter
            for tag, seen in sorted(state.sightings.items()):
                at = stamp(seen.robot_ns)
                if not wanted or (since.seconds, since.nanos) > (at.seconds, at.nanos):
                    continue
                x, y, z = in_body(state.body, seen.position)
                where = se3(x, y, z, atan2(y, x))
                names = (f"fiducial_{tag}", f"filtered_fiducial_{tag}")
                found = response.world_objects.add(
                    id=tag,
                    name=f"world_obj_apriltag_{tag:03d}",
                    acquisition_time=at,
                    transforms_snapshot=frame_tree(state.body, dict.fromkeys(names, ("body", where))),
                    object_lifetime=Duration(seconds=15),
                )
                mark = found.apriltag_properties
                mark.tag_id, mark.dimensions.x, mark.dimensions.y = tag, TAG_M, TAG_M
                mark.frame_name_fiducial, mark.frame_name_fiducial_filtered = names
                mark.frame_name_camera = "frontleft_fisheye"
                mark.fiducial_pose_status = world_object_pb2.AprilTagProperties.STATUS_OK
                mark.fiducial_filtered_pose_status = world_object_pb2.AprilTagProperties.STATUS_OK
            return response

    def MutateWorldObjects(self, request: Any, context: Any) -> Any:
        answer = world_object_pb2.MutateWorldObjectResponse
        return answer(header=header_of(self._state, request), status=answer.STATUS_NO_PERMISSION)


class Images(image_service_pb2_grpc.ImageServiceServicer):
    def __init__(self, state: RobotState) -> None:
        self._state = state

    def ListImageSources(self, request: Any, context: Any) -> Any:
        return image_pb2.ListImageSourcesResponse(
            header=header_of(self._state, request),
            image_sources=[*(_source(name) for name in _cameras(self._state)), _depth_source()],
        )

    def GetImage(self, request: Any, context: Any) -> Any:
        with self._state.alive() as state:
            pose, now = state.body.pose, stamp(state.clock.robot_ns())
            tree = frame_tree(state.body, {_frame(n): ("body", se3(0.3, 0, 0, a)) for n, a in CAMERAS.items()})
            tags = [t.position for t in state.things if t.tag in state.sightings]
            grid = state.site.grid
        response = image_pb2.GetImageResponse(header=header_of(self._state, request))
        for wanted in request.image_requests:
            answer = response.image_responses.add(status=image_pb2.ImageResponse.STATUS_OK)
            name = wanted.image_source_name
            answer.shot.acquisition_time.CopyFrom(now)
            answer.shot.transforms_snapshot.CopyFrom(tree)
            answer.shot.frame_name_image_sensor = _frame(name)
            if name == DEPTH_SOURCE:
                answer.source.CopyFrom(_depth_source())
                depth = depth_picture(grid, pose, CAMERAS["frontleft_fisheye_image"])
                answer.shot.image.CopyFrom(
                    image_pb2.Image(
                        cols=depth.shape[1],
                        rows=depth.shape[0],
                        data=depth.tobytes(),
                        format=image_pb2.Image.FORMAT_RAW,
                        pixel_format=image_pb2.Image.PIXEL_FORMAT_DEPTH_U16,
                    )
                )
            elif name in _cameras(self._state):
                answer.source.CopyFrom(_source(name))
                picture = draw(grid, pose, CAMERAS[name], tags, colour=name.startswith("hand"))
                data, cols, rows = jpeg(picture, quality=int(wanted.quality_percent or 75), ratio=wanted.resize_ratio)
                answer.shot.image.CopyFrom(
                    image_pb2.Image(
                        cols=cols,
                        rows=rows,
                        data=data,
                        format=image_pb2.Image.FORMAT_JPEG,
                        pixel_format=_pixels(name),
                    )
                )
            else:
                answer.status = image_pb2.ImageResponse.STATUS_UNKNOWN_CAMERA
        return response


def _cameras(state: RobotState) -> tuple[str, ...]:
    return tuple(name for name in CAMERAS if state.site.robot.arm or not name.startswith("hand"))


def _frame(name: str) -> str:
    return name.removesuffix("_image")


def _pixels(name: str) -> Any:
    hand = name.startswith("hand")
    return image_pb2.Image.PIXEL_FORMAT_RGB_U8 if hand else image_pb2.Image.PIXEL_FORMAT_GREYSCALE_U8


def _source(name: str) -> image_pb2.ImageSource:
    source = image_pb2.ImageSource(
        name=name,
        cols=COLUMNS,
        rows=ROWS,
        image_type=image_pb2.ImageSource.IMAGE_TYPE_VISUAL,
        pixel_formats=[_pixels(name)],
        image_formats=[image_pb2.Image.FORMAT_JPEG],
    )
    focal = COLUMNS / 2 / float(np.tan(FIELD_RAD / 2))
    source.pinhole.intrinsics.focal_length.x = source.pinhole.intrinsics.focal_length.y = focal
    source.pinhole.intrinsics.principal_point.x = COLUMNS / 2
    source.pinhole.intrinsics.principal_point.y = ROWS / 2
    return source


def _depth_source() -> image_pb2.ImageSource:
    return image_pb2.ImageSource(
        name=DEPTH_SOURCE,
        cols=RAYS,
        rows=60,
        depth_scale=1000.0,
        image_type=image_pb2.ImageSource.IMAGE_TYPE_DEPTH,
        pixel_formats=[image_pb2.Image.PIXEL_FORMAT_DEPTH_U16],
        image_formats=[image_pb2.Image.FORMAT_RAW],
    )


class LocalGrids(local_grid_service_pb2_grpc.LocalGridServiceServicer):
    """Distances to obstacles around the body, from the site's map; run-length encoded as on the robot."""

    def __init__(self, state: RobotState) -> None:
        self._state = state

    def GetLocalGridTypes(self, request: Any, context: Any) -> Any:
        types = [local_grid_pb2.LocalGridType(name=name) for name in GRIDS]
        return local_grid_pb2.GetLocalGridTypesResponse(header=header_of(self._state, request), local_grid_type=types)

    def GetLocalGrids(self, request: Any, context: Any) -> Any:
        with self._state.alive() as state:
            response = local_grid_pb2.GetLocalGridsResponse(header=header_of(state, request))
            for wanted in request.local_grid_requests:
                name = wanted.local_grid_type_name
                answer = response.local_grid_responses.add(local_grid_type_name=name)
                if name not in GRIDS:
                    answer.status = local_grid_pb2.LocalGridResponse.STATUS_NO_SUCH_GRID
                    response.num_local_grid_errors += 1
                    continue
                answer.status = local_grid_pb2.LocalGridResponse.STATUS_OK
                answer.local_grid.CopyFrom(self._grid(state, name))
            return response

    def _grid(self, state: RobotState, name: str) -> local_grid_pb2.LocalGrid:
        half = GRID_CELLS * GRID_CELL_M / 2
        axis = (np.arange(GRID_CELLS) + 0.5) * GRID_CELL_M - half
        metres = self._clearance(state, axis)
        cells = np.round(metres / CELL_SCALE).astype(np.int16)
        if name == "no_step":
            cells = (metres > 0.1).astype(np.int16)
        values, counts = _run_lengths(cells.ravel())
        corner = se3(-half, -half, -height_of(state.body), 0.0)
        return local_grid_pb2.LocalGrid(
            local_grid_type_name=name,
            acquisition_time=stamp(state.clock.robot_ns()),
            transforms_snapshot=frame_tree(state.body, {f"{name}_corner": ("body", corner)}),
            frame_name_local_grid_data=f"{name}_corner",
            extent=local_grid_pb2.LocalGridExtent(
                cell_size=GRID_CELL_M, num_cells_x=GRID_CELLS, num_cells_y=GRID_CELLS
            ),
            cell_format=local_grid_pb2.LocalGrid.CELL_FORMAT_INT16,
            encoding=local_grid_pb2.LocalGrid.ENCODING_RLE,
            data=values.astype("<i2").tobytes(),
            rle_counts=counts.tolist(),
            cell_value_scale=CELL_SCALE if name == "obstacle_distance" else 1.0,
            cell_value_offset=0.0,
        )

    def _clearance(self, state: RobotState, axis: Any) -> Any:
        """Metres to the nearest obstacle, shape (cells along y, cells along x) of the body frame."""
        grid = state.site.grid
        if grid is None:
            return np.full((len(axis), len(axis)), 1.0)
        pose = state.body.pose
        c, s = np.cos(pose.yaw_rad), np.sin(pose.yaw_rad)
        x = pose.x_m + c * axis[None, :] - s * axis[:, None]
        y = pose.y_m + s * axis[None, :] + c * axis[:, None]
        rows, columns = self._far.shape
        row = np.clip(((y - grid.origin[1]) / grid.resolution_m).astype(np.int64), 0, rows - 1)
        column = np.clip(((x - grid.origin[0]) / grid.resolution_m).astype(np.int64), 0, columns - 1)
        return np.minimum(self._far[row, column], 3.0)

    @cached_property
    def _far(self) -> Any:
        grid = self._state.site.grid
        assert grid is not None
        return np.asarray(distance_transform_edt(~grid.occupied)) * grid.resolution_m


def _run_lengths(cells: Any) -> tuple[Any, Any]:
    starts = np.flatnonzero(np.concatenate(([True], cells[1:] != cells[:-1])))
    return cells[starts], np.diff(np.concatenate((starts, [cells.size])))
