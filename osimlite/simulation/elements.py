"""The forces of a model as engine-neutral force elements.

An element knows its bodies and coordinates by their place in the mechanism, and its constants in SI units. It can
write itself as code for a model (see :mod:`osimlite.simulation.field`) or be read as plain data by an engine with
compiled loops of its own; the law itself is in :mod:`osimlite.forces` in either case.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import inf, isfinite
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from osimlite.errors import ModelError, UnsupportedError
from osimlite.forces.coordinate_limit import limit_constants
from osimlite.forces.hunt_crossley import combine_materials
from osimlite.multibody.functions import Function
from osimlite.multibody.mechanism import FramePlacement, Mechanism
from osimlite.multibody.schema_functions import numeric
from osimlite.multibody.spatial import rotation_xyz
from osimlite.schema.base import Unknown
from osimlite.schema.contact import ContactEllipsoid, ContactGeometry, ContactHalfSpace, ContactSphere
from osimlite.schema.forces import CoordinateLimitForce, Force, HuntCrossleyForce
from osimlite.schema.frames import PhysicalFrame
from osimlite.schema.model import Model
from osimlite.text import listed

if TYPE_CHECKING:
    from osimlite.simulation.field import Writer

Triple = tuple[float, float, float]


class ForceElement(Protocol):
    """Anything that pushes bodies or coordinates."""

    @property
    def path(self) -> str:
        """Absolute path of the component."""

    @property
    def name(self) -> str:
        """Its name."""

    def write(self, writer: Writer) -> None:
        """Write the code that computes the force and adds it up."""

    @property
    def columns(self) -> tuple[str, ...]:
        """Labels of what :meth:`record` gives, as OpenSim's ForceReporter has them."""

    def record(self, values: Sequence[Any], origins: Sequence[Triple]) -> list[float]:
        """One row of the columns.

        Args:
            values: what the code kept in the element's places at one state; None where nothing was kept.
            origins: origin of each body in ground, m; ground's own last.
        """


@dataclass(frozen=True, slots=True)
class ContactSurface:
    """A half space, a sphere or an ellipsoid, fixed to a body (index, -1 for ground).

    Attributes:
        frame: name of the frame that holds it in the model.
        center: of the sphere, or a point on the plane, in the body frame (m).
        radius: of the sphere or the largest of the ellipsoid (m), infinite for a half space.
        normal: unit vector out of the half space, in the body frame.
        material: the law's K (Pa), c (s/m), us, ud (1), uv (s/m).
        radii: half axes of an ellipsoid (m), None for the others.
        axes: their directions in the body frame, as the columns of a matrix.
    """

    name: str
    body: int
    frame: str
    center: Triple
    radius: float
    normal: Triple
    material: tuple[float, float, float, float, float]
    radii: Triple | None = None
    axes: tuple[Triple, Triple, Triple] | None = None

    @property
    def is_half_space(self) -> bool:
        """Whether it is a half space."""
        return self.radius == inf


@dataclass(frozen=True, slots=True)
class ContactPair:
    """Two surfaces (places in the element) that may touch; of a half space and a sphere, the half space is first.

    k, a, c, us, ud, uv are the effective parameters of the law.
    """

    first: int
    second: int
    effective: tuple[float, float, float, float, float, float]


