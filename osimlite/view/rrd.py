"""Export of a model and its motion as a recording for Rerun (.rrd), with bodies, forces and curves.

Bodies are entities below ``model``, named by their component paths, with their shapes below them.
Lines and forces are in ground. The timeline is ``time``, s. Curves are below ``coordinates`` (rad
or m), ``activations`` and ``forces`` (N).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from osimlite.base.files import write_atomically
from osimlite.base.require import require
from osimlite.mechanics.multibody.spatial import Array
from osimlite.view.drawn_forces import LONGEST_ARROW, DrawnForces
from osimlite.view.motion import DrawableMotion, activity_color, get_values, read_activations
from osimlite.view.picture import FORCE
from osimlite.view.scene import Color, Scene


def write_rrd(scene: Scene, q: Array, motion: DrawableMotion | None, path: str | Path) -> Path:
    """Write the visible parts of a model, and their motion, as a .rrd file.

    Args:
        scene: scene of the model.
        q: coordinate values (n,), the pose of a model without motion; not used with a motion.
        motion: motion of the model; None for a still scene.
        path: file to write.

    Returns:
        Path of the file.

    Raises:
        MissingDependency: rerun-sdk is not installed.
        OsimliteError: the file cannot be written.
    """
    # Rerun's types are too many to declare, hence Any.
    rr: Any = require("rerun", extra="rerun", purpose="a recording for Rerun")
    times = np.zeros(1)
    rows = q[None, :]
    if motion is not None:
        times = np.asarray(motion.times, dtype=float)
        rows = get_values(motion, scene.mechanism)
    poses = scene.compute_all_poses(rows)
    recording = rr.RecordingStream(scene.mechanism.name or "osimlite")
    stream = recording.binary_stream()

    def make_entity(*path_parts: str) -> str:
        # Component paths begin with a slash, which would give an empty part.
        return str(
            rr.new_entity_path(
                [
                    name_part
                    for path_part in path_parts
                    for name_part in path_part.split("/")
                    if name_part
                ]
            )
        )

    def log_static(name: str, *values: Any) -> None:
        recording.log(name, *values, static=True)

    def log_columns(name: str, columns: Any) -> None:
        recording.send_columns(name, [rr.TimeColumn("time", duration=times)], columns)

    def log_scalars(name: str, scalars: Array) -> None:
        log_columns(name, rr.Scalars.columns(scalars=scalars))

    axis = int(np.argmax(np.abs(scene.up)))
    # Rerun knows only axes of the coordinate system as vertical.
    upright = f"RIGHT_HAND_{'XYZ'[axis]}_{'UP' if scene.up[axis] > 0.0 else 'DOWN'}"
    log_static("model", getattr(rr.ViewCoordinates, upright))
    bodies = [
        make_entity("model", path)
        for path in (*(body.path for body in scene.mechanism.bodies), "ground")
    ]
    for k, name in enumerate(bodies):
        rotations = [pose.rotations[k] for pose in poses]
        origins = [pose.origins[k] for pose in poses]
        log_columns(name, rr.Transform3D.columns(translation=origins, mat3x3=rotations))
    for drawn_item in scene.iterate_visible_items():
        surface = scene.surfaces[drawn_item.surface]
        points = surface.points
        corners = surface.triangles
        color = _make_colour(drawn_item.color, drawn_item.opacity)
        shape = rr.Mesh3D(vertex_positions=points, triangle_indices=corners, albedo_factor=color)
        transform = rr.Transform3D(
            translation=drawn_item.matrix[:3, 3], mat3x3=drawn_item.matrix[:3, :3]
        )
        log_static(bodies[drawn_item.body] + make_entity(drawn_item.path), transform, shape)

    levels = {} if motion is None else read_activations(scene, motion)
    for index, line in enumerate(scene.lines):
        if line.visible and line.layer in scene.visible_layers:
            name = make_entity("model", line.layer, line.path)
            strips = [pose.lines[index] for pose in poses]
            log_static(name, rr.LineStrips3D.from_fields(radii=line.radius))
            level = levels.get(line.path)
            colors = [line.color] * len(poses) if level is None else map(activity_color, level)
            log_columns(
                name, rr.LineStrips3D.columns(strips=strips, colors=list(map(_make_colour, colors)))
            )
    if motion is not None:
        for path_of, level in levels.items():
            log_scalars(make_entity("activations", path_of), level)
        for coordinate, column in zip(scene.mechanism.coordinates, rows.T, strict=True):
            log_scalars(make_entity("coordinates", coordinate.name), column)
        drawn_forces = DrawnForces.from_motion(scene, motion, times)
        lowest, highest = scene.compute_box(rows[0])
        size = float(np.linalg.norm(highest - lowest))
        # 1e-300 prevents a division by zero.
        scale = LONGEST_ARROW * size / max(drawn_forces.largest, 1e-300)
        for drawn_force in drawn_forces.forces:
            name = make_entity("forces", drawn_force.anchor.path, drawn_force.anchor.labels[0])
            starts = [drawn_force.locate_point(number, pose) for number, pose in enumerate(poses)]
            log_static(
                f"/model{name}",
                rr.Arrows3D.from_fields(radii=0.006 * size, colors=_make_colour(FORCE)),
            )
            log_columns(
                f"/model{name}",
                rr.Arrows3D.columns(vectors=scale * drawn_force.forces, origins=starts),
            )
            log_scalars(name, np.linalg.norm(drawn_force.forces, axis=1))
    layout = require("rerun.blueprint", extra="rerun", purpose="a recording for Rerun")
    curves = [
        layout.TimeSeriesView(origin=entity, name=entity)
        for entity in ("coordinates", "activations", "forces")
    ]
    space = layout.Spatial3DView(origin="model", name=scene.mechanism.name)
    recording.send_blueprint(
        layout.Horizontal(space, layout.Vertical(*curves), column_shares=[2, 1])
    )
    write_atomically(path, stream.read())
    return Path(path)


def _make_colour(color: Color, opacity: float = 1.0) -> list[int]:
    return [round(255.0 * channel) for channel in (*color, opacity)]
