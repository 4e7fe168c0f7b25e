"""Models for biorbd (.bioMod): segments with one degree of freedom each, markers and muscles.

biorbd has no joints that follow a function of a coordinate, and no constraints. So each motion of a
joint along or about one axis becomes a degree of freedom, and ``<name>.coordinates.json`` says how
the coordinates of the model give their values.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from osimlite.base.records import dataclass
from osimlite.io.tables.storage import format_number
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.schema_frames import Placements
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.forces import Force
from osimlite.schema.frames import PhysicalFrame
from osimlite.schema.markers import Marker
from osimlite.schema.model import Model
from osimlite.schema.muscles import Muscle
from osimlite.schema.paths import ConditionalPathPoint, GeometryPath, PathPoint
from osimlite.schema.sets import Constraint
from osimlite.simulation.paths import Paths
from osimlite.simulation.robot.build import build_robot
from osimlite.simulation.robot.names import UniqueNames, legal, legal_names
from osimlite.simulation.robot.robot import Robot, RobotJoint
from osimlite.translate.biomod_survey import has_limits, record_biomod_losses
from osimlite.translate.fidelity import LEFT_OUT, Error, Fidelity
from osimlite.translate.files import write_files
from osimlite.translate.mjcf.poses import draw_poses, measure_arm_errors
from osimlite.translate.mjcf.tendons import TendonSite, measure_tendon
from osimlite.translate.sidecar import format_coordinates

AXES = {(1.0, 0.0, 0.0): "x", (0.0, 1.0, 0.0): "y", (0.0, 0.0, 1.0): "z"}
"""Words for the axes of a segment."""

ERROR_POSES = 100
"""Random poses in which the errors of paths are measured."""

ACTIVATION_CONSTANTS = {"activation_time_constant": 0.01, "deactivation_time_constant": 0.04}
"""Time constants (s) of all muscles in biorbd, which no attribute changes.

Its equation of first order is that of OpenSim if the muscle has no `statetype`.
"""

MUSCLE_TYPE = "hillthelen"
"""Class of biorbd's muscles that is nearest to those of OpenSim."""


@dataclass(frozen=True)
class BioMod:
    """Model in the format of biorbd.

    Attributes:
        name: name of the files without suffix.
        text: text of the .bioMod file.
        coordinates: JSON text with the degrees of freedom as functions of the coordinates.
        fidelity: record of what was translated, approximated or left out.
        robot: robot form of the model, whose links and joints are the segments.
    """

    name: str
    text: str
    coordinates: str
    fidelity: Fidelity
    robot: Robot

    def write(self, folder: str | Path) -> list[Path]:
        """Write ``<name>.bioMod`` and ``<name>.coordinates.json`` into a folder.

        The folder is made if it does not exist.

        Returns:
            Paths of the written files.
        """
        files: dict[str, str | bytes] = {
            f"{self.name}.bioMod": self.text,
            f"{self.name}.coordinates.json": self.coordinates,
        }
        return write_files(Path(folder), files)


