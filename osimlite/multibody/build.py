"""From the model to the mechanism: sockets followed, frames folded into bodies, joints sorted into a tree."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from osimlite.errors import ModelError, UnsupportedError
from osimlite.multibody.joints import MOTIONS, Mobilizer, motion_types
from osimlite.multibody.mechanism import (
    GROUND,
    CoordinateInfo,
    FramePlacement,
    MassProperties,
    Mechanism,
    MobileBody,
)
from osimlite.multibody.motions import Motion
from osimlite.multibody.spatial import Array, offset
from osimlite.schema.base import Component, Unknown
from osimlite.schema.constraints import Constraint
from osimlite.schema.frames import Body, Ground, PhysicalFrame, PhysicalOffsetFrame
from osimlite.schema.joints import Joint
from osimlite.schema.model import Model
from osimlite.text import listed


def build_mechanism(model: Model) -> Mechanism:
    """The tree of bodies and mobilizers that a model describes.

    Bodies come level by level from ground, within a level in the order of the joints that carry them; coordinates
    come in the order of OpenSim's CoordinateSet. A joint whose child is nearer to ground than its parent is
    reversed. Markers, forces and geometry play no part.

    Raises:
        ModelError: a frame or joint names what does not exist, bodies are not connected to ground, a joint connects
            a body with itself or has the wrong number of coordinates, a mass or an inertia is impossible.
        UnsupportedError: a joint of another type, a closed loop, a constraint, a prescribed coordinate.
    """
    return _Builder(model).mechanism()


@dataclass(frozen=True, slots=True, eq=False)
class _Edge:
    """A joint, with the bodies (or ground) and frames it connects and the places of its coordinates."""

    joint: Joint
    path: str
    parent: str
    child: str
    parent_frame: Array
    child_frame: Array
    motions: tuple[Motion, ...]
    coordinates: tuple[int, ...]

    def mobilizer(self, *, reversed: bool) -> Mobilizer:
        return Mobilizer(
            joint=self.path,
            joint_type=type(self.joint).__name__,
            motions=self.motions,
            coordinates=self.coordinates,
            parent_frame=self.parent_frame,
            child_frame=self.child_frame,
            reversed=reversed,
        )


class _Builder:
    def __init__(self, model: Model) -> None:
        self.model = model
        self.tree = model.tree()
        self.coordinates: list[CoordinateInfo] = []
        # The body (or ground) that each frame is fixed to, by absolute path, and where it is there.
        self.placements: dict[str, tuple[str, Array]] = {}
        self.bodies: dict[str, Body] = {}

    def mechanism(self) -> Mechanism:
        for component in self.tree.components:
            self._refuse(component)
        for component in self.tree.components:
            if isinstance(component, Body):
                self.bodies[self._path(component)] = component
            if isinstance(component, PhysicalFrame):
                self._place(component, ())
        edges = [self._edge(joint) for joint in self.tree.components if isinstance(joint, Joint)]
        bodies = tuple(self._sorted(edges))
        index = {body.path: place for place, body in enumerate(bodies)} | {self._path(self.model.ground): GROUND}
        frames = {path: FramePlacement(index[base], matrix) for path, (base, matrix) in self.placements.items()}
        gravity = np.array(self.model.gravity, dtype=float)
        return Mechanism(self.model.name, bodies, tuple(self.coordinates), gravity, frames)

    def _refuse(self, component: Component) -> None:
        """Stop at what would move the bodies differently and is not computed here."""
        kind = component.class_name if isinstance(component, Unknown) else type(component).__name__
        holder = self.tree.parent_of(component)
        if isinstance(component, Unknown) and holder in (self.model.joint_set, self.model.body_set):
            raise self._unknown(self._path(component), kind)
        unknown_constraint = isinstance(component, Unknown) and holder is self.model.constraint_set
        if unknown_constraint or (isinstance(component, Constraint) and component.isEnforced):
            raise UnsupportedError(
                f"the constraint '{self._path(component)}' ({kind}) cannot be computed; "
                "set its isEnforced to false or remove it"
            )

    def _place(self, frame: PhysicalFrame, followed: tuple[str, ...]) -> tuple[str, Array]:
        """The body (or ground) that a frame is fixed to, and the frame's transform there."""
        path = self._path(frame)
        if path in self.placements:
            return self.placements[path]
        if path in followed:
            raise ModelError(f"the frame '{path}' is fixed to itself, through {listed(followed)}; fix it to a body")
        if isinstance(frame, Body | Ground):
            found = (path, np.eye(4))
        elif isinstance(frame, PhysicalOffsetFrame):
            base, matrix = self._place(self._frame(frame, "socket_parent"), (*followed, path))
            found = (base, matrix @ offset(frame.translation, frame.orientation))
        else:
            raise UnsupportedError(f"the frame '{path}' is a {type(frame).__name__}, which osimlite cannot place")
        self.placements[path] = found
        return found

    def _frame(self, owner: Component, socket: str) -> PhysicalFrame:
        target = self.tree.target(owner, socket, getattr(owner, socket))
        if not isinstance(target, PhysicalFrame):
            kind = getattr(target, "class_name", "") or type(target).__name__
            raise UnsupportedError(
                f"'{self._path(owner)}': {socket} names '{self._path(target)}', a {kind}, "
                "which osimlite cannot place; name a body or a PhysicalOffsetFrame"
            )
        return target

    def _edge(self, joint: Joint) -> _Edge:
        path, kind = self._path(joint), type(joint).__name__
        parent, parent_frame = self._place(self._frame(joint, "socket_parent_frame"), ())
        child, child_frame = self._place(self._frame(joint, "socket_child_frame"), ())
        if parent == child:
            raise ModelError(f"the joint '{path}' connects '{parent}' to itself; name frames of two bodies")
        motions = self._motions(joint)
        first, count = len(self.coordinates), len(joint.coordinates)
        needed = 1 + max((place for motion in motions for place in motion.coordinates), default=-1)
        if count != needed:
            raise ModelError(f"{kind} '{path}' has {count} coordinates and needs {needed}")
        for coordinate, motion_type in zip(joint.coordinates, motion_types(motions, count), strict=True):
            own_path = self._path(coordinate)
            if coordinate.prescribed and coordinate.prescribed_function is not None:
                raise UnsupportedError(
                    f"the coordinate '{own_path}' is prescribed by a function, which osimlite cannot follow; "
                    "set its prescribed to false, or lock it"
                )
            low, high = coordinate.range
            self.coordinates.append(
                CoordinateInfo(
                    name=_last(own_path),
                    path=own_path,
                    joint=path,
                    motion_type=motion_type,
                    default_value=coordinate.default_value,
                    default_speed=coordinate.default_speed_value,
                    range=(low, high),
                    clamped=coordinate.clamped,
                    locked=coordinate.locked,
                )
            )
        own = tuple(range(first, first + count))
        return _Edge(joint, path, parent, child, parent_frame, child_frame, motions, own)

    def _motions(self, joint: Joint) -> tuple[Motion, ...]:
        kind = type(joint).__name__
        if kind not in MOTIONS:
            raise self._unknown(self._path(joint), kind)
        return MOTIONS[kind]

    @staticmethod
    def _unknown(path: str, kind: str) -> UnsupportedError:
        return UnsupportedError(
            f"'{path}' is a {kind}, whose motion osimlite cannot compute; the joints it can are "
            f"{listed(MOTIONS, most=len(MOTIONS))}"
        )

    def _sorted(self, edges: list[_Edge]) -> Iterator[MobileBody]:
        """Yield the bodies level by level from ground, each with the mobilizer that carries it."""
        level = [self._path(self.model.ground)]
        index, used = {level[0]: GROUND}, set()
        while level:
            beyond = []
            for edge in edges:
                if edge.path in used or (edge.parent not in level and edge.child not in level):
                    continue
                used.add(edge.path)
                carrier, outer = edge.parent, edge.child
                if carrier not in level:
                    carrier, outer = outer, carrier
                if outer in index:
                    raise UnsupportedError(
                        f"the joint '{edge.path}' closes a loop through '{edge.parent}' and '{edge.child}', "
                        "which osimlite cannot compute; remove one joint of the loop"
                    )
                yield MobileBody(
                    name=_last(outer),
                    path=outer,
                    parent=index[carrier],
                    mass_properties=self._mass_properties(outer),
                    mobilizer=edge.mobilizer(reversed=carrier == edge.child),
                )
                index[outer] = len(index) - 1
                beyond.append(outer)
            level = beyond
        loose = [path for path in self.bodies if path not in index]
        if loose:
            raise ModelError(
                f"no joint connects {listed(loose)} to ground; add a joint for each, for instance a FreeJoint"
            )

    def _mass_properties(self, path: str) -> MassProperties:
        body = self.bodies[path]
        mass = body.mass
        if not 0.0 <= mass < np.inf:
            raise ModelError(f"the body '{path}' has mass {mass:g}; give it a mass in kg that is not negative")
        center, (xx, yy, zz, xy, xz, yz) = np.array(body.mass_center, dtype=float), body.inertia
        inertia = np.array(((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)), dtype=float)
        if not (np.isfinite(center).all() and np.isfinite(inertia).all()):
            raise ModelError(f"the body '{path}' has a mass centre or inertia that is not finite; give numbers")
        # OpenSim lets a body without mass have no inertia either.
        return MassProperties(mass, center, inertia if mass > np.finfo(float).eps else np.zeros((3, 3)))

    def _path(self, component: Component) -> str:
        path = self.tree.path_of(component)
        assert path is not None
        return path


def _last(path: str) -> str:
    return path.rsplit("/", 1)[1]
