"""Account of a translation to URDF, with a record for each loss and change."""

from __future__ import annotations

from functools import cached_property

from osimlite.mechanics.multibody.functions import IDENTITY
from osimlite.schema.base import Component
from osimlite.schema.contact import ContactGeometry
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.forces import Force
from osimlite.schema.frames import PhysicalFrame
from osimlite.schema.geometry import FrameGeometry
from osimlite.schema.joints import Joint
from osimlite.schema.markers import Marker
from osimlite.schema.model import Model
from osimlite.schema.sets import Constraint, Controller, ModelComponentSet, Probe
from osimlite.schema.tree import Tree
from osimlite.schema.wrapping import WrapObject, WrapObjectSet
from osimlite.simulation.robot.couplings import Mimic, find_mimics, list_couplers
from osimlite.simulation.robot.robot import Robot, RobotJoint, breaks_triangle_rule, principal_axes
from osimlite.translate.fidelity import LEFT_OUT, Fidelity

COMPUTE_ADVICE = "your program must compute its value with the function in .coordinates.json"
"""Advice for a joint that the robot file leaves free."""

CONTAINERS = (ModelComponentSet, WrapObjectSet, FrameGeometry)
"""Components without content of their own: sets, and the axes that a viewer draws at a frame."""

_LOST_TYPES: tuple[tuple[type[Component], str, str], ...] = (
    (Force, "force", "a force"),
    (ContactGeometry, "contact-geometry", "a contact surface and its material"),
    (Marker, "marker", "a marker"),
    (Controller, "controller", "a controller"),
    (Probe, "probe", "a probe"),
    (Constraint, "constraint", "a constraint besides the joints"),
    (WrapObject, "wrap-object", "a surface that paths wrap around"),
)
"""Classes that URDF cannot express, with the kind of the record and a description."""


def record_losses(model: Model, robot: Robot, fidelity: Fidelity) -> None:
    """Record the translation or the loss of every component of a model in a robot.

    Args:
        model: model that was translated.
        robot: robot form of the model, with final names and limits.
        fidelity: account, which already has the records of the geometry.
    """
    _Survey(model, robot, fidelity).run()


def record_dropped_components(tree: Tree, fidelity: Fidelity) -> None:
    """Record every component that is not accounted for as left out.

    Parts of such components need no record.

    Args:
        tree: components of the model.
        fidelity: account of the translation; records are added.
    """
    accounted = {record.component for record in fidelity.records} | fidelity.translated.keys()
    dropped_paths = {
        record.component for record in fidelity.records if record.how == "dropped"
    } - fidelity.translated.keys()
    dropped: set[int] = set()
    for component in tree.components:
        path = tree.path_of(component) or ""
        parent = tree.parent_of(component)
        is_part = parent is not None and id(parent) in dropped
        if is_part or path in dropped_paths:
            # Parts of something left out, such as the path of a muscle, are left out with it.
            dropped.add(id(component))
        elif path not in accounted and not isinstance(component, CONTAINERS):
            dropped.add(id(component))
            name = getattr(component, "class_name", "") or type(component).__name__
            descriptions = (
                (loss_type, description)
                for cls, loss_type, description in _LOST_TYPES
                if isinstance(component, cls)
            )
            loss_type, description = next(
                descriptions, ("component", f"a component of class {name}")
            )
            fidelity.add(loss_type, path, description, LEFT_OUT, name)


