"""Writes type stubs of bosdyn.api for pyright; the SDK ships none.

The SDK holds each .proto as a descriptor. protoc's plugins of mypy-protobuf take descriptors on standard input, so
protoc itself and the .proto files are not needed. The stubs follow the SDK that is installed and are not kept in git.

    python .ci/spot_stubs.py typings
"""

from __future__ import annotations

import pkgutil
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import bosdyn.api
from google.protobuf.compiler.plugin_pb2 import CodeGeneratorRequest, CodeGeneratorResponse
from google.protobuf.descriptor import FileDescriptor

PLUGINS = ("main", "grpc")
"""The functions of mypy_protobuf.main that are protoc-gen-mypy and protoc-gen-mypy_grpc."""


def write_stubs(folder: Path) -> None:
    """Writes one .pyi per module of messages and one per module of services under `folder`."""
    asked = _request()
    for plugin in PLUGINS:
        for file in _answer(plugin, asked).file:
            if plugin == "grpc" and "class " not in file.content:
                continue  # no service, and so no such module
            path = folder / file.name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(file.content, encoding="utf-8")


def _request() -> CodeGeneratorRequest:
    """What protoc would ask a plugin: every file of bosdyn.api, each after the files that it imports."""
    names = sorted(m.name for m in pkgutil.walk_packages(bosdyn.api.__path__, "bosdyn.api."))
    request = CodeGeneratorRequest(parameter="quiet,only_sync,generate_concrete_servicer_stubs")
    placed: set[str] = set()
    for name in names:
        if name.endswith("_pb2"):
            descriptor = import_module(name).DESCRIPTOR
            request.file_to_generate.append(descriptor.name)
            _place(descriptor, request, placed)
    return request


def _place(descriptor: FileDescriptor, request: CodeGeneratorRequest, placed: set[str]) -> None:
    if descriptor.name in placed:
        return
    placed.add(descriptor.name)
    for needed in descriptor.dependencies:
        _place(needed, request, placed)
    descriptor.CopyToProto(request.proto_file.add())


def _answer(plugin: str, request: CodeGeneratorRequest) -> CodeGeneratorResponse:
    made = subprocess.run(
        [sys.executable, "-c", f"from mypy_protobuf.main import {plugin}; {plugin}()"],
        input=request.SerializeToString(),
        stdout=subprocess.PIPE,
        check=True,
    )
    return CodeGeneratorResponse.FromString(made.stdout)


if __name__ == "__main__":
    write_stubs(Path(sys.argv[1]))
