"""Older software of a simulated robot: an interceptor that removes later calls and fields.

By comparison of the descriptors of bosdyn-api 3.0.0, 3.3.2, 4.0.0, 4.1.1, 5.0.0 and 5.2.0: of the methods that the
client calls and the fields that the simulated robot fills, those that came later than 3.0.0, each with the first of
these releases that has it. Every field that the client sends is in all of them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, NoReturn, TypeAlias, final

import grpc
from google.protobuf.descriptor import FieldDescriptor
from google.protobuf.message import Message

from recorders.spot.client.software import SoftwareVersion

Handler: TypeAlias = "grpc.RpcMethodHandler[Any, Any]"
METHODS_SINCE: Mapping[str, SoftwareVersion] = MappingProxyType(
    {
        "/bosdyn.api.graph_nav.GraphNavService/DownloadGraphStreaming": SoftwareVersion(4, 1),
        "/bosdyn.api.graph_nav.GraphNavService/UploadGraphStreaming": SoftwareVersion(4, 1),
    }
)
FIELDS_SINCE: Mapping[str, SoftwareVersion] = MappingProxyType(
    {
        "bosdyn.api.ImageSource.image_formats": SoftwareVersion(3, 3),
        "bosdyn.api.ImageSource.pixel_formats": SoftwareVersion(3, 3),
        "bosdyn.api.WorldObject.object_lifetime": SoftwareVersion(3, 3),
        "bosdyn.api.graph_nav.NavigationFeedbackResponse.remaining_route_length": SoftwareVersion(4),
    }
)


@final
@dataclass(frozen=True, slots=True)
class OlderSoftware(grpc.ServerInterceptor):
    """Refuses methods and leaves out fields that the software does not have."""

    software: SoftwareVersion

    def intercept_service(
        self,
        continuation: Callable[[grpc.HandlerCallDetails], Handler | None],
        handler_call_details: grpc.HandlerCallDetails,
    ) -> Handler | None:
        since = METHODS_SINCE.get(handler_call_details.method)
        if since is not None and self.software < since:
            return grpc.unary_unary_rpc_method_handler(_unimplemented)
        handler = continuation(handler_call_details)
        lacking = frozenset(name for name, version in FIELDS_SINCE.items() if self.software < version)
        if handler is None or not lacking or handler.unary_unary is None:
            return handler
        answer: Callable[[Any, grpc.ServicerContext], Message] = handler.unary_unary

        def answer_without(request: Any, context: grpc.ServicerContext) -> Message:
            return without(answer(request, context), lacking)

        return grpc.unary_unary_rpc_method_handler(
            answer_without, handler.request_deserializer, handler.response_serializer
        )


def without(message: Message, lacking: frozenset[str]) -> Message:
    """The message, from which fields are removed in place, also in the messages that it holds.

    Args:
        lacking: full names of fields.
    """
    for field, value in message.ListFields():
        if field.full_name in lacking:
            message.ClearField(field.name)
        elif field.type == FieldDescriptor.TYPE_MESSAGE:
            for part in value if field.is_repeated else (value,):
                if isinstance(part, Message):  # and no key of a map
                    without(part, lacking)
    return message


def _unimplemented(request: object, context: grpc.ServicerContext) -> NoReturn:
    context.abort(grpc.StatusCode.UNIMPLEMENTED, "no such method")
