"""Builder of mechanisms: follows sockets, folds frames into bodies, sorts joints into a tree."""

from __future__ import annotations

from math import copysign, pi, remainder

import numpy as np

from osimlite.base.records import dataclass, replace
from osimlite.errors import ModelError, UnsupportedError
from osimlite.mechanics.multibody.body_constraints import RollingConstraint, WeldEquations
from osimlite.mechanics.multibody.constraints import ConstraintEquations, Coupler
from osimlite.mechanics.multibody.extremes import any_numbers
from osimlite.mechanics.multibody.functions import SmoothFunction
from osimlite.mechanics.multibody.joints import Mobilizer, make_plain_motions, motion_types
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.motions import JointMotion, SphericalMotion
from osimlite.mechanics.multibody.parts import (
    GROUND,
    CoordinateInfo,
    FramePlacement,
    MassProperties,
    MobileBody,
    StationPlacement,
)
from osimlite.mechanics.multibody.schema_frames import Placements
from osimlite.mechanics.multibody.schema_functions import convert_function
from osimlite.mechanics.multibody.schema_joints import joint_motions, unknown_joint
from osimlite.mechanics.multibody.spatial import Array
from osimlite.mechanics.multibody.topology import new_base, spanning_tree
from osimlite.schema import sets as schema
from osimlite.schema.base import Component, Unknown
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.frames import Body, PhysicalFrame
from osimlite.schema.joints import Joint
from osimlite.schema.markers import Station
from osimlite.schema.model import Model, check_is_model


@any_numbers
def build_mechanism(
    model: Model, *, opensim_derivatives: bool = False, rolling: bool = False
) -> Mechanism:
    """Build the tree of bodies and mobilizers that a model describes, with its constraints.

    Bodies are ordered level by level from ground, within a level in the order of the joints that
    carry them; coordinates are in the order of OpenSim's CoordinateSet. A joint whose child is
    nearer to ground than its parent is reversed. Bodies that no joint connects to ground get a
    FreeJoint with OpenSim's name.

    Where a joint closes a loop, a WeldJoint becomes a constraint. For any other joint its child
    body is split into halves: the joint carries one of them, and a constraint welds the halves.
    OpenSim 4.6 does the same, but counts the child of the WeldJoint twice and gives the half a
    wrong inertia, which `opensim_derivatives` reproduces. Forces and geometry have no influence.

    Args:
        model: model to convert.
        opensim_derivatives: whether to reproduce two wrong second derivatives of OpenSim 4.6.
            First, Simbody differentiates the angular velocity of a CustomJoint as if the first
            rotation depended on the first coordinate only, and the second rotation on the first two
            coordinates only. Accelerations are therefore wrong where one coordinate drives several
            rotations (for the knee of Rajagopal's model by up to 1 % at usual speeds), and energy is
            not conserved. Second, OpenSim uses the gradient of a MultivariatePolynomialFunction for
            each column of its Hessian. Without this option both are correct.
        rolling: whether every RollingOnSurfaceConstraint acts. OpenSim leaves them off until a
            program enables them.

    Returns:
        Mechanism of the model.

    Raises:
        ModelError: a reference has no target, a joint connects a body with itself or has the wrong
            number of coordinates, or a mass, an inertia or a function is impossible.
        UnsupportedError: a joint, constraint, frame or function is of an unknown class, or a loop
            is closed by a FreeJoint or by a joint whose child is ground.
    """
    check_is_model(model)
    return _Builder(model, opensim_derivatives, rolling).build()


@dataclass(frozen=True, slots=True, eq=False)
class _Edge:
    """A joint with the bodies (or ground) and frames that it connects."""

    kind: str  # OpenSim's class name
    path: str  # absolute path of the joint
    parent: str  # path of the parent body, or of ground
    child: str  # path of the child body, or of ground
    parent_frame: Array  # the joint's parent frame in the parent body (4, 4)
    child_frame: Array  # the joint's child frame in the child body (4, 4)
    motions: tuple[JointMotion, ...]  # factors of the joint's transform
    coordinates: tuple[int, ...]  # indices of its coordinates in the mechanism

    def build_mobilizer(self, *, reversed: bool) -> Mobilizer:
        """Return the mobilizer of the joint.

        Args:
            reversed: whether the child carries the parent in the tree.
        """
        return Mobilizer(
            joint=self.path,
            joint_type=self.kind,
            motions=self.motions,
            coordinates=self.coordinates,
            parent_frame=self.parent_frame,
            child_frame=self.child_frame,
            reversed=reversed,
        )