class _Survey:
    """Pass over the components of a model, with one method per kind of component."""

    def __init__(self, model: Model, robot: Robot, fidelity: Fidelity) -> None:
        self.model = model
        self.robot = robot
        self.fidelity = fidelity
        self.tree = model.tree()
        self.note = fidelity.add

    def run(self) -> None:
        """Record what became of every component, kind by kind."""
        self.fidelity.translated["/"] = f"robot {self.robot.name}"
        self._record_gravity()
        self._record_links()
        self._record_joints()
        for index, info in enumerate(self.robot.mechanism.coordinates):
            result = self.tree.by_path.get(info.path)
            # Coordinates of a joint that OpenSim adds below a loose body are not in the file.
            if isinstance(result, Coordinate):
                self._record_coordinate(index, result, info.path)
        for link in self.robot.links:
            for shape_type, shapes in (("visual", link.visuals), ("collision", link.collisions)):
                for shape in shapes:
                    self.fidelity.translated[shape.source] = f"{shape_type} of link {link.name}"
        self._record_couplers()
        self._record_frames()
        record_dropped_components(self.tree, self.fidelity)

    def _record_gravity(self) -> None:
        """Record the gravity, and units other than those of the SI."""
        units = f"{self.model.length_units} {self.model.force_units}".lower().split()
        # OpenSim's unit names have no effect on computations; all files are read as SI.
        if units not in (["meters", "n"], ["m", "n"]):
            self.note(
                "units",
                "/",
                "names of units in the model, which have no effect",
                "numbers written as m, kg, s, rad",
            )
        # In URDF gravity belongs to the simulator, not to the robot.
        x, y, z = self.model.gravity
        self.note(
            "gravity",
            "/",
            "gravity",
            "left out: set it in your program",
            f"({x:g}, {y:g}, {z:g}) m/s^2",
        )

    def _record_links(self) -> None:
        """Record what became of each body, and of the parts of bodies in closed loops."""
        joint_of_body = {body.path: body.mobilizer.joint for body in self.robot.mechanism.bodies}
        for path, (link, _) in self.robot.link_of.items():
            if path not in self.tree.by_path:
                self.note(
                    "loop",
                    joint_of_body[path],
                    "a closed loop of joints",
                    "cut: a second part of the body, with a part of its mass, is at this joint; nothing holds the parts together",
                    f"link {link.name}",
                )
                continue
            self.fidelity.translated[path] = f"link {link.name}"
            if joint_of_body.get(path, "/ground") not in (*self.tree.by_path, "/ground"):
                self.note(
                    "loose-body",
                    path,
                    "a body without a joint",
                    "free to move relative to ground, as in OpenSim",
                    joint_of_body[path],
                )
            if len(link.bodies) > 1 and path != "/ground":
                massless = (
                    " without its mass, because the link does not move"
                    if "/ground" in link.bodies
                    else ""
                )
                merged = f"merged into link {link.name}{massless}"
                self.note(
                    "merged-body",
                    path,
                    "bodies that are welded together, as separate links",
                    merged,
                )
            elif path != "/ground" and link.name != path.rsplit("/", 1)[1]:
                self._record_new_name(path, f"link {link.name}")
            # Forward dynamics is singular if nothing resists the last joint.
            if link.mass == 0.0 and link.name in self._moving_ends:
                done = "written unchanged; PyBullet keeps the last joint of the chain fixed"
                self.note("massless-end", path, "a body without mass at the end of a chain", done)
            moments, _ = principal_axes(link.inertia)
            if breaks_triangle_rule(moments):
                self.note(
                    "inertia",
                    path,
                    "an inertia that no body can have (one principal moment exceeds the sum of the others)",
                    "written unchanged; PyBullet uses zero instead, MuJoCo rejects the file",
                    "moments " + ", ".join(f"{moment:g}" for moment in moments) + " kg m^2",
                )

    @cached_property
    def _moving_ends(self) -> set[str]:
        """Links that a moving joint carries and that carry no other link."""
        parent_links = {joint.parent for joint in self.robot.joints}
        return {joint.child for joint in self.robot.moving} - parent_links

    def _record_joints(self) -> None:
        """Record the joints of the robot by which each joint of the model was replaced."""
        massless_links = {link.name for link in self.robot.links if not link.bodies}
        for joint in self.tree.components:
            if not isinstance(joint, Joint):
                continue
            path = self.tree.path_of(joint) or ""
            chain = [robot_joint for robot_joint in self.robot.joints if robot_joint.source == path]
            names = " ".join(robot_joint.name for robot_joint in chain)
            self.fidelity.translated[path] = (
                f"joint {names}" if names else "merged into the link that carries it"
            )
            middle_links = [
                robot_joint.child for robot_joint in chain if robot_joint.child in massless_links
            ]
            if middle_links:
                self.note(
                    "massless-link",
                    path,
                    "a joint with several axes, or with an axis that does not pass through the origin of its child body",
                    "several joints in a chain, each with one axis; the links between them have no mass",
                    f"links {' '.join(middle_links)}",
                )
            coordinate_indices = {
                index for robot_joint in chain for index in robot_joint.coordinates
            }
            # URDF has no ball joint.
            if coordinate_indices and not joint.speeds_are_rates:
                self.note(
                    "ball-joint",
                    path,
                    "a ball joint: three rotations, whose speeds are the components of the angular velocity",
                    "three revolute joints: singular where the second angle is +-90 degrees; their speeds are the "
                    "rates of the angles",
                )

    def _record_coordinate(self, index: int, coordinate: Coordinate, path: str) -> None:
        """Record the joint of a coordinate, and what of the coordinate is lost."""
        unit = (
            "m" if self.robot.mechanism.coordinates[index].motion_type == "translational" else "rad"
        )
        joint = self.robot.joint_of.get(index)
        driven_joints = [
            robot_joint for robot_joint in self.robot.moving if index in robot_joint.coordinates
        ]
        if not driven_joints:
            self.fidelity.translated[path] = "fixed"
            value = f"{coordinate.default_value:g} {unit}"
            self.note("locked", path, "a locked coordinate", "a fixed joint at its value", value)
            return
        self.fidelity.translated[path] = (
            f"joint {driven_joints[0].name}" if joint is None else f"joint {joint.name}"
        )
        if joint is not None and joint.name != path.rsplit("/", 1)[1]:
            self._record_new_name(path, f"joint {joint.name}")
        self._record_range(
            coordinate, path, unit, has_limit=joint is not None and joint.limits is not None
        )
        if coordinate.locked:
            self.note(
                "locked",
                path,
                "a locked coordinate",
                "a joint that moves: hold it in your program",
            )
        if coordinate.prescribed and coordinate.prescribed_function is not None:
            done = "a joint that moves: drive it in your program"
            self.note(
                "prescribed",
                path,
                "a prescribed coordinate, which follows a function of time",
                done,
            )
        self._record_start(coordinate, path, unit)
        self._record_functions(driven_joints, path)

    def _record_range(
        self, coordinate: Coordinate, path: str, unit: str, *, has_limit: bool
    ) -> None:
        """Record that URDF has hard limits only."""
        lower, upper = coordinate.range
        text = f"{lower:g} to {upper:g} {unit}"
        self.note(
            "coordinate-range",
            path,
            "a coordinate range, which does not limit simulations (a URDF limit is a hard stop)",
            "written as a hard limit" if has_limit else "no limit written",
            text,
        )
        if coordinate.clamped:
            self.note(
                "clamped",
                path,
                "a clamped coordinate, which tools and user interfaces keep in its range",
                "left out",
                text,
            )

    def _record_start(self, coordinate: Coordinate, path: str, unit: str) -> None:
        """Record default values and speeds, which URDF lacks."""
        # URDF has no initial position.
        if coordinate.default_value != 0.0:
            self.note(
                "default-pose",
                path,
                "a default value (in URDF every joint starts at zero)",
                "left out: set the joint in your program",
                f"{coordinate.default_value:g} {unit}",
            )
        if coordinate.default_speed_value != 0.0:
            self.note(
                "default-speed",
                path,
                "a default speed",
                "left out: set it in your program",
                f"{coordinate.default_speed_value:g} {unit}/s",
            )

    def _record_functions(self, driven_joints: list[RobotJoint], path: str) -> None:
        """Record joints that are functions of a coordinate."""
        for robot_joint in driven_joints:
            if robot_joint.function == IDENTITY:
                continue
            mimic = self._mimics.get(robot_joint.name)
            self.note(
                "coordinate-function",
                path,
                "a joint that follows a function of a coordinate",
                f"a separate joint: {COMPUTE_ADVICE}"
                if mimic is None
                else "a joint that mimics another",
                f"joint {robot_joint.name}" + ("" if mimic is None else f" follows {mimic.leader}"),
            )

    def _record_couplers(self) -> None:
        """Record coordinates that are functions of others."""
        for coupler in list_couplers(self.robot):
            driven_joints = [
                robot_joint.name
                for robot_joint in self.robot.moving
                if coupler.dependent in robot_joint.coordinates
            ]
            leaders = {
                self._mimics[name].leader if name in self._mimics else None
                for name in driven_joints
            }
            # Several joints of one coordinate may mimic different leaders; then none is named.
            leader = leaders.pop() if len(leaders) == 1 else None
            name = self.robot.mechanism.coordinates[coupler.dependent].name
            done = f"a separate joint: {COMPUTE_ADVICE}"
            if leader is not None:
                done = "a joint that mimics another"
            elif not driven_joints:
                done = "a fixed joint: your program must hold the coordinates of which it is a function"
            self.note(
                "coupler",
                coupler.name,
                "a coordinate that is a function of others",
                done,
                f"coordinate {name}" + ("" if leader is None else f" follows joint {leader}"),
            )

    @cached_property
    def _mimics(self) -> dict[str, Mimic]:
        """Joints that mimic another one, by name."""
        return find_mimics(self.robot)

    def _record_frames(self) -> None:
        """Record frames that are no links."""
        mechanism = self.robot.mechanism
        for frame in self.tree.components:
            path = self.tree.path_of(frame) or ""
            if (
                not isinstance(frame, PhysicalFrame)
                or path not in mechanism.frames
                or path in self.fidelity.translated
            ):
                continue
            # Offset frames of joints are part of the joint origins.
            if isinstance(self.tree.parent_of(frame), Joint):
                self.fidelity.translated[path] = "origins of the joint's parts"
                continue
            body, frame_in_body = mechanism.frames[path]
            owner = mechanism.bodies[body].path if body >= 0 else "/ground"
            x, y, z = frame_in_body[:3, 3]
            self.note(
                "frame",
                path,
                "a frame that is not a link",
                "left out as a frame; parts that are fixed to the frame are in the body's link",
                f"in {owner} at ({x:g}, {y:g}, {z:g}) m",
            )

    def _record_new_name(self, path: str, name: str) -> None:
        """Record a new name."""
        self.note("name", path, "the original name of a component", "renamed", name)
