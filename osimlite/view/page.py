"""Self-contained HTML page that shows a scene: its data, and its text with all scripts."""

from __future__ import annotations

import html
import json
import math
import re
from collections.abc import Mapping, Sequence
from importlib.resources import files
from itertools import count
from typing import Any

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.text import format_count
from osimlite.io.meshes.surface import Surface
from osimlite.io.meshes.unit_shapes import compute_normals
from osimlite.lint.diagnostic import Finding
from osimlite.mechanics.multibody.constraints import Coupler, Lock, PrescribedCoordinate
from osimlite.mechanics.multibody.extremes import any_numbers
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.model import Model
from osimlite.translate.sidecar import replace_non_finite
from osimlite.view.drawn_forces import DrawnForces
from osimlite.view.incomplete import describe_left_out
from osimlite.view.inspect import component_tree, finding_rows, place_pins
from osimlite.view.kernels import kernels_text, program_data, text_of
from osimlite.view.motion import DrawableMotion, find_moving_bodies, get_values, read_activations
from osimlite.view.recording import MeasuredMarkers
from osimlite.view.scene import LAYERS, MIN_FLOOR_COSINE, Scene

SCRIPTS = ("mechanism.js", "tubes.js", "stage.js", "panels.js", "curves.js", "viewer.js")
"""Scripts of the page, in the order in which it runs them."""

MIN_TRAVEL = 0.5
"""Travel of the model, relative to its size, beyond which the camera follows it at first."""

BOX_POSES = 25
"""Number of poses along a motion that determine its bounding box."""


class Story(NamedTuple):
    """Description of a motion and links to other pages; a page with a story plays its motion when it is opened."""

    words: str  # description of the motion
    command: str  # command for a terminal that continues from here
    page: str  # name of the file of this page
    # title and file name of each linked page, in the same folder
    pages: Sequence[tuple[str, str]]


def page_text(data: Mapping[str, Any]) -> str:
    """Return the HTML page that shows the data from :func:`page_data`."""
    web = files("osimlite.view").joinpath("web")

    def read(name: str) -> str:
        return web.joinpath(name).read_text(encoding="utf-8")

    # No "</script" may end the data early, so "<" is written by its number in JSON.
    data_text = json.dumps(
        data, ensure_ascii=False, separators=(",", ":"), allow_nan=False
    ).replace("<", "\\u003c")
    replacements = {
        "@TITLE@": html.escape(str(data["name"]) or "osimlite"),
        "@STYLE@": read("page.css"),
        "@LIBRARY@": read("three.js"),
        "@SCRIPT@": "".join((kernels_text(data["program"]), *map(read, SCRIPTS))),
        "@DATA@": data_text,
    }
    # All placeholders are replaced at once, since a model may be called "@DATA@".
    return re.sub("|".join(replacements), lambda match: replacements[match[0]], read("page.html"))


@any_numbers
def page_data(
    model: Model,
    scene: Scene,
    motion: DrawableMotion | None,
    findings: Sequence[Finding],
    q: Array,
    *,
    server: bool = False,
    story: Story | None = None,
) -> dict[str, Any]:
    """Collect the data of the page.

    Args:
        model: model to show.
        scene: scene of `model`.
        motion: motion to play; None for a still model.
        findings: findings of the validator on the model.
        q: coordinate values (n,) of the first pose; a motion starts at its own first row instead.
        server: whether a server answers the page, so that the page may request poses that fulfil
            the constraints.
        story: text about the motion; None for none.

    Returns:
        Plain data for JSON, without NaN and infinite numbers.
    """
    mechanism = scene.mechanism
    motion_data = None if motion is None else _describe_motion(scene, motion)
    # With a motion the page starts at its first row.
    start = q if motion is None else get_values(motion, mechanism)[0]
    lowest, highest = np.array(scene.compute_box(q) if motion_data is None else motion_data["box"])
    tree, tags = component_tree(model)
    hints = model.model_visual_preferences.model_display_hints
    # Couplers are solved in the page; the other constraints are listed by name.
    couplers = [
        constraint for constraint in mechanism.constraints if isinstance(constraint, Coupler)
    ]
    other_constraints = [
        constraint.name
        for constraint in mechanism.constraints
        if not isinstance(constraint, Coupler | Lock | PrescribedCoordinate)
    ]
    data: dict[str, Any] = replace_non_finite(
        {
            "name": model.name,
            "facts": f"{format_count(len(mechanism.bodies), 'body')}, "
            f"{format_count(len(mechanism.coordinates), 'coordinate')}, "
            f"{format_count(len(tree), 'component')}",
            "server": server,
            "story": None if story is None else story._asdict(),
            "layers": LAYERS,
            "shown": sorted(scene.visible_layers),
            "labelled": hints.show_labels,
            "up": scene.up.tolist(),
            "gravity": mechanism.gravity.tolist(),
            "floor": _describe_floor(scene, start),
            "center": (0.5 * (lowest + highest)).tolist(),
            "size": float(np.linalg.norm(highest - lowest)),
            "directions": _list_directions(scene.up),
            "coordinates": _describe_coordinates(
                mechanism, {constraint.dependent for constraint in couplers}, q, motion_data
            ),
            "q": q.tolist(),
            "bodies": [
                {
                    "path": body.path,
                    "name": body.name,
                    "center": body.mass_properties.center.tolist(),
                }
                for body in mechanism.bodies
            ],
            "program": program_data(scene.polylines, mechanism.constraints),
            "constraints": other_constraints,
            **_describe_items(scene),
            "motion": motion_data,
            "tree": tree,
            "tags": tags,
            "findings": finding_rows(findings),
            "pins": place_pins(model, scene, findings),
            "remarks": [list(remark) for remark in scene.remarks],
            # Missing meshes are among the findings, and need no note.
            "notes": [*describe_left_out(scene.remarks, with_meshes=False)],
        }
    )
    return data


