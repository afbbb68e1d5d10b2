"""The simulated local-grid service: distances to obstacles on the site's map, run-length encoded as on the robot."""

from __future__ import annotations

from functools import cached_property

import grpc
import numpy as np
from bosdyn.api import local_grid_pb2, local_grid_service_pb2_grpc

from recorders.spot.simulated.basic_services import header_of
from recorders.spot.simulated.frames import frame_tree, height_of, se3, stamp
from recorders.spot.simulated.robot import SimulatedState
from workbench.arrays import Floats, Ints, Ints16
from workbench.worlds.maps.clearance import distances_to

GRID_CELLS, GRID_CELL_M = 128, 0.03
GRIDS = ("obstacle_distance", "no_step")
CELL_SCALE = 0.01
FAR_M = 3.0
"""Obstacles are not shown further away than this."""


class LocalGrids(local_grid_service_pb2_grpc.LocalGridServiceServicer):
    """Distances to obstacles around the body, from the site's map; run-length encoded as on the robot."""

    def __init__(self, state: SimulatedState) -> None:
        self._state = state

    def GetLocalGridTypes(
        self, request: local_grid_pb2.GetLocalGridTypesRequest, context: grpc.ServicerContext
    ) -> local_grid_pb2.GetLocalGridTypesResponse:
        types = [local_grid_pb2.LocalGridType(name=name) for name in GRIDS]
        return local_grid_pb2.GetLocalGridTypesResponse(header=header_of(self._state, request), local_grid_type=types)

    def GetLocalGrids(
        self, request: local_grid_pb2.GetLocalGridsRequest, context: grpc.ServicerContext
    ) -> local_grid_pb2.GetLocalGridsResponse:
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

    def _grid(self, state: SimulatedState, name: str) -> local_grid_pb2.LocalGrid:
        half = GRID_CELLS * GRID_CELL_M / 2
        axis = (np.arange(GRID_CELLS, dtype=np.float64) + 0.5) * GRID_CELL_M - half
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

    def _clearance(self, state: SimulatedState, axis: Floats) -> Floats:
        """Distances in metres to the nearest obstacle, shape (cells along y, cells along x) in the body frame."""
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
        return np.minimum(self._far[row, column], FAR_M)

    @cached_property
    def _far(self) -> Floats:
        grid = self._state.site.grid
        assert grid is not None
        return distances_to(grid.occupied, within=FAR_M / grid.resolution_m) * grid.resolution_m


def _run_lengths(cells: Ints16) -> tuple[Ints16, Ints]:
    starts = np.flatnonzero(np.concatenate(([True], cells[1:] != cells[:-1])))
    return cells[starts], np.diff(np.concatenate((starts, [cells.size])))