def to_biomod(
    model: Model,
    *,
    name: str | None = None,
    folder: str | Path | None = None,
    geometry: Sequence[str | Path] = (),
) -> BioMod:
    """Translate a model for biorbd.

    Args:
        model: model to translate.
        name: name of the files without suffix; that of the model by default.
        folder: folder of the model file, as for other exporters; not used here.
        geometry: folders with mesh files, as for other exporters; not used here.

    Returns:
        Texts of the files, and the record of what was translated, approximated or left out.

    Raises:
        ModelError: the model is not a mechanism.
        UnsupportedError: the model uses a joint or constraint that osimlite cannot compute.
    """
    mechanism = build_mechanism(model)
    # biorbd's names have no slashes or blanks.
    robot = legal_names(build_robot(mechanism))
    fidelity = Fidelity(mechanism.name, "biomod")
    # Each joint of the robot becomes a degree of freedom.
    for joint in robot.moving:
        if joint.coordinate is None:
            fidelity.add(
                "function",
                f"{joint.source}/{joint.name}",
                "a joint motion that is a function of coordinates",
                "a separate degree of freedom; the file of coordinates contains the function",
            )
    for constraint in model.components(Constraint):
        fidelity.add("constraint", constraint.path, "constraints", LEFT_OUT)
    placements = Placements(model.tree())
    lines = [
        "version 4",
        "",
        f"gravity {_format_numbers(mechanism.gravity)}",
        "",
        *_format_segments(robot),
        *_format_markers(model, robot, placements, fidelity),
        *_format_muscles(model, robot, placements, fidelity),
    ]
    for force in model.components(Force):
        if not isinstance(force, Muscle):
            fidelity.add("force", force.path, "forces other than muscles", LEFT_OUT)
    record_biomod_losses(model, robot, fidelity)
    file_stem = legal(model.name or "model") if name is None else name
    coordinates = format_coordinates(robot, f"{file_stem}.bioMod")
    return BioMod(file_stem, "\n".join(lines) + "\n", coordinates, fidelity, robot)


def _format_numbers(numbers: Sequence[float] | Array) -> str:
    """Return numbers with all digits, separated by blanks."""
    return " ".join(format_number(float(number)) for number in numbers)


def _format_segments(robot: Robot) -> Iterator[str]:
    """Yield the lines of all segments."""
    root = robot.links[0]
    # Biorbd's own root is called "root", whatever it carries.
    yield from (f"segment {root.name}", "\tparent base", "endsegment", "")
    joints = {joint.child: joint for joint in robot.joints}
    for link in robot.links[1:]:
        joint = joints[link.name]
        parent = joint.parent
        origin = joint.origin
        axis_letter = _find_axis(joint)
        if joint.kind != "fixed" and axis_letter is None:
            # A segment moves along its own axes only: turn to the axis before, and back after.
            axis_frame = np.eye(4)
            # The helper segment has the axis of the joint as its z axis.
            axis_frame[:3, :3] = _make_rotation_to_axis(joint.axis)
            yield from _format_segment(
                f"{link.name}_axis", parent, origin @ axis_frame, joint, "z", robot
            )
            yield from ("\tmass 0", "endsegment", "")
            # The rotation back is the transpose.
            parent = f"{link.name}_axis"
            origin = axis_frame.T
            yield from _format_segment(link.name, parent, origin, None, "", robot)
        else:
            moving_joint = joint if joint.kind != "fixed" else None
            yield from _format_segment(
                link.name, parent, origin, moving_joint, axis_letter or "", robot
            )
        # Without these lines biorbd gives the segment a small mass.
        yield f"\tmass {format_number(link.mass)}"
        yield "\tinertia"
        yield from (f"\t\t{_format_numbers(row)}" for row in link.inertia)
        yield f"\tcom {_format_numbers(link.center)}"
        yield from ("endsegment", "")


def _format_segment(
    name: str, parent: str, origin: Array, joint: RobotJoint | None, axis_letter: str, robot: Robot
) -> Iterator[str]:
    """Yield the lines of a segment up to its mass.

    Args:
        name: name of the segment.
        parent: name of the segment that carries it.
        origin: frame of the segment in that of the parent (4, 4), before the motion.
        joint: joint that moves the segment; None if it does not move.
        axis_letter: axis of the motion.
        robot: robot form of the model.
    """
    yield f"segment {name}"
    yield f"\tparent {parent}"
    yield "\trtinmatrix 1"
    yield "\trt"
    yield from (f"\t\t{_format_numbers(row)}" for row in origin)
    if joint is not None:
        yield f"\t{'rotations' if joint.kind == 'revolute' else 'translations'} {axis_letter}"
        if joint.coordinate is not None:
            limits = robot.mechanism.coordinates[joint.coordinate].range
            if has_limits(limits):
                yield "\trangesQ"
                yield f"\t\t{_format_numbers(limits)}"


