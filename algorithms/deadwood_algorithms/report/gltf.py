"""A run's scene as binary glTF 2.0 (.glb): terrain with the hits, solids in true size, moving logs.

glTF is y-up: x is east, y up, z south, metres from the scene's origin, which is in ``asset.extras``. Every chosen
log is a separate node under one animation, so that any viewer plays them.
"""

from __future__ import annotations

import io
import json
import struct
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from deadwood_algorithms.params.tool import VERSION
from deadwood_algorithms.report.space import Space, stumps_of
from deadwood_algorithms.schemas.looks import SOLIDS

SIDES = 10
FLOAT, UINT = 5126, 5125
VERTICES, INDICES = 34962, 34963
Array = NDArray[np.float64]


class Binary:
    """The file's one buffer, and the accessors into it."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []

    def view(self, content: bytes, target: int | None = None) -> int:
        self.data += b"\0" * (-len(self.data) % 4)
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(content)}
        self.data += content
        self.views.append(view | ({"target": target} if target else {}))
        return len(self.views) - 1

    def array(self, values: NDArray, target: int | None = None) -> int:
        """An accessor of float vectors, or of indices; with the bounds that glTF requires for positions and times."""
        whole = values.dtype.kind in "iu"
        held = np.ascontiguousarray(values, "<u4" if whole else "<f4")
        kind = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}[1 if held.ndim == 1 else held.shape[1]]
        ends = [np.atleast_1d(each(axis=0)).tolist() for each in (held.min, held.max)]
        accessor = {"bufferView": self.view(held.tobytes(), target), "componentType": UINT if whole else FLOAT}
        self.accessors.append(accessor | {"count": len(held), "type": kind, "min": ends[0], "max": ends[1]})
        return len(self.accessors) - 1


def write_gltf(path: Path, space: Space, drape: Image.Image) -> None:
    """Write the scene; ``drape`` is a picture that is draped over the terrain."""
    binary = Binary()
    document: dict[str, Any] = {
        "asset": {
            "version": "2.0",
            "generator": f"deadwood-tool {VERSION}",
            "extras": {"origin_m": list(space.origin)},
        },
        "scene": 0,
        "materials": [{"name": "terrain", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, **_DULL}}],
        "meshes": [],
        "nodes": [],
        "textures": [{"source": 0, "sampler": 0}],
        "samplers": [{"magFilter": 9729, "minFilter": 9987, "wrapS": 33071, "wrapT": 33071}],
    }
    picture = io.BytesIO()
    drape.save(picture, "JPEG", quality=85)  # WebP is an extension of glTF
    document["images"] = [{"bufferView": binary.view(picture.getvalue()), "mimeType": "image/jpeg"}]
    places, at, corners = terrain_mesh(space)
    _add(document, binary, "terrain", places, smooth_normals(places, corners), corners, 0, at)
    low = stumps_of(space.trees)
    solids = {
        "trees": space.trees[~low],
        "stumps": space.trees[low],
        "lying_logs": space.lying,
        "blocks": space.blocks,
        "deposits": space.deposits,
    }
    for name, rows in solids.items():
        if len(rows):
            _add(document, binary, name, *cone_mesh(rows), _material(document, name))
    if space.barriers:
        _add(document, binary, "barriers", *plate_mesh(space.barriers), _material(document, "barriers", both=True))
    if space.moving:
        _moving(document, binary, space)
    document["scenes"] = [{"nodes": list(range(len(document["nodes"])))}]
    document |= {"accessors": binary.accessors, "bufferViews": binary.views}
    binary.data += b"\0" * (-len(binary.data) % 4)
    document["buffers"] = [{"byteLength": len(binary.data)}]
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + len(binary.data))
    chunks = (
        struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary.data), b"BIN\0") + binary.data
    )
    path.write_bytes(head + chunks)


def _linear(part: float) -> float:
    """A colour component as in glTF: linear in light, not in sRGB."""
    return part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4


_DULL = {"metallicFactor": 0.0, "roughnessFactor": 1.0}


def _material(document: dict[str, Any], name: str, *, both: bool = False) -> int:
    material = {
        "name": name,
        "pbrMetallicRoughness": {"baseColorFactor": [*(_linear(part) for part in SOLIDS[name]), 1.0], **_DULL},
    }
    document["materials"].append(material | ({"doubleSided": True} if both else {}))
    return len(document["materials"]) - 1


def _add(
    document: dict[str, Any],
    binary: Binary,
    name: str,
    places: Array,
    normals: Array,
    corners: NDArray,
    material: int,
    at: Array | None = None,
) -> int:
    """Add a mesh and a node for it; returns the node's number."""
    facts = {"POSITION": binary.array(y_up(places), VERTICES), "NORMAL": binary.array(y_up(normals), VERTICES)}
    if at is not None:
        facts["TEXCOORD_0"] = binary.array(at, VERTICES)
    indices = binary.array(corners.ravel(), INDICES)
    document["meshes"].append(
        {"name": name, "primitives": [{"attributes": facts, "indices": indices, "material": material}]}
    )
    document["nodes"].append({"name": name, "mesh": len(document["meshes"]) - 1})
    return len(document["nodes"]) - 1


def y_up(points: Array) -> Array:
    """From east, north, up to glTF's axes."""
    return np.column_stack([points[:, 0], points[:, 2], -points[:, 1]])


