"""A picture in Meshcat: a rectangle that shows an image, in its own colours and without light."""

import base64
import json

import cv2
import numpy as np
from pydrake.common import MemoryFile
from pydrake.geometry import InMemoryMesh, Mesh

_JPEG_QUALITY = 85
# Component types and the size of glTF's data.
_FLOAT, _UNSIGNED_SHORT = 5126, 5123


def picture_square(picture: np.ndarray, side: float, *, pixels: int) -> Mesh:
    """A rectangle in the plane z = 0 about the origin that shows a picture, its top towards +y.

    Args:
        picture: Red, green, blue, shape (rows, columns, 3), uint8; often a square.
        side: Width of the rectangle, whose height has the picture's proportion [m].
        pixels: Width of the image that is kept: a recording holds one for each time.
    """
    proportion = picture.shape[0] / picture.shape[1]
    size = (pixels, max(round(pixels * proportion), 1))
    small = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
    bgr = cv2.cvtColor(small, cv2.COLOR_RGB2BGR)
    _, jpeg = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])
    scene = _gltf(jpeg.tobytes(), 0.5 * side, 0.5 * side * proportion)
    return Mesh(InMemoryMesh(mesh_file=MemoryFile(json.dumps(scene), ".gltf", "picture")))


def _gltf(jpeg: bytes, width: float, height: float) -> dict[str, object]:
    """A rectangle of half sizes as a glTF scene, whose y axis is up: Meshcat turns it to z up."""
    corners = np.array([[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]]) * [width, 0, height]
    corners = corners.astype(np.float32)
    texture = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], dtype=np.float32)
    faces = np.array([0, 1, 2, 0, 2, 3], dtype=np.uint16)
    parts = [corners.tobytes(), texture.tobytes(), faces.tobytes()]
    starts = np.cumsum([0, *(len(part) for part in parts)]).tolist()
    bounds = {"min": corners.min(axis=0).tolist(), "max": corners.max(axis=0).tolist()}
    material = {
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}},
        "extensions": {"KHR_materials_unlit": {}},
        "doubleSided": True,
    }
    return {
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_materials_unlit"],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [
            {
                "primitives": [
                    {
                        "attributes": {"POSITION": 0, "TEXCOORD_0": 1},
                        "indices": 2,
                        "material": 0,
                    }
                ]
            }
        ],
        "materials": [material],
        "textures": [{"source": 0}],
        "images": [{"uri": _data("image/jpeg", jpeg)}],
        "buffers": [
            {"byteLength": starts[-1], "uri": _data("application/octet-stream", b"".join(parts))}
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": start, "byteLength": len(part)}
            for start, part in zip(starts, parts, strict=False)
        ],
        "accessors": [
            {"bufferView": 0, "componentType": _FLOAT, "count": 4, "type": "VEC3", **bounds},
            {"bufferView": 1, "componentType": _FLOAT, "count": 4, "type": "VEC2"},
            {"bufferView": 2, "componentType": _UNSIGNED_SHORT, "count": 6, "type": "SCALAR"},
        ],
    }


def _data(kind: str, content: bytes) -> str:
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"
