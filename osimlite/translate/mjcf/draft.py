"""MJCF under construction, which every pass reads and extends."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import cached_property
from pathlib import Path
from typing import Literal, TypeVar

import numpy as np
from lxml.etree import Element, SubElement, _Element

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import dataclass, field
from osimlite.base.text import make_unique_name
from osimlite.errors import ModelError, SimulationError, UnsupportedError
from osimlite.mechanics.multibody.functions import SmoothFunction
from osimlite.mechanics.multibody.mechanism import (
    GROUND,
    FramePlacement,
    Mechanism,
    StationPlacement,
)
from osimlite.mechanics.multibody.spatial import Array, quaternion_of
from osimlite.schema.base import Component
from osimlite.schema.model import Model
from osimlite.schema.tree import Tree
from osimlite.simulation.robot.couplings import StraightLine
from osimlite.simulation.robot.mesh_files import MeshFiles
from osimlite.simulation.robot.names import joint_names, to_dotted_name, xml_name
from osimlite.simulation.robot.robot import Robot, RobotLink
from osimlite.simulation.robot.urdf import number, numbers
from osimlite.translate.fidelity import Fidelity

Version = Literal[3, 4]
"""Major version of MuJoCo."""
Contact = Literal["native", "none"]
"""Treatment of contact: MuJoCo's own law, or no contact."""
Fit = Literal["none", "wraps", "force"]
"""Fitted parts of the model: none, wrap geoms of tendons, or also the forces of muscles."""
Spline = Literal["quartic", "series"]
"""Form of fitted functions: a quartic, or two in series (one applied to the result of the other)."""
Value = str | bool | int | float | Sequence[float] | Array | None
"""Value of an attribute; None leaves the attribute out."""
C = TypeVar("C", bound=Component)

MIN_MESH_CORNERS = 4
"""Fewest different corners of a mesh that MuJoCo accepts, also for one that is only drawn."""

MIN_MESH_AREA_M2 = 1e-14
"""Least area of a mesh that is written (m²): MuJoCo requires 1e-15, and computes with rounded corners."""

SPECK_MASS_KG = 1e-3
"""Mass (kg) of a body that exists for a constraint only.

MuJoCo makes a constraint softer the lighter the lighter one of its bodies is, and a heavier body
would change the motion; this is a compromise.
"""


class Untranslatable(Exception):
    """Reason for which a component is left out."""


@dataclass(frozen=True)
class MjcfOptions:
    """Options of a translation.

    Attributes:
        version: major version of MuJoCo, which decides what a side site means.
        visuals: whether to write the shapes with which bodies are drawn.
        contact: "native" for contacts of MuJoCo's law, "none" for no contact.
        fit: "none", "wraps" for fitted wrap geoms of tendons, "force" for fitted muscle forces,
            too.
        spline: "quartic" to approximate functions by one quartic, "series" by a quartic of a
            quartic.
        driver: whether `osimlite.mjcf.Driver` moves the model, which computes functions and forces
            itself.
    """

    version: Version = 4
    visuals: bool = True
    contact: Contact = "native"
    fit: Fit = "none"
    spline: Spline = "series"
    driver: bool = False


class Lead(NamedTuple):
    """Joint of the MJCF whose value is a linear function of a coordinate.

    Attributes:
        joint: name of the joint.
        line: slope and start of the function from the coordinate to the joint (rad or m).
    """

    joint: str
    line: StraightLine


class Follower(NamedTuple):
    """Dependence of a joint on another one, on several, or on time.

    Attributes:
        leader: name of the joint that is followed; None for a constant.
        polynomial: coefficients of the value of the joint as a function of the leader's, constant
            first.
        function: exact function where the polynomial is fitted or holds the joint; only the driver
            uses it.
        arguments: names of the joints that the function depends on, if there are several.
    """

    leader: str | None
    polynomial: tuple[float, ...]
    function: SmoothFunction | None = None
    arguments: tuple[str, ...] = ()


class PathTendon(NamedTuple):
    """Tendon of a path.

    Attributes:
        name: name of the tendon.
        default: length of the path in the default pose (m).
        lengths: lengths of the path in the poses for fits (P,) (m).
        held_out: lengths of the path in the poses for tests (R,) (m).
    """

    name: str
    default: float
    lengths: Array
    held_out: Array


NON_FINITE_WORDS = frozenset(("NaN", "Inf", "-Inf"))
"""Texts of numbers that are not finite."""


