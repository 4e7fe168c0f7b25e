"""The MJCF under construction: what every pass reads, and adds to."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from pathlib import Path
from typing import Literal, NamedTuple, TypeVar

import numpy as np
from lxml.etree import Element, SubElement, _Element

from osimlite.base.records import dataclass, field
from osimlite.base.text import make_unique_name
from osimlite.errors import ModelError, SimulationError, UnsupportedError
from osimlite.mechanics.multibody.functions import Function
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
from osimlite.simulation.robot.couplings import Line
from osimlite.simulation.robot.mesh_files import MeshFiles
from osimlite.simulation.robot.names import dotted_name, joint_names, xml_name
from osimlite.simulation.robot.robot import Link, Robot
from osimlite.simulation.robot.urdf import number, numbers
from osimlite.translate.fidelity import Fidelity

Version = Literal[3, 4]
Contact = Literal["native", "none"]
Fit = Literal["none", "wraps", "force"]
Spline = Literal["quartic", "series"]
Value = str | bool | int | float | Sequence[float] | Array | None
C = TypeVar("C", bound=Component)

SPECK_MASS_KG = 1e-3
"""Mass (kg) of a body that is there for a constraint alone.

MuJoCo makes a constraint the softer, the lighter the lighter one of its bodies; this is a
compromise.
"""


class Untranslatable(Exception):
    """Why a component is left out."""


@dataclass(frozen=True)
class Options:
    """What the user chooses."""

    version: Version = 4  # of MuJoCo, whose first number decides what a side site means
    visuals: bool = True  # whether to say what bodies look like
    # whether contact forces become contacts of MuJoCo's own law, or nothing
    contact: Contact = "native"
    # what is fitted: nothing, what tendons go around, or that and the forces of muscles
    fit: Fit = "none"
    # what a joint follows that is no polynomial: one quartic, or a quartic of a quartic
    spline: Spline = "series"
    # whether `osimlite.mjcf.Driver` moves the model, which computes functions and forces itself
    driver: bool = False


class Lead(NamedTuple):
    """A joint of the MJCF whose value (rad, m) is a straight line of a coordinate."""

    joint: str
    line: Line


class Follower(NamedTuple):
    """How a joint follows another: its value is the polynomial, constant first, of the leader's, or constant.

    Where that is fitted, or held, the driver has the `function` that it exactly is: of the leader,
    of several joints (`arguments`), or of time.
    """

    leader: str | None
    polynomial: tuple[float, ...]
    function: Function | None = None
    arguments: tuple[str, ...] = ()


class PathTendon(NamedTuple):
    """The tendon of a path, and its length (m) in the default pose, in random poses (P,), in others held out (R,)."""

    name: str
    default: float
    lengths: Array
    held_out: Array


NON_FINITE_WORDS = frozenset(("NaN", "Inf", "-Inf"))
"""How a number is printed that is none."""


def add_element(parent: _Element, tag: str, **attributes: Value) -> _Element:
    """Add an element; attributes that are None are left out, and ``class_`` stands for ``class``.

    Raises:
        UnsupportedError: a number is not finite, which MJCF cannot say.
    """
    said = {
        name.rstrip("_"): format_value(value)
        for name, value in attributes.items()
        if value is not None
    }
    for name, words in said.items():
        if NON_FINITE_WORDS.intersection(words.split()) and not isinstance(
            attributes.get(name), str
        ):
            raise UnsupportedError(
                f"MJCF cannot say a number that is not finite: {name} of the {tag} '{said.get('name', '')}' is {words}"
            )
    return SubElement(parent, tag, said)


@dataclass
class Draft:
    """A model on its way to MJCF."""

    model: Model  # the model
    robot: Robot  # its mechanism as one-axis joints; locked coordinates are fixed joints
    # the account; a pass puts components into `translated`, and what is lost into records
    fidelity: Fidelity
    options: Options  # what the user chooses
    folder: Path | None  # where the model's file is, and the files that it names
    mesh_files: MeshFiles  # takes up the mesh files that the text names
    root: _Element = field(default_factory=lambda: Element("mujoco"))  # the element `<mujoco>`
    # the element of each body by its index in the mechanism, of ground (-1) too. Its frame is the
    # body's.
    bodies: dict[int, _Element] = field(default_factory=dict)
    # element and frame (4, 4) in it of those links of the robot that stand still in an element, by
    # name
    frames: dict[str, tuple[_Element, Array]] = field(default_factory=dict)
    # the joint that stands for a coordinate, by the coordinate's place in the mechanism; none if it
    # is locked
    leads: dict[int, Lead] = field(default_factory=dict)
    # what equality constraints make of joints, by name
    followers: dict[str, Follower] = field(default_factory=dict)
    # those of them that move nothing, but are what others follow
    helpers: set[str] = field(default_factory=set)
    # of paths, by the absolute path of their owners
    tendons: dict[str, PathTendon] = field(default_factory=dict)
    activations: dict[str, float] = field(
        default_factory=dict
    )  # at the start, of the actuators that have one, by name
    # values (rad, m) in the default pose of joints that a pass has added besides those of the
    # robot, by name
    starts: dict[str, float] = field(default_factory=dict)
    start_note: str = ""  # where simulations have to start, if that is not everywhere
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
        """The components of the model, and where they are."""
        return self.model.tree()

    @cached_property
    def default_state(self) -> tuple[Array, Array]:
        """Values (n,) and speeds (n,) of the coordinates in the default pose, which fulfil the constraints.

        Where no pose near the model's own does, the model's own.
        """
        try:
            return self.mechanism.default_state()
        except SimulationError:
            self.fidelity.add(
                "default-pose",
                "/",
                "a default pose near none that fulfils the constraints",
                "as it is",
            )
            return self.mechanism.values({}), self.mechanism.speeds({})

    def iterate_components(self, kind: type[C]) -> Iterator[tuple[C, str]]:
        """Components of a class that no pass has spoken of yet, with their absolute paths."""
        spoken_of = self.fidelity.translated.keys() | {
            record.component for record in self.fidelity.records
        }
        for component in self.tree.components:
            if (
                isinstance(component, kind)
                and (path := self.tree.path_of(component) or "") not in spoken_of
            ):
                yield component, path

    def record_result(self, path: str, became: str) -> None:
        """Say what a component and all below it became, but for what is spoken of already."""
        for each in self.tree.by_path:
            if each == path or each.startswith(f"{path}/"):
                self.fidelity.translated.setdefault(each, became)

    def get_section(self, tag: str) -> _Element:
        """The part of the file with this tag: ``tendon``, ``actuator``, ``equality`` ..."""
        result = self.root.find(tag)
        return add_element(self.root, tag) if result is None else result

    def make_name(self, kind: str, path: str) -> str:
        """A name for a component, unlike any other of this kind: its own, or its path with dots where that is taken.

        Args:
            kind: MuJoCo's name space: ``geom``, ``site``, ``tendon``, ``actuator``, ``equality``
                ...
            path: absolute path of the component, or any name.
        """
        taken = self._names.setdefault(kind, set())
        own = path.rsplit("/", 1)[-1]
        whole = xml_name(dotted_name(path))
        name = xml_name(own or whole)
        if name in taken:
            name = whole if whole not in taken else make_unique_name(whole, taken, first=2)
        taken.add(name)
        if path in self.tree.by_path:
            self.fidelity.note_name(path, kind, own, name)
        return name

    def find_placement(self, owner: Component, socket: str) -> FramePlacement:
        """The frame that a socket of a component names: index of its body, and transform (4, 4) in that.

        Raises:
            ModelError: there is no such frame, or it is not fixed to a body.
        """
        value = getattr(owner, socket)
        if not value:
            raise ModelError(f"its {socket} names no frame")
        path = self.tree.path_of(self.tree.target(owner, socket, value)) or ""
        if path not in self.mechanism.frames:
            raise ModelError(f"the frame '{path}' is not fixed to a body")
        return self.mechanism.frames[path]

    def add_site(self, path: str, body: int, place: Array, **attributes: Value) -> str:
        """Add a site to a body (-1: ground).

        Args:
            path: of the component that it stands for, from which it has its name.
            body: index in the mechanism.
            place: in the frame of the body, location (3,) in m or transform (4, 4).
            **attributes: more of the element's.

        Returns:
            Its name.
        """
        name = self.make_name("site", path)
        frame = format_pose(place) if place.shape == (4, 4) else {"pos": clear_rounding(place)}
        add_element(self.bodies[body], "site", name=name, **frame, **attributes)
        return name

    def find_tendon(self, path: str) -> PathTendon:
        """The tendon of the path of a force.

        Raises:
            Unsayable: it became none.
        """
        if path not in self.tendons:
            raise Untranslatable("its path is no tendon")
        return self.tendons[path]

    def add_follower(self, joint: str, follower: Follower) -> None:
        """Let a joint follow another, or keep it at a value."""
        self.followers[joint] = follower
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
        """Add a small body, which nothing weighs down, at a frame (4, 4) in an element; `inertia` is in kg·m²."""
        speck = add_element(
            element,
            "body",
            name=self.make_name("body", f"{name}_speck"),
            gravcomp=1,
            **format_pose(frame),
        )
        add_element(
            speck, "inertial", pos=np.zeros(3), mass=SPECK_MASS_KG, diaginertia=np.full(3, inertia)
        )
        return speck

    def locate_at_zero(self, station: StationPlacement) -> Array:
        """Where a station is in ground (3,) when all joints stand at zero, as MuJoCo has it before a pose is set."""
        body, location = station
        link, _ = self.robot.link_of[
            "/ground" if body == GROUND else self.mechanism.bodies[body].path
        ]
        return self._transforms_at_zero[link.name][:3] @ np.append(location, 1.0)

    @cached_property
    def _transforms_at_zero(self) -> dict[str, Array]:
        placed = {self.robot.links[0].name: np.eye(4)}
        for joint in self.robot.joints:
            placed[joint.child] = placed[joint.parent] @ joint.across(0.0)
        return placed

    def add_mesh(self, file: str, scale: tuple[float, float, float]) -> str:
        """The asset that is a mesh file at a scale.

        Its inertia is said to be that of its surface: MuJoCo refuses bones whose surface does not
        close otherwise.
        """
        key = (file, scale)
        if key not in self._meshes:
            name = self._meshes[key] = self.make_name("mesh", Path(file).stem)
            size = None if scale == (1.0, 1.0, 1.0) else scale
            add_element(
                self.get_section("asset"), "mesh", name=name, file=file, scale=size, inertia="shell"
            )
        return self._meshes[key]

    def iterate_links(self) -> Iterator[tuple[Link, _Element]]:
        """Links that are bodies (or ground), with their elements."""
        for index, path in enumerate(
            ["/ground", *(body.path for body in self.mechanism.bodies)], GROUND
        ):
            yield self.robot.link_of[path][0], self.bodies[index]

    def get_body_name(self, body: int) -> str:
        """Name of the element of a body (-1: ground)."""
        return "world" if body == GROUND else self.bodies[body].get("name", "")


def format_pose(matrix: Array) -> dict[str, Value]:
    """The attributes that place a frame (4, 4) in that of its parent; None where it is not moved, or not turned."""
    place, turned = clear_rounding(matrix[:3, 3]), clear_rounding(quaternion_of(matrix[:3, :3]))
    return {"pos": place if place.any() else None, "quat": turned if turned[1:].any() else None}


def clear_rounding(values: Array) -> Array:
    """The numbers with zeros for those that are zero but for rounding, which nobody wants to read."""
    return np.where(np.abs(values) < 1e-16, 0.0, values)


def format_value(value: str | bool | int | float | Sequence[float] | Array) -> str:
    """An attribute as MuJoCo reads it; numbers in the shortest form that reads back equal."""
    match value:
        case str():
            return value
        case bool():
            return "true" if value else "false"
        case int() | float():
            return number(value)
    return numbers(value)