@dataclass(frozen=True)
class PairContact:
    """Contact of all surfaces of one force on different bodies, in pairs.

    Attributes:
        vt: transition velocity, m/s.
        early_return: reproduce Simbody's defect, see `osimlite.forces.hunt_crossley.contact_forces`.
        records: the surfaces in the order of OpenSim's record.
    """

    path: str
    name: str
    surfaces: tuple[ContactSurface, ...]
    pairs: tuple[ContactPair, ...]
    vt: float
    early_return: bool = False

    def write(self, writer: Writer) -> None:
        """Write the contacts."""
        from osimlite.simulation.contact_code import write_contacts

        write_contacts(self, writer)

    def pair_name(self, place: int) -> str:
        """What to call a pair: the force, and the surfaces if it has more than one pair."""
        if len(self.pairs) == 1:
            return self.name
        pair = self.pairs[place]
        return f"{self.name} ({self.surfaces[pair.second].name}, {self.surfaces[pair.first].name})"

    @property
    def columns(self) -> tuple[str, ...]:
        """Force and torque on the frame of each surface."""
        labels = [f"{kind}.{axis}" for kind in ("force", "torque") for axis in "XYZ"]
        return tuple(f"{self.name}.{surface.frame}.{label}" for surface in self.surfaces for label in labels)

    def record(self, values: Sequence[Any], origins: Sequence[Triple]) -> list[float]:
        """Total force on the body of each surface, and its torque about the body's origin, in ground."""
        loads: dict[int, list[float]] = {}
        for pair, value in zip(self.pairs, values, strict=True):
            if value is None:
                continue
            fx, fy, fz, px, py, pz = value[:6]
            for surface, sign in ((self.surfaces[pair.first], -1.0), (self.surfaces[pair.second], 1.0)):
                load = loads.setdefault(surface.body, [0.0] * 6)
                ox, oy, oz = origins[surface.body]
                x, y, z = px - ox, py - oy, pz - oz
                for axis, part in enumerate((fx, fy, fz, y * fz - z * fy, z * fx - x * fz, x * fy - y * fx)):
                    load[axis] += sign * part
        row: list[float] = []
        for surface in self.surfaces:
            row += loads.get(surface.body, [0.0] * 6)
        return row


@dataclass(frozen=True)
class HuntCrossley(PairContact):
    """One HuntCrossleyForce on half spaces and spheres."""


@dataclass(frozen=True)
class EllipsoidContact(PairContact):
    """One HuntCrossleyForce with ellipsoids among its surfaces, each of which may touch half spaces only."""


@dataclass(frozen=True)
class CoordinateLimit:
    """One CoordinateLimitForce; `constants` are Ku, qu, Kl, ql, D, t of the law."""

    path: str
    name: str
    coordinate: int
    constants: tuple[float, float, float, float, float, float]

    def write(self, writer: Writer) -> None:
        """Write the force on the coordinate."""
        q, u = writer.coordinate(self.coordinate)
        Ku, qu, Kl, ql, D, t = self.constants
        if isinstance(q, str):
            # The law is called beyond the limits only; where they are crossed (ql > qu), always.
            outside = f"if {q} > {qu!r} or {q} < {ql!r}:" if ql <= qu else "if True:"
            with writer.script.block(outside):
                value = writer.call("limit_force", q, u, Ku, qu, Kl, ql, D, t)
                writer.push_coordinate(self.coordinate, value)
                self._keep(writer, value, q)
        elif writer.reporting:
            self._keep(writer, writer.call("limit_force", q, 0.0, Ku, qu, Kl, ql, D, t), q)

    def _keep(self, writer: Writer, value: str, q: float | str) -> None:
        if writer.reporting:
            Ku, qu, Kl, ql, _, t = self.constants
            writer.keep(0, value, writer.call("limit_energy", q, Ku, qu, Kl, ql, t))

    @property
    def columns(self) -> tuple[str, ...]:
        """The generalized force, and the energy."""
        return self.name, f"{self.name}.PotentialEnergy"

    def record(self, values: Sequence[Any], origins: Sequence[Triple]) -> list[float]:
        """Generalized force (N or N·m) and potential energy (J)."""
        (value,) = values
        return [0.0, 0.0] if value is None else [value[0], value[-1]]


@dataclass(frozen=True)
class Forces:
    """The force elements of a model in its order, and the forces that were left out, as ``path (class)``."""

    elements: tuple[ForceElement, ...]
    skipped: tuple[str, ...] = ()


def force_elements(
    model: Model, mechanism: Mechanism, *, skip_unsupported: bool = False, simbody_early_return: bool = False
) -> Forces:
    """Gather the forces of a model.

    Forces whose `appliesForce` is false are no forces.

    Args:
        model: whose forces.
        mechanism: of the same model.
        skip_unsupported: leave out what cannot be computed instead of raising.
        simbody_early_return: reproduce Simbody's defect in contact of several surfaces.

    Raises:
        UnsupportedError: some forces cannot be computed; the message names them.
        ModelError: a force names what does not exist, or a parameter has no meaning.
    """
    builder = ElementBuilder(model, mechanism, simbody_early_return)
    elements: list[ForceElement] = []
    skipped: list[str] = []
    for component in builder.forces():
        try:
            elements.append(builder.element(component))
        except UnsupportedError as error:
            skipped.append(error.message)
    if skipped and not skip_unsupported:
        raise UnsupportedError(
            f"osimlite cannot compute {listed(skipped)}; switch off their appliesForce, "
            "or leave them out with --skip-unsupported (skip_unsupported=True)"
        )
    return Forces(tuple(elements), tuple(skipped))