class _Builder:
    def __init__(self, model: Model, opensim_derivatives: bool, rolling: bool) -> None:
        self.model = model
        self.opensim_derivatives, self.rolling = opensim_derivatives, rolling
        self.tree = model.tree()
        self.placements = Placements(self.tree)
        self.coordinates: list[CoordinateInfo] = []
        self.bodies: dict[str, Body] = {}
        self.constraints: list[ConstraintEquations] = []

    def build(self) -> Mechanism:
        """Return the mechanism of the model.

        Raises:
            ModelError: the model has a mistake.
            UnsupportedError: a class of the model cannot be computed.
        """
        # Refuse unknown classes before anything else, with their own messages.
        for component in self.tree.components:
            self._refuse_unknown(component)
        for component in self.tree.components:
            if isinstance(component, Body):
                self.bodies[self.placements.path(component)] = component
            # All frames are resolved, because forces and geometry refer to them by path.
            if isinstance(component, PhysicalFrame):
                self.placements.resolve_frame(component)
        edges = [
            self._make_edge(joint) for joint in self.tree.components if isinstance(joint, Joint)
        ]
        bodies = self._build_bodies(edges)
        ground = self.placements.path(self.model.ground)
        index = {body.path: number for number, body in enumerate(bodies)} | {ground: GROUND}
        self._build_constraints(index)
        placements = self.placements
        for path, (base, _) in placements.resolved.items():
            if base not in index:
                raise UnsupportedError(
                    f"the frame '{path}' is neither a body of the model nor fixed to one; remove it"
                )
        frames = {
            path: FramePlacement(index[base], matrix)
            for path, (base, matrix) in placements.resolved.items()
        }
        stations = {}
        for component in self.tree.components:
            if isinstance(component, Station) and not self.tree.is_internal(component):
                base, location = placements.resolve_station(component)
                stations[placements.path(component)] = StationPlacement(index[base], location)
        gravity = np.array(self.model.gravity, dtype=float)
        return Mechanism(
            self.model.name,
            tuple(bodies),
            tuple(self.coordinates),
            gravity,
            frames,
            tuple(self.constraints),
            stations,
            self.model.assembly_accuracy,
        )

    def _refuse_unknown(self, component: Component) -> None:
        """Raise an error for an unknown component that would move the bodies differently.

        Raises:
            UnsupportedError: the component is a joint, a body or a constraint of an unknown class.
        """  # noqa: DOC501 - functions make the UnsupportedError
        if not isinstance(component, Unknown):
            return
        holder, path = self.tree.parent_of(component), self.placements.path(component)
        if holder in (self.model.joint_set, self.model.body_set):
            raise unknown_joint(path, component.class_name)
        if holder is self.model.constraint_set:
            from osimlite.mechanics.multibody.schema_constraints import unknown_constraint

            raise unknown_constraint(path, component.class_name)

    def _make_edge(self, joint: Joint) -> _Edge:
        """Return the edge of a joint, and add the coordinates of the joint to the mechanism.

        Raises:
            ModelError: the joint connects a body to itself, or its coordinates have a mistake.
        """
        path = self.placements.path(joint)
        parent, parent_frame = self.placements.resolve_frame(
            self.placements.follow_socket(joint, "socket_parent_frame")
        )
        child, child_frame = self.placements.resolve_frame(
            self.placements.follow_socket(joint, "socket_child_frame")
        )
        if parent == child:
            raise ModelError(
                f"the joint '{path}' connects '{parent}' to itself; name frames of two bodies"
            )
        motions, coordinates = joint_motions(
            joint, path, opensim_derivatives=self.opensim_derivatives
        )
        first, count = len(self.coordinates), len(coordinates)
        # The second angle of a ball joint must not start at its singularity.
        middle = {
            motion.coordinates[1] for motion in motions if isinstance(motion, SphericalMotion)
        }
        types = motion_types(motions, count)
        for index, (coordinate, motion_type) in enumerate(zip(coordinates, types, strict=True)):
            coordinate_path = self.placements.path(coordinate)
            value = coordinate.default_value
            low, high = coordinate.range
            self.coordinates.append(
                CoordinateInfo(
                    name=_get_last_name(coordinate_path),
                    path=coordinate_path,
                    joint=path,
                    motion_type=motion_type,
                    default_value=avoid_right_angle(value) if index in middle else value,
                    default_speed=coordinate.default_speed_value,
                    range=(low, high),
                    clamped=coordinate.clamped,
                    locked=coordinate.locked,
                    prescribed=self._convert_prescribed_function(coordinate, coordinate_path),
                    yielding=coordinate.is_free_to_satisfy_constraints,
                )
            )
        indices = tuple(range(first, first + count))
        return _Edge(
            type(joint).__name__, path, parent, child, parent_frame, child_frame, motions, indices
        )

    def _convert_prescribed_function(
        self, coordinate: Coordinate, path: str
    ) -> SmoothFunction | None:
        """Return the function of time of a prescribed coordinate, None if it moves freely.

        Args:
            coordinate: coordinate.
            path: path of the coordinate in the model, for messages.
        """
        # OpenSim leaves a prescribed coordinate without a function free. It cannot start where one
        # is locked too.
        if not coordinate.prescribed or coordinate.prescribed_function is None or coordinate.locked:
            return None
        return convert_function(
            coordinate.prescribed_function,
            1,
            f"the prescribed_function of '{path}'",
            opensim_derivatives=self.opensim_derivatives,
        )

    def _build_bodies(self, edges: list[_Edge]) -> list[MobileBody]:
        """Return the bodies with their mobilizers, and add constraints for joints that close loops.

        Args:
            edges: joints of the model.

        Raises:
            UnsupportedError: a joint with coordinates closes a loop, and is a FreeJoint or has
                ground as its child.
        """
        ground = self.placements.path(self.model.ground)
        masses = {path: body.mass for path, body in self.bodies.items()}
        joined = {path for edge in edges for path in (edge.parent, edge.child)}
        edges = [
            *edges,
            *(self._add_free_joint(path, ground) for path in self.bodies if path not in joined),
        ]
        # Groups of bodies that no chain of joints connects to ground get one FreeJoint each.
        while True:
            branches, loops = spanning_tree(edges, ground, masses)
            index = {ground: GROUND} | {
                branch.outer: number for number, branch in enumerate(branches)
            }
            unjoined_bodies = [path for path in self.bodies if path not in index]
            if not unjoined_bodies:
                break
            edges.append(self._add_free_joint(new_base(unjoined_bodies, edges), ground))
        bodies = []
        for edge, outer, backward in branches:
            carrier = edge.child if backward else edge.parent
            mobilizer = edge.build_mobilizer(reversed=backward)
            properties = mass_properties(self.bodies[outer], outer)
            bodies.append(
                MobileBody(_get_last_name(outer), outer, index[carrier], properties, mobilizer)
            )
        for edge in loops:
            if not edge.coordinates:
                first = FramePlacement(index[edge.parent], edge.parent_frame)
                second = FramePlacement(index[edge.child], edge.child_frame)
                self.constraints.append(WeldEquations(first, second, edge.path))
                # OpenSim 4.6 carries the child's mass once more by the joint that it has turned
                # into a constraint.
                if self.opensim_derivatives:
                    repeated_mass = mass_properties(self.bodies[edge.child], edge.child)
                    mobilizer = edge.build_mobilizer(reversed=False)
                    path = f"{edge.child}_again{len(bodies)}"
                    bodies.append(
                        MobileBody(
                            _get_last_name(path), path, index[edge.parent], repeated_mass, mobilizer
                        )
                    )
            elif edge.child == ground or edge.kind == "FreeJoint":
                raise UnsupportedError(
                    f"the joint '{edge.path}' closes a loop through '{edge.parent}' and '{edge.child}', "
                    "which osimlite cannot compute; remove one joint of the loop"
                )
            else:
                self._split_child(edge, index, bodies)
        return bodies

    def _add_free_joint(self, body: str, ground: str) -> _Edge:
        """Return the FreeJoint that OpenSim adds for a body without connection to ground.

        Args:
            body: path of the body.
            ground: path of ground.
        """
        # Few models have such a body; the others need not import the class.
        from osimlite.schema.joint_types import FreeJoint

        name = f"free_{_get_last_name(body)}"
        motions = make_plain_motions(FreeJoint)
        path = f"{self.placements.path(self.model.joint_set)}/{name}"
        first = len(self.coordinates)
        for index, motion_type in enumerate(motion_types(motions, 6)):
            coordinate_name = f"{name}_coord_{index}"
            self.coordinates.append(
                CoordinateInfo(coordinate_name, f"{path}/{coordinate_name}", path, motion_type)
            )
        indices = tuple(range(first, first + 6))
        identity = np.eye(4)
        return _Edge("FreeJoint", path, ground, body, identity, identity, motions, indices)

    def _split_child(self, edge: _Edge, index: dict[str, int], bodies: list[MobileBody]) -> None:
        """Split the child of a joint that closes a loop, and weld the parts, as OpenSim does.

        Mass and inertia are divided equally among the body and all of its parts. With the option
        `opensim_derivatives` the parts have the inertia that OpenSim 4.6 gives them instead, which
        is wrong.

        Args:
            edge: joint that closes the loop; it carries the new part.
            index: index of each body, by path.
            bodies: bodies; the part is appended, and masses are divided.
        """
        child_index = index[edge.child]
        complete_mass = mass_properties(self.bodies[edge.child], edge.child)
        # The body may have been split before, if it closes several loops.
        part_indices = [
            child_index,
            *(k for k, body in enumerate(bodies) if body.path.startswith(f"{edge.child}_part")),
        ]
        path = f"{edge.child}_part{len(part_indices)}"
        bodies.append(
            MobileBody(
                _get_last_name(path),
                path,
                index[edge.parent],
                complete_mass,
                edge.build_mobilizer(reversed=False),
            )
        )
        part_indices.append(len(bodies) - 1)
        part_mass = complete_mass.divide(len(part_indices))
        for part_index in part_indices:
            # OpenSim gives all parts but the body itself the inertia about the origin per kg of
            # body.
            has_opensim_error = self.opensim_derivatives and part_index != child_index
            inertia = (
                complete_mass.about_origin() / complete_mass.mass
                if has_opensim_error and complete_mass.mass
                else part_mass.inertia
            )
            bodies[part_index] = replace(
                bodies[part_index], mass_properties=replace(part_mass, inertia=inertia)
            )
        identity = np.eye(4)
        weld = WeldEquations(
            FramePlacement(child_index, identity),
            FramePlacement(len(bodies) - 1, identity),
            edge.path,
        )
        self.constraints.append(weld)

    def _build_constraints(self, index: dict[str, int]) -> None:
        """Add the enforced constraints of the model, and free their dependent coordinates.

        Rolling constraints are left out unless the builder was made with `rolling`.

        Args:
            index: index of each body and of ground, by path.
        """
        enforced = [
            component
            for component in self.tree.components
            if isinstance(component, schema.Constraint) and component.isEnforced
        ]
        if not enforced:
            return
        # Models without constraints save the import of the classes.
        from osimlite.mechanics.multibody.schema_constraints import ConstraintReader

        coordinate_indices = {
            info.path: coordinate_index for coordinate_index, info in enumerate(self.coordinates)
        }
        reader = ConstraintReader(
            self.placements, index, coordinate_indices, self.opensim_derivatives
        )
        for component in enforced:
            constraint = reader.build_constraint(component)
            if isinstance(constraint, RollingConstraint) and not self.rolling:
                continue
            self.constraints.append(constraint)
            # OpenSim's assembly does not penalize the change of a dependent coordinate: `yielding`
            # means that it may move freely to satisfy the constraints.
            if isinstance(constraint, Coupler):
                dependent = constraint.dependent
                self.coordinates[dependent] = replace(self.coordinates[dependent], yielding=True)