def _find_axis(joint: RobotJoint) -> str | None:
    """Return the word for the axis of a joint; None if it is not a positive coordinate axis."""
    # Adding 0.0 turns -0.0 into 0.0, which the table has.
    return AXES.get(tuple((joint.axis + 0.0).tolist()))


def _make_rotation_to_axis(axis: Array) -> Array:
    """Return a rotation (3, 3) whose third column is an axis."""
    # The coordinate axis that is farthest from parallel: its cross product is well conditioned.
    helper = np.eye(3)[int(np.argmin(np.abs(axis)))]
    first = np.cross(helper, axis)
    first /= np.linalg.norm(first)
    return np.column_stack([first, np.cross(axis, first), axis])


def _locate(station: Marker | PathPoint, placements: Placements) -> tuple[str, Array]:
    """Return the path of the body (or ground) of a point, and its position there (3,), m."""
    frame = placements.follow_socket(station, "socket_parent_frame")
    assert isinstance(frame, PhysicalFrame)
    base, matrix = placements.resolve_frame(frame)
    return base, matrix[:3, :3] @ np.array(station.location, dtype=float) + matrix[:3, 3]


def _locate_in_segment(
    station: Marker | PathPoint, robot: Robot, placements: Placements
) -> tuple[str, Array]:
    """Return the segment of a point, and its position there (3,), m."""
    base, point = _locate(station, placements)
    link, body = robot.link_of[base]
    return link.name, body[:3, :3] @ point + body[:3, 3]


def _format_markers(
    model: Model, robot: Robot, placements: Placements, fidelity: Fidelity
) -> Iterator[str]:
    """Yield the lines of all markers."""
    names = UniqueNames()
    for marker in model.components(Marker):
        name = names(marker.name)
        segment, point = _locate_in_segment(marker, robot, placements)
        fidelity.translated[marker.path] = f"marker {name}"
        fidelity.note_name(marker.path, "marker", marker.name, name)
        yield from (f"marker {name}", f"\tparent {segment}", f"\tposition {_format_numbers(point)}")
        yield from ("\ttechnical 1", "endmarker", "")


def _list_fixed_points(path: GeometryPath) -> list[PathPoint]:
    """Return the points of a path that do not move in their bodies, also conditional ones."""
    return [point for point in path.path_point_set.objects if isinstance(point, PathPoint)]


def _measure_path_errors(model: Model, placements: Placements) -> dict[str, dict[str, Error]]:
    """Measure how far straight lines through the fixed points are from the paths of muscles.

    Args:
        model: model to translate.
        placements: frames of the model.

    Returns:
        Errors of length and moment arms by the path of the muscle and the quantity, for muscles
        that have other parts than fixed points.
    """
    inexact: dict[str, list[PathPoint]] = {}
    for muscle in model.components(Muscle):
        path = muscle.geometry_path
        if not isinstance(path, GeometryPath):
            continue
        fixed_points = _list_fixed_points(path)
        if len(fixed_points) > 1 and (
            path.path_wrap_set.objects
            or len(fixed_points) < len(path.path_point_set.objects)
            or any(isinstance(point, ConditionalPathPoint) for point in fixed_points)
        ):
            inexact[muscle.path] = fixed_points
    if not inexact:
        return {}
    paths = Paths(model)
    mechanism = paths.mechanism
    poses, samples = draw_poses(paths, ERROR_POSES)
    # Ground is the last body of the poses.
    bodies = {body.path: index for index, body in enumerate(mechanism.bodies)}
    result = {}
    for muscle_path, points in inexact.items():
        sites = []
        for point in points:
            base, station = _locate(point, placements)
            sites.append(TendonSite(bodies.get(base, len(bodies)), station))
        # Without surfaces, lengths and moment arms are the same in all versions of MuJoCo.
        lengths, arms = measure_tendon(tuple(sites), poses, version=4)
        sample = samples[muscle_path]
        result[muscle_path] = {"length": Error.measure(lengths - sample.lengths, "m")} | {
            f"moment arm about {mechanism.coordinate_names[index]}": error
            for index, error in measure_arm_errors(mechanism, arms, sample).items()
        }
    return result


