"""Lights that shine alike everywhere, and paints and pictures that come out as they were asked for.

Meshcat maps light to screen colours with the ACES filmic curve, under which a white floor is grey
and reds and blues lose their hue. The curve can be inverted, so a paint is mixed from the colour
that a level surface shall have on the screen.

Source of the curve: three.js, ACESFilmicToneMapping (the fit by S. Hill).
"""

import base64
import json
from math import pi

import cv2
import numpy as np
from pydrake.common import MemoryFile
from pydrake.geometry import InMemoryMesh, Mesh, Meshcat, Rgba

# Light from everywhere, and from a lamp in the north-west that leaves the south sides of obstacles
# and robots, which a camera leaning back sees, darker than their tops. It stands low, so that level
# surfaces do not gleam.
_AMBIENT = 12.0
_LAMP = 20.0
_LAMP_DIRECTION = np.array([-0.54, 0.73, 0.42])
# What a white level surface sends back.
_LEVEL_LIGHT = (_AMBIENT + _LAMP * _LAMP_DIRECTION[2] / np.linalg.norm(_LAMP_DIRECTION)) / pi

_TO_CURVE = np.array(
    [[0.59719, 0.35458, 0.04823], [0.07600, 0.90834, 0.01566], [0.02840, 0.13383, 0.83777]]
)
_FROM_CURVE = np.array(
    [[1.60475, -0.53108, -0.07367], [-0.10208, 1.10813, -0.00605], [-0.00327, -0.07276, 1.07602]]
)
_EXPOSURE = 1 / 0.6


def paint(red: float, green: float, blue: float, opacity: float = 1.0) -> Rgba:
    """Mix the paint that shows as an sRGB colour, each part from 0 to 1, on a level surface.

    The purest hues are beyond the curve: they come out a little paler.

    Args:
        red, green, blue: Parts of the colour, from 0 to 1.
        opacity: From 0 to 1.
    """
    shown = _FROM_CURVE_INVERSE @ _linear(np.array([red, green, blue]))
    # The curve is (v^2 + p v - q) / (r v^2 + s v + t): solve it for v.
    a = 1 - 0.983729 * shown
    b = 0.0245786 - 0.4329510 * shown
    c = -0.000090537 - 0.238081 * shown
    v = (-b + np.sqrt(b * b - 4 * a * c)) / (2 * a)
    light = np.linalg.solve(_TO_CURVE, v) / _EXPOSURE
    albedo = _srgb(np.clip(light / _LEVEL_LIGHT, 0.0, 1.0))
    return Rgba(float(albedo[0]), float(albedo[1]), float(albedo[2]), opacity)


def set_lights(meshcat: Meshcat) -> None:
    """Light every place alike: the usual lamps near the origin leave the rest of a map dark."""
    for lamp in ("SpotLight", "PointLightNegativeX", "PointLightPositiveX"):
        meshcat.SetProperty(f"/Lights/{lamp}", "visible", False)
    meshcat.SetProperty("/Lights/AmbientLight/<object>", "intensity", _AMBIENT)
    meshcat.SetProperty("/Lights/FillLight/<object>", "intensity", _LAMP)
    meshcat.SetProperty("/Lights/FillLight/<object>", "position", (10 * _LAMP_DIRECTION).tolist())


_FROM_CURVE_INVERSE = np.linalg.inv(_FROM_CURVE)


def _linear(srgb: np.ndarray) -> np.ndarray:
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def _srgb(linear: np.ndarray) -> np.ndarray:
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


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
