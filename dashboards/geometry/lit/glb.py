"""Lit meshes as one binary glTF file (GLB), drawn without lamps (KHR_materials_unlit).

Source: Khronos, glTF 2.0, sections 3.6 and 4; KHR_materials_unlit. Colours may be brighter than 1, which glTF leaves
open: they are stored as shares of the brightest, which is the material's factor.

Why not trimesh's writer: it stores vertex colours in 8 bits, which leaves bands in dark linear RGB, cuts them off at
1, and writes no unlit material (trimesh 5.2).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from json import dumps
from struct import pack
from typing import Any

import numpy as np

from dashboards.geometry.lit.lit_mesh import LitMesh
from workbench.arrays import AnyArray
from workbench.tolerances import TINY

FLOAT, UINT16, UINT32 = 5126, 5123, 5125
"""glTF's component types."""
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963
"""What a view is for: vertices, or indices."""
FULL = 65535


@dataclass(frozen=True, slots=True, kw_only=True)
class Layer:
    """A mesh and its opacity, 0 to 1."""

    mesh: LitMesh
    opacity: float = 1.0


def glb(layers: Sequence[Layer]) -> bytes:
    """The layers as a file; those without faces are left out."""
    drawn = [layer for layer in layers if len(layer.mesh.faces)]
    views: list[tuple[bytes, int]] = []
    accessors: list[dict[str, Any]] = []

    def add(array: AnyArray, kind: str, component: int, **more: object) -> int:
        accessor = {"bufferView": len(views), "componentType": component, "count": len(array), "type": kind}
        accessors.append(accessor | more)
        views.append((array.tobytes(), ELEMENT_ARRAY_BUFFER if kind == "SCALAR" else ARRAY_BUFFER))
        return len(accessors) - 1

    primitives: list[dict[str, Any]] = []
    materials: list[dict[str, Any]] = []
    for layer in drawn:
        mesh, factor = layer.mesh, max(float(layer.mesh.colours.max(initial=0.0)), TINY)
        shares = np.full((len(mesh.vertices), 4), FULL, dtype=np.uint16)
        shares[:, :3] = np.round(mesh.colours / factor * FULL)
        low, high = mesh.vertices.min(axis=0).tolist(), mesh.vertices.max(axis=0).tolist()
        attributes = {
            "POSITION": add(mesh.vertices, "VEC3", FLOAT, min=low, max=high),
            "COLOR_0": add(shares, "VEC4", UINT16, normalized=True),
        }
        indices = add(mesh.faces.reshape(-1).astype(np.uint32), "SCALAR", UINT32)
        primitives.append({"attributes": attributes, "indices": indices, "material": len(materials)})
        materials.append(_material(factor, layer.opacity))
    return _file(views, {"accessors": accessors, "materials": materials, "meshes": [{"primitives": primitives}]})


def _material(factor: float, opacity: float) -> dict[str, Any]:
    return {
        "pbrMetallicRoughness": {"baseColorFactor": [factor, factor, factor, opacity]},
        "alphaMode": "OPAQUE" if opacity >= 1 else "BLEND",
        "extensions": {"KHR_materials_unlit": {}},
    }


def _file(views: Sequence[tuple[bytes, int]], content: dict[str, Any]) -> bytes:
    """Header, the JSON chunk and the binary chunk, both padded to four bytes."""
    starts = np.cumsum([0, *(len(view) for view, _ in views)]).tolist()
    binary = b"".join(view for view, _ in views)
    head = {
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_materials_unlit"],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "buffers": [{"byteLength": len(binary)}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": start, "byteLength": len(view), "target": target}
            for start, (view, target) in zip(starts[:-1], views, strict=True)
        ],
    }
    words = dumps(head | content).encode()
    words += b" " * (-len(words) % 4)
    binary += b"\0" * (-len(binary) % 4)
    chunks = pack("<I4s", len(words), b"JSON") + words + pack("<I4s", len(binary), b"BIN\0") + binary
    return pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