def _describe_items(scene: Scene) -> dict[str, Any]:
    routes = count()
    return {
        "surfaces": [_encode_surface(surface) for surface in scene.surfaces],
        "items": [
            {
                **vars(drawn_item),
                "matrix": _flatten_rows(drawn_item.matrix),
                "scenery": index in scene.large,
            }
            for index, drawn_item in enumerate(scene.items)
        ],
        "lines": [
            {
                **{
                    name: value
                    for name, value in vars(line).items()
                    if name not in ("route", "wraps")
                },
                **(
                    {
                        "points": [
                            {"body": point.body, "at": point.location.tolist()}
                            for point in line.route
                        ]
                    }
                    if isinstance(line.route, tuple)
                    else {"route": next(routes), "most": line.route.corners, "wraps": line.wraps}
                ),
            }
            for line in scene.lines
        ],
        "axes": [{**vars(axes), "matrix": _flatten_rows(axes.matrix)} for axes in scene.axes],
    }


def _encode_surface(surface: Surface) -> dict[str, str]:
    """Return points, normals and triangles of a surface as base64 texts for the page."""
    # Normals in one byte per component: their error is below half a degree.
    normals = np.rint(127.0 * np.clip(compute_normals(surface), -1.0, 1.0)).astype(np.int8)
    return {
        "points": text_of(surface.points.astype("<f4")),
        "normals": text_of(normals),
        "triangles": text_of(surface.triangles.astype("<u4")),
    }


def _describe_coordinates(
    mechanism: Mechanism, dependent: set[int], q: Array, motion_data: Mapping[str, Any] | None
) -> list[dict[str, Any]]:
    rows = []
    for index, coordinate in enumerate(mechanism.coordinates):
        lowest, highest = coordinate.range
        # A slider needs finite ends.
        if not (math.isfinite(lowest) and math.isfinite(highest) and lowest < highest):
            lowest, highest = -10.0, 10.0
        # Motions may leave the range of a coordinate.
        extreme_values = [float(q[index])] if motion_data is None else motion_data["ends"][index]
        fixed_reason = (
            "locked"
            if coordinate.locked
            else "follows other coordinates by a coupler"
            if index in dependent
            else "prescribed over time"
            if coordinate.prescribed is not None
            else ""
        )
        rows.append(
            {
                "name": coordinate.name,
                "path": coordinate.path,
                "unit": coordinate.unit,
                "range": [min(lowest, *extreme_values), max(highest, *extreme_values)],
                "still": fixed_reason,
            }
        )
    return rows


def _describe_motion(scene: Scene, motion: DrawableMotion) -> dict[str, Any]:
    mechanism = scene.mechanism
    times = np.asarray(motion.times, dtype=float)
    values = get_values(motion, mechanism)
    drawn_forces = DrawnForces.from_motion(scene, motion, times).forces
    forces = []
    for drawn_force in drawn_forces:
        torques = (
            np.zeros_like(drawn_force.forces)
            if drawn_force.torques is None
            else drawn_force.torques
        )
        forces.append(
            {
                "path": drawn_force.anchor.path,
                "surface": drawn_force.anchor.surface,
                "body": drawn_force.anchor.body,
                "near": drawn_force.anchor.near.tolist(),
                "values": text_of(np.hstack((drawn_force.forces, torques)).astype("<f4")),
            }
        )
    return {
        "times": text_of(times.astype("<f8")),
        "values": text_of(values.astype("<f8")),
        "ends": np.column_stack((values.min(axis=0), values.max(axis=0))).tolist(),
        **_choose_view(scene, values),
        "measured": _describe_measured_markers(getattr(motion, "measured", None)),
        "forces": forces,
        "activations": {
            path: text_of(np.rint(255.0 * level).astype(np.uint8))
            for path, level in read_activations(scene, motion).items()
        },
    }


