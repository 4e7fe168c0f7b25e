"""Export of a model and its motion to glTF 2.0 (.glb), for Blender, slides and web pages.

Every body is a node with its shapes below it. Paths and the arrows of contact forces consist of
tubes, each a node of its own. Lengths are in metres, Y is up, and times begin at 0.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from osimlite import __version__
from osimlite.base.files import write_atomically
from osimlite.base.named_tuples import NamedTuple
from osimlite.base.progress import watch_items
from osimlite.io.meshes.unit_shapes import compute_normals, make_cylinder
from osimlite.mechanics.multibody.spatial import Array, quaternion_of
from osimlite.view.drawn_forces import LONGEST_ARROW, DrawnForces
from osimlite.view.motion import DrawableMotion, get_values, interpolate_columns
from osimlite.view.picture import FORCE
from osimlite.view.scene import Bodies, Color, Scene

MAX_FRAME_RATE_HZ = 60.0
"""Largest number of poses per second; players interpolate linearly between them."""

_FLOAT, _UINT32 = 5126, 5125
_VERTICES, _CORNERS = 34962, 34963
_KINDS = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}
_ROUND = make_cylinder(8)


def write_glb(scene: Scene, q: Array, motion: DrawableMotion | None, path: str | Path) -> Path:
    """Write the visible parts of a model, and their motion, as a .glb file.

    Args:
        scene: scene of the model.
        q: coordinate values (n,), the pose of a model without motion; not used with a motion.
        motion: motion of the model; None for a still scene.
        path: file to write.

    Returns:
        Path of the file.
    """
    times = np.zeros(1)
    rows = q[None, :]
    if motion is not None:
        recorded = np.asarray(motion.times, dtype=float)
        # More poses than a player shows would only make the file larger.
        max_moments = round((recorded[-1] - recorded[0]) * MAX_FRAME_RATE_HZ) + 1
        times = (
            recorded
            if len(recorded) <= max_moments
            else np.linspace(recorded[0], recorded[-1], max_moments)
        )
        values = get_values(motion, scene.mechanism)
        rows = interpolate_columns(motion, values, times)
    poses = scene.compute_all_poses(rows)
    # glTF has Y up; the root turns the vertical of the model to it.
    writer = _GlbWriter(
        times - times[0], _turn_vectors(np.cross(scene.up, (0.0, 1.0, 0.0)), scene.up[1])
    )
    names = [*(body.name for body in scene.mechanism.bodies), "ground"]
    bodies = [
        writer.add_node(
            name,
            _Track(
                [p.origins[k] for p in poses],
                # The quaternions of osimlite begin with w, those of glTF end with it.
                _make_continuous(
                    np.roll(quaternion_of([p.rotations[k] for p in poses]), -1, axis=1)
                ),
            ),
        )
        for k, name in enumerate(names)
    ]
    for drawn_item in scene.iterate_visible_items():
        if drawn_item.layer != "frames":
            surface = scene.surfaces[drawn_item.surface]
            mesh = writer.add_mesh(surface, drawn_item.color, drawn_item.opacity)
            writer.add_shape(bodies[drawn_item.body], drawn_item.path, mesh, drawn_item.matrix)
    segments = [*_list_segments(scene, motion, times, rows, poses)]
    for name, color, radius, end_points in watch_items("laying tubes", segments, " tubes"):
        writer.add_node(name, _lay_tubes(end_points, radius), writer.add_mesh(_ROUND, color, 1.0))
    write_atomically(path, writer.to_bytes(scene.mechanism.name))
    return Path(path)


class _Track(NamedTuple):
    """Motion of a node: translations (n, 3), rotations x y z w (n, 4), scales (n, 3) or None."""

    translation: Any
    rotation: Array
    scale: Array | None = None


def _list_segments(
    scene: Scene, motion: DrawableMotion | None, times: Array, rows: Array, poses: Sequence[Bodies]
) -> Iterator[tuple[str, Color, float, Array]]:
    """Yield component path, colour, radius and ends (n, 2, 3) in ground of segments and forces.

    The last segments of a path that has fewer corners in a pose have no length there.
    """
    for index, line in enumerate(scene.lines):
        if line.visible and line.layer in scene.visible_layers:
            corners_by_pose = [pose.lines[index] for pose in poses]
            corner_count = max(map(len, corners_by_pose))
            padded_corners = [
                # The last corner is repeated in poses with fewer corners.
                result[np.minimum(np.arange(corner_count), len(result) - 1)]
                for result in corners_by_pose
                if len(result)
            ]
            # A path without corners in some pose is left out.
            if len(padded_corners) == len(poses):
                for k in range(corner_count - 1):
                    yield line.path, line.color, line.radius, np.array(padded_corners)[:, k : k + 2]
    drawn_forces = (
        DrawnForces(()) if motion is None else DrawnForces.from_motion(scene, motion, times)
    )
    lowest, highest = scene.compute_box(rows[0])
    size = float(np.linalg.norm(highest - lowest))
    for drawn_force in drawn_forces.forces:
        starts = np.array(
            [drawn_force.locate_point(number, bodies) for number, bodies in enumerate(poses)]
        )
        arrows = drawn_force.forces * (LONGEST_ARROW * size / max(drawn_forces.largest, 1e-300))
        yield (
            drawn_force.anchor.path,
            FORCE,
            0.006 * size,
            np.stack((starts, starts + arrows), axis=1),
        )


def _lay_tubes(end_points: Array, radius: float) -> _Track:
    """Return the n poses of a tube of length 1 along Z that connects two end points (n, 2, 3)."""
    directions = end_points[:, 1] - end_points[:, 0]
    lengths = np.linalg.norm(directions, axis=1)
    directions = directions / np.maximum(lengths, 1e-300)[:, None]
    axes = np.column_stack((-directions[:, 1], directions[:, 0], np.zeros(len(directions))))
    rotations = _turn_vectors(axes, directions[:, 2])
    # A segment without length has no thickness either.
    radii = np.where(lengths > 0.0, radius, 0.0)
    return _Track(
        end_points.mean(axis=1),
        _make_continuous(rotations),
        np.column_stack((radii, radii, lengths)),
    )


def _turn_vectors(axes: Array, cosines: Array) -> Array:
    """Return the quaternions x y z w that turn unit vectors a into unit vectors b.

    Args:
        axes: cross products a × b (..., 3).
        cosines: scalar products a · b (...).

    Returns:
        Unit quaternions (..., 4); for opposite vectors, half a turn about X.
    """
    # The sum of axis and 1 + cosine is the quaternion of half the angle, up to its length.
    result = np.concatenate((axes, np.asarray(1.0 + cosines)[..., None]), axis=-1)
    sizes = np.linalg.norm(result, axis=-1, keepdims=True)
    is_opposite = sizes <= 1e-9
    return np.where(is_opposite, (1.0, 0.0, 0.0, 0.0), result / np.where(is_opposite, 1.0, sizes))


def _make_continuous(quaternions: Array) -> Array:
    """Return the same rotations with signs that make neighbouring quaternions close.

    q and -q are the same rotation, but a player that interpolates components would make a detour.
    """
    is_opposite = np.sum(quaternions[1:] * quaternions[:-1], axis=1) < 0.0
    # A change of sign also inverts all later quaternions: an odd number of changes is negative.
    signs = np.where(np.cumsum(np.concatenate(((False,), is_opposite))) % 2 == 1, -1.0, 1.0)
    result: Array = quaternions * signs[:, None]
    return result


class _GlbWriter:
    """Writer of a .glb file: its JSON and its one buffer."""

    def __init__(self, times: Array, upright: Array) -> None:
        self.buffer = bytearray()
        self.views: list[dict[str, int]] = []
        self.accessors: list[dict[str, Any]] = []
        self.nodes: list[dict[str, Any]] = [{"rotation": upright.tolist(), "children": []}]
        self.meshes: list[dict[str, Any]] = []
        self.materials: list[dict[str, Any]] = []
        self.channels: list[dict[str, Any]] = []
        self.samplers: list[dict[str, Any]] = []
        self._indices: dict[Any, int] = {}
        self._is_animated = len(times) > 1
        self._times = self._add_accessor(times[:, None], bounds=True) if self._is_animated else 0

    def _add_accessor(
        self,
        array: Array,
        component_type: int = _FLOAT,
        *,
        bounds: bool = False,
        target: int | None = None,
    ) -> int:
        data = np.ascontiguousarray(array, dtype="<f4" if component_type == _FLOAT else "<u4")
        view = {"buffer": 0, "byteOffset": len(self.buffer), "byteLength": data.nbytes}
        self.views.append(view if target is None else view | {"target": target})
        self.buffer += data.tobytes()
        entry = {
            "bufferView": len(self.views) - 1,
            "componentType": component_type,
            "count": len(data),
            "type": _KINDS[data.shape[1]],
        }
        if bounds:
            # glTF requires bounds of positions and times.
            entry |= {"min": data.min(axis=0).tolist(), "max": data.max(axis=0).tolist()}
        self.accessors.append(entry)
        return len(self.accessors) - 1

    def _add_unique(self, key: Any, entries: list[dict[str, Any]], entry: dict[str, Any]) -> int:
        """Return the index of an entry, and append the entry if its key is new."""
        if key not in self._indices:
            self._indices[key] = len(entries)
            entries.append(entry)
        return self._indices[key]

    def add_mesh(self, surface: Any, color: Color, opacity: float) -> int:
        """Return the index of a mesh with the shape of a surface and a colour (sRGB, 0 to 1)."""
        key = (id(surface), color, opacity)
        if key in self._indices:
            return self._indices[key]
        # glTF has linear colours.
        light = [
            channel / 12.92 if channel <= 0.04045 else ((channel + 0.055) / 1.055) ** 2.4
            for channel in color
        ]
        material = {
            "pbrMetallicRoughness": {
                "baseColorFactor": [*light, opacity],
                "metallicFactor": 0.0,
                "roughnessFactor": 0.7,
            },
            "alphaMode": "OPAQUE" if opacity >= 1.0 else "BLEND",
            "doubleSided": True,
        }
        # Geometry is stored once, whatever the number of its colours.
        geometry = ("geometry", id(surface))
        if geometry not in self._indices:
            self._indices[geometry] = self._add_accessor(
                surface.points, bounds=True, target=_VERTICES
            )
            self._add_accessor(compute_normals(surface), target=_VERTICES)
            self._add_accessor(surface.triangles.reshape(-1, 1), _UINT32, target=_CORNERS)
        first = self._indices[geometry]
        primitive = {
            "attributes": {"POSITION": first, "NORMAL": first + 1},
            "indices": first + 2,
            "material": self._add_unique((color, opacity), self.materials, material),
        }
        return self._add_unique(key, self.meshes, {"primitives": [primitive]})

    def add_node(self, name: str, track: _Track, mesh: int | None = None) -> int:
        """Add a node in ground, animated unless its track is constant.

        Returns:
            Index of the node.
        """
        index = len(self.nodes)
        node: dict[str, Any] = {"name": name} | ({} if mesh is None else {"mesh": mesh})
        for property_name, values in track._asdict().items():
            if values is None:
                continue
            array = np.asarray(values)
            node[property_name] = array[0].tolist()
            # A node that never moves needs no channel.
            if self._is_animated and np.ptp(array, axis=0).max() > 0.0:
                self.samplers.append({"input": self._times, "output": self._add_accessor(array)})
                target = {"node": index, "path": property_name}
                self.channels.append({"sampler": len(self.samplers) - 1, "target": target})
        self.nodes.append(node)
        self.nodes[0]["children"].append(index)
        return index

    def add_shape(self, parent: int, name: str, mesh: int, matrix: Array) -> None:
        """Add a node that is fixed to the node `parent`, with the matrix (4, 4) in its frame."""
        self.nodes[parent].setdefault("children", []).append(len(self.nodes))
        # Matrices are stored by columns.
        self.nodes.append({"name": name, "mesh": mesh, "matrix": matrix.T.ravel().tolist()})

    def to_bytes(self, name: str) -> bytes:
        """Return the bytes of the complete GLB file."""
        self.nodes[0]["name"] = name
        sections = {
            "asset": {"version": "2.0", "generator": f"osimlite {__version__}"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": self.nodes,
            "meshes": self.meshes,
            "materials": self.materials,
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{"byteLength": len(self.buffer)}] if self.buffer else [],
            "animations": [{"channels": self.channels, "samplers": self.samplers}]
            if self.channels
            else [],
        }
        # glTF allows no empty lists.
        text = json.dumps(
            {key: section for key, section in sections.items() if section != []},
            separators=(",", ":"),
        ).encode()
        # Chunks have lengths that are multiples of four: text is filled with blanks, data with
        # zeros.
        text += b" " * (-len(text) % 4)
        body = bytes(self.buffer) + bytes(-len(self.buffer) % 4)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text
        if body:
            chunks += struct.pack("<I4s", len(body), b"BIN\0") + body
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
