"""The simulated image service: JPEG images and a depth image, drawn from the map (camera.py)."""

from __future__ import annotations

import grpc
import numpy as np
from bosdyn.api import image_pb2, image_service_pb2_grpc
from bosdyn.client.math_helpers import SE3Pose

from recorders.spot.simulated.basic_services import header_of
from recorders.spot.simulated.camera import (
    CAMERAS,
    COLUMNS,
    DEPTH_ROWS,
    FIELD_RAD,
    RAYS,
    ROWS,
    DrawnTag,
    camera_frame,
    camera_mount,
    depth_picture,
    draw,
    jpeg,
)
from recorders.spot.simulated.frames import frame_tree, in_body, stamp
from recorders.spot.simulated.robot import SimulatedState
from recorders.spot.simulated.tag_drawing import facing

DEPTH_SOURCE = "frontleft_depth"
DEPTH_HEADING_RAD = CAMERAS["frontleft_fisheye_image"]


class Images(image_service_pb2_grpc.ImageServiceServicer):
    """The image service: colour pictures, and one depth picture."""

    def __init__(self, state: SimulatedState) -> None:
        self._state = state

    def ListImageSources(
        self, request: image_pb2.ListImageSourcesRequest, context: grpc.ServicerContext
    ) -> image_pb2.ListImageSourcesResponse:
        return image_pb2.ListImageSourcesResponse(
            header=header_of(self._state, request),
            image_sources=[*(_source(name) for name in _cameras(self._state)), _depth_source()],
        )

    def GetImage(
        self, request: image_pb2.GetImageRequest, context: grpc.ServicerContext
    ) -> image_pb2.GetImageResponse:
        with self._state.alive() as state:
            pose, now = state.body.pose, stamp(state.clock.robot_ns())
            mounted = {camera_frame(name): ("body", camera_mount(name)) for name in CAMERAS}
            mounted[camera_frame(DEPTH_SOURCE)] = mounted["frontleft_fisheye"]
            tree = frame_tree(state.body, mounted)
            tags = [(t.tag, t.size_m, facing(in_body(state.body, t.position))) for t in state.tags_in_view()]
            grid = state.site.grid
        response = image_pb2.GetImageResponse(header=header_of(self._state, request))
        for wanted in request.image_requests:
            answer = response.image_responses.add(status=image_pb2.ImageResponse.STATUS_OK)
            name = wanted.image_source_name
            answer.shot.acquisition_time.CopyFrom(now)
            answer.shot.transforms_snapshot.CopyFrom(tree)
            answer.shot.frame_name_image_sensor = camera_frame(name)
            if name == DEPTH_SOURCE:
                answer.source.CopyFrom(_depth_source())
                depth = depth_picture(grid, pose, DEPTH_HEADING_RAD)
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
                camera = SE3Pose.from_proto(camera_mount(name)).inverse()
                drawn = [DrawnTag(number=n, size_m=m, camera_tform_tag=camera.mult(tag)) for n, m, tag in tags]
                picture = draw(grid, pose, CAMERAS[name], drawn, colour=name.startswith("hand"))
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


def _cameras(state: SimulatedState) -> tuple[str, ...]:
    return tuple(name for name in CAMERAS if state.site.robot.arm or not name.startswith("hand"))


def _pixels(name: str) -> image_pb2.Image.PixelFormat.ValueType:
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
    _set_lens(source)
    return source


def _set_lens(source: image_pb2.ImageSource) -> None:
    lens = source.pinhole.intrinsics
    lens.focal_length.x = lens.focal_length.y = source.cols / 2 / float(np.tan(FIELD_RAD / 2))
    lens.principal_point.x, lens.principal_point.y = (source.cols - 1) / 2, (source.rows - 1) / 2


def _depth_source() -> image_pb2.ImageSource:
    source = image_pb2.ImageSource(
        name=DEPTH_SOURCE,
        cols=RAYS,
        rows=DEPTH_ROWS,
        depth_scale=1000.0,
        image_type=image_pb2.ImageSource.IMAGE_TYPE_DEPTH,
        pixel_formats=[image_pb2.Image.PIXEL_FORMAT_DEPTH_U16],
        image_formats=[image_pb2.Image.FORMAT_RAW],
    )
    _set_lens(source)
    return source