def _describe_measured_markers(markers: MeasuredMarkers | None) -> dict[str, Any] | None:
    """Return the measured positions of markers and the body and point of each; None without markers."""
    if markers is None:
        return None
    named_stations = zip(markers.names, markers.stations, strict=True)
    return {
        "markers": [
            {"name": name, "body": body, "at": point.tolist()}
            for name, (body, point) in named_stations
        ],
        "places": text_of(markers.positions.astype("<f4")),
    }


def _choose_view(scene: Scene, values: Array) -> dict[str, Any]:
    """Return the moving bodies, their mean position, their travel, and their bounding box.

    If the model travels, the box is relative to the moving bodies, because the camera follows them.
    """
    # A few moments suffice to find the extent.
    rows = values[np.unique(np.linspace(0, len(values) - 1, BOX_POSES).astype(int))]
    poses = [scene.compute_poses(row) for row in rows]
    is_moving = find_moving_bodies(poses)[:-1]
    centers = np.array([pose.origins[:-1][is_moving].mean(axis=0) for pose in poses])
    boxes = np.array([scene.compute_box_of(pose) for pose in poses])
    is_travelling = np.linalg.norm(centers[-1] - centers[0]) > MIN_TRAVEL * np.linalg.norm(
        boxes[0, 1] - boxes[0, 0]
    )
    # A following camera moves with the bodies, so their travel must not widen the view.
    if is_travelling:
        boxes -= (centers - centers[0])[:, None]
    return {
        "moves": np.flatnonzero(is_moving).tolist(),
        "middle": centers[0].tolist(),
        "travels": bool(is_travelling),
        "way": float(np.linalg.norm(centers[-1] - centers[0])),
        "box": [boxes[:, 0].min(axis=0).tolist(), boxes[:, 1].max(axis=0).tolist()],
    }


def _choose_directions(up: Array) -> tuple[Array, Array]:
    """Return unit vectors (3,) to the front and right of the model, perpendicular to `up`."""
    # OpenSim's models have Y up, face +X and have Z on their right.
    if abs(up[1]) > 0.9:
        return np.array((1.0, 0.0, 0.0)), np.array((0.0, 0.0, 1.0))
    front = np.cross(up, np.eye(3)[int(np.argmin(np.abs(up)))])
    front /= np.linalg.norm(front)
    return front, np.cross(front, up)


def _describe_floor(scene: Scene, q: Array) -> dict[str, Any]:
    """Return body and frame of the grid (its X-Z plane): a contact half space or a level floor."""
    bodies = scene.compute_poses(q)
    for drawn_item in scene.iterate_visible_items():
        outward = -bodies.transform_frame(drawn_item.body, drawn_item.matrix)[:3, 0]
        size = float(np.linalg.norm(outward))
        # A steep half space is a wall.
        if drawn_item.path in scene.half_spaces and outward @ scene.up > MIN_FLOOR_COSINE * size:
            matrix = drawn_item.matrix.copy()
            # The plane's X axis points into the half space; the grid has Y upwards.
            matrix[:3, :3] = np.column_stack((matrix[:3, 1], -matrix[:3, 0], matrix[:3, 2])) / size
            return {"body": drawn_item.body, "matrix": _flatten_rows(matrix)}
    front, side = _choose_directions(scene.up)
    matrix = np.eye(4)
    matrix[:3] = np.column_stack((front, scene.up, side, scene.find_floor_height(q) * scene.up))
    return {"body": -1, "matrix": _flatten_rows(matrix)}


def _list_directions(up: Array) -> dict[str, list[float]]:
    """Return the named view directions, from the model towards the viewer, in ground."""
    front, side = _choose_directions(up)
    home = front + 0.35 * up + 1.3 * side
    # Straight from above, `up` would have no direction in the picture.
    return {
        name: vector.tolist()
        for name, vector in (
            ("home", home),
            ("front", front),
            ("side", side),
            ("top", up + 1e-3 * front),
        )
    }


def _flatten_rows(matrix: Array) -> list[float]:
    """Return the upper three rows of a matrix (4, 4), one after the other."""
    rows: list[float] = matrix[:3].ravel().tolist()
    return rows