def terrain_mesh(space: Space) -> tuple[Array, Array, NDArray[np.int64]]:
    """Places, picture coordinates, and triangles where all four corners are known."""
    ny, nx = space.heights.shape
    j, i = np.mgrid[:ny, :nx]
    known = np.isfinite(space.heights)
    x, y = space.first[0] + i * space.cell, space.first[1] + j * space.cell
    places = np.column_stack([x.ravel(), y.ravel(), np.nan_to_num(space.heights).ravel()])
    at = np.column_stack([((i + 0.5) / nx).ravel(), (1.0 - (j + 0.5) / ny).ravel()])
    whole = known[:-1, :-1] & known[:-1, 1:] & known[1:, :-1] & known[1:, 1:]
    k = (j * nx + i)[:-1, :-1][whole]
    corners = np.concatenate([np.column_stack([k, k + 1, k + nx]), np.column_stack([k + 1, k + nx + 1, k + nx])])
    used, renumbered = np.unique(corners, return_inverse=True)
    return places[used], at[used], renumbered.reshape(-1, 3)


def smooth_normals(places: Array, corners: NDArray[np.int64]) -> Array:
    a, b, c = (places[corners[:, k]] for k in range(3))
    face = np.cross(b - a, c - a)
    out = np.zeros_like(places)
    for k in range(3):
        np.add.at(out, corners[:, k], face)
    size = np.linalg.norm(out, axis=1)
    return np.where(size[:, None] > 0.0, out / np.maximum(size, 1e-12)[:, None], [0.0, 0.0, 1.0])


def cone_mesh(rows: Array) -> tuple[Array, Array, NDArray[np.int64]]:
    """Closed truncated cones, from rows of base xyz, tip xyz, base and tip radius: places, normals, triangles."""
    rows = rows[np.linalg.norm(rows[:, 3:6] - rows[:, :3], axis=1) > 1e-6]
    base, tip = rows[:, :3], rows[:, 3:6]
    along = (tip - base) / np.linalg.norm(tip - base, axis=1)[:, None]
    other = np.where(np.abs(along[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]])
    side = np.cross(along, other)
    side /= np.linalg.norm(side, axis=1)[:, None]
    angle = 2.0 * np.pi * np.arange(SIDES) / SIDES
    out = np.cos(angle)[None, :, None] * side[:, None] + np.sin(angle)[None, :, None] * np.cross(along, side)[:, None]
    low, high = (end[:, None] + rows[:, k, None, None] * out for end, k in ((base, 6), (tip, 7)))
    places = np.concatenate([low, high, low, high], axis=1)
    lids = np.repeat(along[:, None], SIDES, axis=1)
    normals = np.concatenate([out, out, -lids, lids], axis=1)
    k, then = np.arange(SIDES), (np.arange(SIDES) + 1) % SIDES
    mantle = np.concatenate([np.column_stack([k, then, SIDES + k]), np.column_stack([then, SIDES + then, SIDES + k])])
    fan = np.column_stack([np.zeros(SIDES - 2, int), np.arange(1, SIDES - 1), np.arange(2, SIDES)])
    one = np.concatenate([mantle, 2 * SIDES + fan[:, ::-1], 3 * SIDES + fan])
    corners = one[None] + 4 * SIDES * np.arange(len(rows))[:, None, None]
    return places.reshape(-1, 3), normals.reshape(-1, 3), corners.reshape(-1, 3)


def plate_mesh(barriers: list[tuple[Array, float]]) -> tuple[Array, Array, NDArray[np.int64]]:
    """Upright plates along lines."""
    places, normals, corners, start = [], [], [], 0
    for feet, height in barriers:
        for a, b in pairwise(feet):
            up = np.array([0.0, 0.0, height])
            across = np.array([b[1] - a[1], a[0] - b[0], 0.0])
            size = np.linalg.norm(across)
            if size < 1e-9:
                continue
            places += [a, b, b + up, a + up]
            normals += [across / size] * 4
            corners += [(start, start + 1, start + 2), (start, start + 2, start + 3)]
            start += 4
    return np.array(places), np.array(normals), np.array(corners)


def _moving(document: dict[str, Any], binary: Binary, space: Space) -> None:
    """The moving logs: one mesh each, upright along glTF's y, and an animation of position and direction."""
    material = _material(document, "moving")
    channels: list[dict[str, Any]] = []
    samplers: list[dict[str, Any]] = []
    for log in space.moving:
        length = float(np.linalg.norm(log.tip[0] - log.base[0]))
        if length < 1e-6:
            continue
        upright = np.array([[0.0, 0.0, 0.0, 0.0, 0.0, length, *log.radii]])
        node = _add(document, binary, f"log {log.log_id}", *cone_mesh(upright), material)
        turn = turned_from_up(y_up(log.tip) - y_up(log.base))
        document["nodes"][node] |= {"translation": y_up(log.base)[0].tolist(), "rotation": turn[0].tolist()}
        if len(log.base) < 2:
            continue
        times = binary.array(space.step_s * np.arange(len(log.base)))
        for path, values in (("translation", y_up(log.base)), ("rotation", turn)):
            channels.append({"sampler": len(samplers), "target": {"node": node, "path": path}})
            samplers.append({"input": times, "output": binary.array(values), "interpolation": "LINEAR"})
    if channels:
        document["animations"] = [{"name": "logs", "channels": channels, "samplers": samplers}]


def turned_from_up(axis: Array) -> Array:
    """Unit quaternions (x, y, z, w) that turn +y into each direction by the shorter rotation; consecutive ones without
    change of sign.
    """
    axis = axis / np.linalg.norm(axis, axis=1)[:, None]
    x, y, z = axis.T
    turn = np.column_stack([z, np.zeros_like(x), -x, 1.0 + y])
    turn[1.0 + y < 1e-9] = [1.0, 0.0, 0.0, 0.0]
    turn /= np.linalg.norm(turn, axis=1)[:, None]
    flip = np.cumprod(np.where((turn[1:] * turn[:-1]).sum(axis=1) < 0.0, -1.0, 1.0))
    turn[1:] *= flip[:, None]
    return turn