RIGHT_ANGLE_GAP = 1e-6
"""Smallest distance (rad) from 90 degrees at which the second of three angles starts."""


def avoid_right_angle(angle: float) -> float:
    """Return an angle that is at least `RIGHT_ANGLE_GAP` away from 90 degrees, 270 and so on (rad).

    OpenSim describes ball and free joints by quaternions, which have no singular pose. The rates of
    three angles are infinite where the second is exactly a right angle. A motion that starts next
    to it is the same within the gap.
    """
    # From -90 to 90 degrees, with the same sine but for its sign.
    from_straight = remainder(angle, pi)
    gap = 0.5 * pi - abs(from_straight)
    if gap >= RIGHT_ANGLE_GAP:
        return angle
    return angle - copysign(RIGHT_ANGLE_GAP - gap, from_straight)


def mass_properties(body: Body, path: str) -> MassProperties:
    """Return the mass properties of a body of a model.

    Args:
        body: body.
        path: path of the body in the model, for messages.

    Raises:
        ModelError: mass, mass centre or inertia is impossible.
    """
    mass = body.mass
    if not 0.0 <= mass < np.inf:
        raise ModelError(
            f"the body '{path}' has mass {mass:g}; give it a mass in kg that is not negative"
        )
    center, (xx, yy, zz, xy, xz, yz) = np.array(body.mass_center, dtype=float), body.inertia
    inertia = np.array(((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)), dtype=float)
    if not (np.isfinite(center).all() and np.isfinite(inertia).all()):
        raise ModelError(
            f"the body '{path}' has a mass centre or inertia that is not finite; give numbers"
        )
    # OpenSim lets a body without mass have no inertia either.
    return MassProperties(mass, center, inertia if mass > np.finfo(float).eps else np.zeros((3, 3)))


def _get_last_name(path: str) -> str:
    """Return the last name of a path."""
    return path.rsplit("/", 1)[1]