class ElementBuilder:
    """Makes the elements of one model.

    Attributes:
        tree: of the model.
        mechanism: of the model.
    """

    def __init__(self, model: Model, mechanism: Mechanism, early_return: bool) -> None:
        self.model = model
        self.tree = model.tree()
        self.mechanism = mechanism
        self.early_return = early_return

    def forces(self) -> Iterator[Any]:
        """Yield everything that applies a force, known or not."""
        for component in self.tree.components:
            unknown = isinstance(component, Unknown) and self.tree.parent_of(component) is self.model.force_set
            if unknown or (isinstance(component, Force) and component.appliesForce):
                yield component

    def element(self, force: Any) -> ForceElement:
        """The element of a force; UnsupportedError, with its path and class for a message, if there is none."""
        if isinstance(force, HuntCrossleyForce):
            return self._hunt_crossley(force)
        if isinstance(force, CoordinateLimitForce):
            return self._coordinate_limit(force)
        from osimlite.simulation.more_elements import MAKERS

        maker = MAKERS.get(type(force))
        if maker is None:
            raise self.unsupported(force)
        return maker(self, force)

    # ---------------------------------------------------------------------------------- what makers ask for
    def coordinate(self, force: Any) -> int:
        """Place of the coordinate that a force names."""
        if not force.coordinate:
            raise ModelError(f"the force '{self.path(force)}' names no coordinate; give it one")
        return self.mechanism.coordinate_index(self.path(self.target(force, "coordinate", force.coordinate)))

    def target(self, holder: Any, field: str, value: Any) -> Any:
        """The component that a property refers to.

        Raises:
            ModelError: there is none.
        """
        if not value:
            raise ModelError(f"the '{field}' of '{self.path(holder)}' is empty; give it a name")
        found = self.tree.target(holder, field, value)
        if found is None:
            raise ModelError(
                f"the '{field}' of '{self.path(holder)}' names '{value}', which the model does not have; "
                "run 'osimlite validate'"
            )
        return found

    def placement(self, frame: Any) -> FramePlacement:
        """Body and place in it of a frame."""
        return self.mechanism.placement(self.path(frame))

    def function(self, force: Any, function: Any, what: str) -> Function:
        """A function of one number that belongs to a force.

        Raises:
            UnsupportedError: it is none that osimlite knows.
        """
        try:
            return numeric(function, 1, f"'{what}' of '{self.path(force)}'")
        except UnsupportedError:
            raise self.unsupported(force, f" with the {kind_of(function)} '{what}'") from None

    def _hunt_crossley(self, force: HuntCrossleyForce) -> PairContact:
        surfaces = []
        for parameters in force.contact_parameters.objects:
            material = (
                parameters.stiffness,
                parameters.dissipation,
                parameters.static_friction,
                parameters.dynamic_friction,
                parameters.viscous_friction,
            )
            for use in self._uses(parameters):
                found = self.tree.resolve(use)
                if found.target is None:
                    text = use.value if isinstance(use.value, str) else use.value.name
                    raise ModelError(
                        f"the force '{self.path(force)}' names the contact geometry '{text}', which the model "
                        "does not have; run 'osimlite validate'"
                    )
                surfaces.append(self.surface(force, found.target, material))
        self.check(force, (force.transition_velocity, *(x for surface in surfaces for x in surface.material)))
        pairs = []
        for first, second in combinations(range(len(surfaces)), 2):
            a, b = surfaces[first], surfaces[second]
            if a.body == b.body or (a.is_half_space and b.is_half_space):
                continue
            if b.is_half_space:
                first, second, a, b = second, first, b, a
            if not a.is_half_space and (a.radii or b.radii):
                raise self.unsupported(force, f" with an ellipsoid against a round surface, '{a.name}' and '{b.name}'")
            try:
                pairs.append(ContactPair(first, second, combine_materials(*a.material, *b.material)))
            except ValueError as error:
                raise ModelError(f"the force '{self.path(force)}': {error}") from None
        has_ellipsoid = any(surface.radii for surface in surfaces)
        if has_ellipsoid and self.early_return and len(pairs) > 1:
            raise self.unsupported(force, " with an ellipsoid, and Simbody's early return")
        kind = EllipsoidContact if has_ellipsoid else HuntCrossley
        return kind(
            self.path(force),
            force.name,
            tuple(surfaces),
            tuple(pairs),
            force.transition_velocity,
            self.early_return and len(pairs) > 1,
        )

    def _uses(self, parameters: Any) -> Iterator[Any]:
        from osimlite.schema.tree import Use

        spec = type(parameters).field_specs()["geometry"]
        for position, word in enumerate(parameters.geometry):
            yield Use(parameters, self.tree.owner_of(parameters), spec, word, position)

    def surface(self, force: Any, geometry: Any, material: tuple[float, float, float, float, float]) -> ContactSurface:
        """A contact geometry as the surface of a contact.

        Raises:
            UnsupportedError: it is no half space, sphere or ellipsoid, or not fixed to a body.
        """
        if not isinstance(geometry, ContactHalfSpace | ContactSphere | ContactEllipsoid):
            raise self.unsupported(force, f" on the {kind_of(geometry)} '{self.path(geometry)}'")
        frame = self._frame(geometry)
        body, placed = self.mechanism.placement(self.path(frame))
        center = placed[:3, :3] @ np.array(geometry.location) + placed[:3, 3]
        # The half space is x > 0 of the geometry's own frame.
        normal = -(placed[:3, :3] @ rotation_xyz(np.array(geometry.orientation)))[:, 0]
        if isinstance(geometry, ContactEllipsoid):
            axes = placed[:3, :3] @ rotation_xyz(np.array(geometry.orientation))
            self.check(geometry, (*center, *axes.ravel(), *geometry.radii))
            if not min(geometry.radii) > 0.0:
                raise ModelError(f"the radii of '{self.path(geometry)}' are not all positive; give such")
            place, still = triple(center), (0.0, 0.0, 0.0)
            rows = triple(axes[0]), triple(axes[1]), triple(axes[2])
            longest, radii = max(geometry.radii), triple(geometry.radii)
            return ContactSurface(geometry.name, body, frame.name, place, longest, still, material, radii, rows)
        radius = geometry.radius if isinstance(geometry, ContactSphere) else inf
        self.check(geometry, (*center, *normal, 0.0 if radius == inf else radius))
        return ContactSurface(geometry.name, body, frame.name, triple(center), radius, triple(normal), material)

    def _frame(self, geometry: ContactGeometry) -> PhysicalFrame:
        frame = self.tree.target(geometry, "socket_frame", geometry.socket_frame)
        if not isinstance(frame, PhysicalFrame):
            raise UnsupportedError(
                f"the contact geometry '{self.path(geometry)}' on the {kind_of(frame)} '{self.path(frame)}'"
            )
        return frame

    def _coordinate_limit(self, force: CoordinateLimitForce) -> CoordinateLimit:
        coordinate = self.tree.target(force, "coordinate", force.coordinate)
        place = self.mechanism.coordinate_index(self.path(coordinate))
        constants = limit_constants(
            force.upper_stiffness,
            force.upper_limit,
            force.lower_stiffness,
            force.lower_limit,
            force.damping,
            force.transition,
            self.mechanism.coordinates[place].motion_type == "rotational",
        )
        self.check(force, constants)
        return CoordinateLimit(self.path(force), force.name, place, constants)

    def check(self, component: Any, numbers: Sequence[float]) -> None:
        """Raise a ModelError if a number is not finite."""
        if not all(isfinite(number) for number in numbers):
            raise ModelError(f"'{self.path(component)}' has a parameter that is not a finite number; give one")

    def unsupported(self, force: Any, why: str = "") -> UnsupportedError:
        """The error that names a force that cannot be computed."""
        return UnsupportedError(f"'{self.path(force)}' ({kind_of(force)}{why})")

    def path(self, component: Any) -> str:
        """Absolute path of a component."""
        path = self.tree.path_of(component)
        assert path is not None
        return path


def kind_of(component: Any) -> str:
    """Name of a component's class."""
    return getattr(component, "class_name", "") or type(component).__name__


def triple(values: Any) -> Triple:
    """Three numbers."""
    x, y, z = (float(value) for value in values)
    return x, y, z