def _format_muscles(
    model: Model, robot: Robot, placements: Placements, fidelity: Fidelity
) -> Iterator[str]:
    """Yield the lines of all muscles, each with a group of its own."""
    names = UniqueNames()
    errors = _measure_path_errors(model, placements)
    for muscle in model.components(Muscle):
        path = muscle.geometry_path
        if not muscle.appliesForce:
            fidelity.add("muscle", muscle.path, "a muscle whose appliesForce is false", LEFT_OUT)
            # biorbd has no property that turns a muscle off.
            continue
        if not isinstance(path, GeometryPath):
            fidelity.add(
                "muscle", muscle.path, "a path that is a function of coordinates", LEFT_OUT
            )
            # biorbd has no paths that are functions.
            continue
        points = _list_fixed_points(path)
        moving_count = len(path.path_point_set.objects) - len(points)
        conditional_count = sum(isinstance(point, ConditionalPathPoint) for point in points)
        wrap_count = len(path.path_wrap_set.objects)
        if len(points) < 2:
            fidelity.add("muscle", muscle.path, "a path without two fixed points", LEFT_OUT)
            continue
        for count, description, replacement in (
            (wrap_count, "a path around surfaces", "straight between its points"),
            (moving_count, "points that move with a coordinate", "the path runs without them"),
            (
                conditional_count,
                "points that act only in a range of a coordinate",
                "the path always runs through them",
            ),
        ):
            if count:
                fidelity.add(
                    "path",
                    muscle.path,
                    description,
                    replacement,
                    f"{count} in the path",
                    errors.get(muscle.path),
                )
        fidelity.add(
            "muscle-law",
            muscle.path,
            "the force curves of OpenSim's muscles",
            f"biorbd's '{MUSCLE_TYPE}'",
        )
        constants = {
            attribute: value
            for attribute, default in ACTIVATION_CONSTANTS.items()
            # Classes without activation dynamics have no such property.
            if (value := getattr(muscle, attribute, default)) != default
        }
        if constants:
            fidelity.add(
                "activation",
                muscle.path,
                "time constants of the activation",
                "biorbd's time constants for all muscles: activation 0.01 s, deactivation 0.04 s",
                ", ".join(f"{attribute} {value:g} s" for attribute, value in constants.items()),
            )
        name = names(muscle.name)
        fidelity.translated[muscle.path] = f"muscle {name}"
        fidelity.note_name(muscle.path, "muscle", muscle.name, name)
        # The first and the last point are attributes of the group, the others are via points.
        positions = [_locate_in_segment(point, robot, placements) for point in points]
        (first, origin), *via_points, (last, insertion) = positions
        yield from (
            f"musclegroup {name}_group",
            f"\toriginparent {first}",
            f"\tinsertionparent {last}",
        )
        yield from (
            "endmusclegroup",
            "",
            f"muscle {name}",
            f"\ttype {MUSCLE_TYPE}",
            f"\tmusclegroup {name}_group",
        )
        numbers: dict[str, Sequence[float] | Array] = {
            "originposition": origin,
            "insertionposition": insertion,
            "optimallength": [muscle.optimal_fiber_length],
            "maximalforce": [muscle.max_isometric_force],
            "tendonslacklength": [muscle.tendon_slack_length],
            "pennationangle": [muscle.pennation_angle_at_optimal],
            # biorbd ignores attributes that it does not know, such as the "maxvelocity" of older
            # files; its speed is in optimal lengths per second, as OpenSim's.
            "maxshorteningspeed": [muscle.max_contraction_velocity],
        }
        yield from (
            f"\t{attribute} {_format_numbers(values)}" for attribute, values in numbers.items()
        )
        yield from ("endmuscle", "")
        for index, (segment, point) in enumerate(via_points):
            yield from (f"viapoint {name}_{index + 1}", f"\tparent {segment}", f"\tmuscle {name}")
            yield f"\tmusclegroup {name}_group"
            yield from (f"\tposition {_format_numbers(point)}", "endviapoint", "")