def add_element(parent: _Element, tag: str, **attributes: Value) -> _Element:
    """Add an element; `class_` means `class`, and None leaves an attribute out.

    Args:
        parent: element to which it is added.
        tag: tag of the element.
        attributes: attributes of the element.

    Returns:
        The new element.

    Raises:
        UnsupportedError: a number is not finite, which MJCF cannot express.
    """
    texts = {
        name.rstrip("_"): format_value(value)
        for name, value in attributes.items()
        if value is not None
    }
    # A text may well be "NaN"; a number of that kind would end MuJoCo's reader.
    for name, text in texts.items():
        if NON_FINITE_WORDS.intersection(text.split()) and not isinstance(
            attributes.get(name), str
        ):
            raise UnsupportedError(
                f"MJCF cannot contain a number that is not finite: {name} of the {tag} '{texts.get('name', '')}' is {text}"
            )
    return SubElement(parent, tag, texts)


@dataclass
class MjcfDraft:
    """MJCF under construction.

    Attributes:
        model: model that is translated.
        robot: mechanism of the model with one-axis joints; locked coordinates are fixed joints.
        fidelity: account, to which passes add what components become and what is lost.
        options: options of the translation.
        folder: folder of the model file and of the files that it names.
        mesh_files: collection of the mesh files that the text names.
        root: element `<mujoco>`.
        bodies: element of each body by its index in the mechanism, -1 for ground; its frame is the
            body's.
        frames: element in which a link of the robot is fixed, and the frame (4, 4) of the link in
            it, by name of the link.
        leads: joint of a coordinate by the index of the coordinate; a locked coordinate has none.
        followers: dependence of joints that equalities move, by name.
        helpers: names of the joints among `followers` that move nothing, but that others follow.
        tendons: tendons of paths by the absolute path of their owners.
        activations: initial activations of actuators by name.
        starts: values (rad or m) in the default pose of joints that passes have added to those of
            the robot, by name.
        start_note: advice where simulations must start, or "".
    """

    model: Model
    robot: Robot
    fidelity: Fidelity
    options: MjcfOptions
    folder: Path | None
    mesh_files: MeshFiles
    root: _Element = field(default_factory=lambda: Element("mujoco"))
    bodies: dict[int, _Element] = field(default_factory=dict)
    frames: dict[str, tuple[_Element, Array]] = field(default_factory=dict)
    leads: dict[int, Lead] = field(default_factory=dict)
    followers: dict[str, Follower] = field(default_factory=dict)
    helpers: set[str] = field(default_factory=set)
    tendons: dict[str, PathTendon] = field(default_factory=dict)
    activations: dict[str, float] = field(default_factory=dict)
    starts: dict[str, float] = field(default_factory=dict)
    start_note: str = ""
    _names: dict[str, set[str | None]] = field(default_factory=dict)
    _meshes: dict[tuple[str, tuple[float, float, float]], str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        # Bodies and joints of the robot have names already, which no other may take.
        self._names["body"] = {link.name for link in self.robot.links}
        self._names["joint"] = {
            *joint_names(self.mechanism),
            *(joint.name for joint in self.robot.joints),
        }

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism of the model."""
        return self.robot.mechanism

    @cached_property
    def tree(self) -> Tree:
        """Components of the model with their paths."""
        return self.model.tree()

    @cached_property
    def default_state(self) -> tuple[Array, Array]:
        """Values (n,) and speeds (n,) in the default pose, which fulfil the constraints.

        If no pose near the model's own fulfils them, it is the model's own.

        Returns:
            Values (rad or m) and speeds (rad/s or m/s).
        """
        try:
            return self.mechanism.default_state()
        # A model that cannot be assembled is still worth translating.
        except SimulationError:
            self.fidelity.add(
                "default-pose",
                "/",
                "a default pose that violates the constraints, without an allowed pose near it",
                "the pose of the model, with the constraints violated",
            )
            return self.mechanism.values({}), self.mechanism.speeds({})

    def iterate_components(self, component_class: type[C]) -> Iterator[tuple[C, str]]:
        """Yield the components of a class that are not accounted for, with their paths."""
        recorded = self.fidelity.translated.keys() | {
            record.component for record in self.fidelity.records
        }
        for component in self.tree.components:
            if (
                isinstance(component, component_class)
                and (path := self.tree.path_of(component) or "") not in recorded
            ):
                yield component, path

    def record_result(self, path: str, result: str) -> None:
        """Record what a component and all components below it became.

        Components that are accounted for keep their entry.

        Args:
            path: absolute path of the component.
            result: kind and name of the element.
        """
        # Components below become what their owner becomes, unless they have their own entry.
        for other_path in self.tree.by_path:
            if other_path == path or other_path.startswith(f"{path}/"):
                self.fidelity.translated.setdefault(other_path, result)

    def get_section(self, tag: str) -> _Element:
        """Return the section of the file with a tag, such as `tendon`, `actuator` or `equality`."""
        result = self.root.find(tag)
        return add_element(self.root, tag) if result is None else result

    def make_name(self, kind: str, path: str) -> str:
        """Return an unused name for a component: its own, or its path with dots if that is taken.

        Args:
            kind: name space of MuJoCo: `geom`, `site`, `tendon`, `actuator`, `equality` ...
            path: absolute path of the component, or any name.
        """
        used_names = self._names.setdefault(kind, set())
        component_name = path.rsplit("/", 1)[-1]
        dotted_name = xml_name(to_dotted_name(path))
        name = xml_name(component_name or dotted_name)
        # The short name if it is free: users look for it.
        if name in used_names:
            # The path is unique in the model, but another pass may have used it.
            name = (
                dotted_name
                if dotted_name not in used_names
                else make_unique_name(dotted_name, used_names, first_number=2)
            )
        used_names.add(name)
        # Only components have a name of their own to compare with.
        if path in self.tree.by_path:
            self.fidelity.note_name(path, kind, component_name, name)
        return name

    def find_placement(self, owner: Component, socket: str) -> FramePlacement:
        """Return the frame of a socket: index of its body, and transform (4, 4) in the body.

        Args:
            owner: component with the socket.
            socket: name of the socket.

        Raises:
            ModelError: the frame does not exist, or is not fixed to a body.
        """
        value = getattr(owner, socket)
        if not value:
            raise ModelError(f"its {socket} names no frame")
        path = self.tree.path_of(self.tree.target(owner, socket, value)) or ""
        if path not in self.mechanism.frames:
            raise ModelError(f"the frame '{path}' is not fixed to a body")
        return self.mechanism.frames[path]

    def add_site(self, path: str, body: int, position: Array, **attributes: Value) -> str:
        """Add a site to a body.

        Args:
            path: path of the component after which it is named.
            body: index of the body, -1 for ground.
            position: position (3,) (m) or transform (4, 4) in the body.
            **attributes: further attributes.

        Returns:
            Name of the site.
        """
        name = self.make_name("site", path)
        frame = (
            format_pose(position) if position.shape == (4, 4) else {"pos": clear_rounding(position)}
        )
        add_element(self.bodies[body], "site", name=name, **frame, **attributes)
        return name

    def find_tendon(self, path: str) -> PathTendon:
        """Return the tendon of the path of a force.

        Raises:
            Untranslatable: the path has no tendon.
        """
        if path not in self.tendons:
            raise Untranslatable("its path is not a tendon")
        return self.tendons[path]

    def add_follower(self, joint: str, follower: Follower) -> None:
        """Add an equality by which a joint follows another or keeps a value.

        Args:
            joint: name of the joint.
            follower: dependence of the joint on its leader.
        """
        self.followers[joint] = follower
        # MuJoCo's equality has a quartic with five coefficients.
        coefficients = np.zeros(5)
        coefficients[: len(follower.polynomial)] = follower.polynomial
        name = self.make_name("equality", joint)
        add_element(
            self.get_section("equality"),
            "joint",
            name=name,
            joint1=joint,
            joint2=follower.leader,
            polycoef=coefficients,
        )

    def add_speck(
        self,
        name: str,
        element: _Element,
        frame: Array,
        inertia: float = SPECK_MASS_KG * SPECK_MASS_KG,
    ) -> _Element:
        """Add a small body without weight, which a constraint needs.

        Args:
            name: name of the component that needs it.
            element: element to which it is added.
            frame: frame in the element (4, 4).
            inertia: principal moments (kg·m²).

        Returns:
            Element of the new body.
        """
        speck = add_element(
            element,
            "body",
            name=self.make_name("body", f"{name}_speck"),
            # MuJoCo cancels the weight of the body.
            gravcomp=1,
            **format_pose(frame),
        )
        add_element(
            speck, "inertial", pos=np.zeros(3), mass=SPECK_MASS_KG, diaginertia=np.full(3, inertia)
        )
        return speck

    def locate_at_zero(self, station: StationPlacement) -> Array:
        """Return the position of a station in ground (3,) with all joints at zero.

        This is MuJoCo's reference pose.
        """
        body, location = station
        link, _ = self.robot.link_of[
            "/ground" if body == GROUND else self.mechanism.bodies[body].path
        ]
        return self._transforms_at_zero[link.name][:3] @ np.append(location, 1.0)

    @cached_property
    def _transforms_at_zero(self) -> dict[str, Array]:
        """Transforms (4, 4) of all links in ground by name, with all joints at zero."""
        transforms = {self.robot.links[0].name: np.eye(4)}
        for joint in self.robot.joints:
            transforms[joint.child] = transforms[joint.parent] @ joint.compute_transform(0.0)
        return transforms

    def add_mesh(self, file: str, scale: tuple[float, float, float]) -> str:
        """Return the asset of a mesh file at a scale, which is added if it is new.

        Its inertia is declared to be that of its surface: otherwise MuJoCo rejects meshes with open
        surfaces.

        Args:
            file: name of the mesh file.
            scale: scale along x, y and z.

        Raises:
            Untranslatable: MuJoCo rejects such a mesh.
        """
        key = (file, scale)
        if key not in self._meshes:
            _require_area(self.mesh_files.corners[file] * np.array(scale))
            name = self._meshes[key] = self.make_name("mesh", Path(file).stem)
            size = None if scale == (1.0, 1.0, 1.0) else scale
            add_element(
                self.get_section("asset"), "mesh", name=name, file=file, scale=size, inertia="shell"
            )
        return self._meshes[key]

    def iterate_links(self) -> Iterator[tuple[RobotLink, _Element]]:
        """Yield the links that are bodies or ground, with their elements."""
        for index, path in enumerate(
            ["/ground", *(body.path for body in self.mechanism.bodies)], GROUND
        ):
            yield self.robot.link_of[path][0], self.bodies[index]


def format_pose(matrix: Array) -> dict[str, Value]:
    """Return the attributes that place a frame in its parent.

    Args:
        matrix: transform (4, 4).

    Returns:
        "pos" and "quat"; None for no translation or rotation.
    """
    # Without attributes for the identity, the file shows only what differs from it.
    position = clear_rounding(matrix[:3, 3])
    quaternion = clear_rounding(quaternion_of(matrix[:3, :3]))
    return {
        "pos": position if position.any() else None,
        "quat": quaternion if quaternion[1:].any() else None,
    }


def _require_area(corners: Array) -> None:
    """Check that MuJoCo accepts a mesh.

    Args:
        corners: corners (t, 3, 3) of its triangles, m.

    Raises:
        Untranslatable: it has too few corners, or no area.
    """
    corner_count = len(np.unique(corners.reshape(-1, 3), axis=0))
    if corner_count < MIN_MESH_CORNERS:
        raise Untranslatable(
            f"MuJoCo rejects meshes of fewer than {MIN_MESH_CORNERS} different corners "
            f"({corner_count} here)"
        )
    first_edges = corners[:, 1] - corners[:, 0]
    second_edges = corners[:, 2] - corners[:, 0]
    area = 0.5 * float(np.linalg.norm(np.cross(first_edges, second_edges), axis=1).sum())
    if area < MIN_MESH_AREA_M2:
        raise Untranslatable(
            f"MuJoCo rejects meshes of less than {MIN_MESH_AREA_M2:g} m^2 ({area:g} m^2 here)"
        )


def clear_rounding(values: Array) -> Array:
    """Return numbers in which rounding errors around 0 are 0, so that the file is easy to read."""
    return np.where(np.abs(values) < 1e-16, 0.0, values)


def format_spring_length(low: float, high: float) -> str:
    """Return the lengths of a tendon between which its spring is slack, as text.

    Args:
        low: lower end, m or rad.
        high: upper end, m or rad; MuJoCo rejects one below `low`, which is lowered to it.
    """
    low = min(low, high)
    # For MuJoCo two times -1 means the length in its default pose.
    if low == high == -1.0:
        high = math.nextafter(-1.0, 0.0)
    return format_value((low, high))


def format_value(value: str | bool | int | float | Sequence[float] | Array) -> str:
    """Return an attribute as text; numbers have the shortest form that reads back equal."""
    match value:
        case str():
            return value
        # Before the numbers, because True is an int in Python.
        case bool():
            return "true" if value else "false"
        case int() | float():
            return number(value)
    return numbers(value)
