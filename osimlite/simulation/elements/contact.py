"""Contact between half spaces, spheres and ellipsoids by the law of Hunt and Crossley, in pairs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from itertools import combinations
from math import inf
from typing import TYPE_CHECKING, Any, ClassVar

from osimlite.base.records import dataclass
from osimlite.errors import ModelError, UnsupportedError
from osimlite.mechanics.kernels.layout import CONTACT_WORK, ITEM
from osimlite.mechanics.laws.hunt_crossley import combine_materials, contact_energy
from osimlite.mechanics.laws.vectors import cross, minus, plus, vector
from osimlite.mechanics.multibody.links import LinkMap
from osimlite.mechanics.multibody.spatial import Array, make_offset
from osimlite.schema.contact import ContactGeometry
from osimlite.schema.forces import HuntCrossleyForce
from osimlite.schema.frames import PhysicalFrame
from osimlite.schema.tree import Use, is_a
from osimlite.simulation.elements.builder import ElementBuilder, Triple, get_class_name, to_triple
from osimlite.simulation.elements.force_records import ForceRecord, Response
from osimlite.simulation.elements.registry import register_force_type
from osimlite.simulation.states import StateVariable

if TYPE_CHECKING:
    from osimlite.simulation.elements.triangle_mesh import TriangleMesh

RESPONSE = "contact_response"
"""Kernel that computes derivatives of a contact force along the normal and across it."""

Material = tuple[float, float, float, float, float]
"""Stiffness (Pa), dissipation (s/m), and static, dynamic (1) and viscous (s/m) friction, as in the model."""


@dataclass(frozen=True, slots=True)
class ContactSurface:
    """Half space, sphere, ellipsoid or mesh that is fixed to a body.

    Attributes:
        name: name of the contact geometry.
        body: index of the body, -1 for ground.
        frame: name of the frame that the model fixes it to.
        center: center of the sphere, or a point on the plane, in the body frame (m).
        radius: radius of the sphere, largest half axis of the ellipsoid, or radius of the ball
            around the mesh (m); infinite for a half space.
        normal: outward unit normal of the half space, in the body frame.
        material: the law's K (Pa), c (s/m), us, ud (1), uv (s/m).
        radii: half axes of an ellipsoid (m); None for other surfaces.
        axes: directions of the half axes in the body frame, as columns of a matrix.
        mesh: the triangles of a mesh, in the body frame.
    """

    name: str
    body: int
    frame: str
    center: Triple
    radius: float
    normal: Triple
    material: Material
    radii: Triple | None = None
    axes: tuple[Triple, Triple, Triple] | None = None
    mesh: TriangleMesh | None = None

    @property
    def is_half_space(self) -> bool:
        """Flag: the surface is a half space."""
        return self.radius == inf


@dataclass(frozen=True, slots=True)
class ContactPair:
    """Two surfaces that may touch.

    Attributes:
        first: index of surface 1 in the element; a half space comes before a sphere.
        second: index of surface 2.
        effective: combined parameters k, a, c, us, ud, uv of the law.
    """

    first: int
    second: int
    effective: tuple[float, float, float, float, float, float]


@dataclass(frozen=True)
class PairContact:
    """Contact of all surfaces of one force that are on different bodies, in pairs.

    Attributes:
        path: path of the component.
        name: name of the component.
        surfaces: surfaces in the order of OpenSim's report.
        pairs: pairs that may touch.
        vt: transition velocity, m/s.
        early_return: whether to reproduce Simbody's defect, see
            `osimlite.mechanics.kernels.ellipsoid_contacts.early_return`.
    """

    states: ClassVar[tuple[StateVariable, ...]] = ()

    path: str
    name: str
    surfaces: tuple[ContactSurface, ...]
    pairs: tuple[ContactPair, ...]
    vt: float
    early_return: bool = False

    def make_records(self, link_map: LinkMap) -> list[ForceRecord]:
        """Return the records that the kernels compute.

        Args:
            link_map: placement of the bodies in the links of the tree.

        Returns:
            A record for each pair. With Simbody's early return, the forces depend on one another,
            and one more record computes all pairs in order; else there are records for derivatives.
        """
        result = []
        for pair in self.pairs:
            one = self.surfaces[pair.first]
            two = self.surfaces[pair.second]
            links, numbers = self.pack_pair(pair, link_map)
            kernel = "touch_half_space" if one.is_half_space else "touch_spheres"
            if one.radii or two.radii:
                kernel = "touch_ellipsoid" if one.is_half_space else "touch_ellipsoids"
                shapes = (surface for surface in (one, two) if not surface.is_half_space)
                numbers = (
                    *numbers,
                    *(x for surface in shapes for x in _pack_shape(surface, link_map)),
                )
            result.append(
                ForceRecord(kernel, links, numbers, is_contact=True, is_part=self.early_return)
            )
        if self.early_return:
            result.append(self._make_early_return(link_map))
        else:
            result += self._make_responses()
        return result

    def _make_responses(self) -> list[ForceRecord]:
        """Return records for derivatives of the force of each pair, along three axes.

        Implicit integrators use them. Pairs with ellipsoids have none; the integrators then omit
        these terms of the Jacobian.
        """
        # A response finds the record of its pair by the number of integers between them: those of
        # the pairs (two links each) and of the responses so far.
        result = []
        back = (ITEM.DETAILS + 2) * len(self.pairs)
        for pair in self.pairs:
            one = self.surfaces[pair.first]
            two = self.surfaces[pair.second]
            if not (one.radii or two.radii):
                for axis in range(3):
                    ints = back, axis, int(one.is_half_space)
                    result.append(
                        ForceRecord(ints=ints, is_part=True, response=Response(RESPONSE, 0, 0, 1))
                    )
                    back += ITEM.DETAILS + len(ints)
            # The next pair's record begins that much later.
            back -= ITEM.DETAILS + 2
        return result

    def pack_pair(
        self, pair: ContactPair, link_map: LinkMap
    ) -> tuple[tuple[int, int], tuple[float, ...]]:
        """Return links and numbers of a pair.

        Args:
            pair: the pair.
            link_map: placement of the bodies in the links of the tree.

        Returns:
            The links of both surfaces, and the numbers of the kernel.
        """
        one = self.surfaces[pair.first]
        two = self.surfaces[pair.second]
        first, center = link_map.station(one.body, one.center)
        second, other = link_map.station(two.body, two.center)
        normal = link_map.direction(one.body, one.normal)
        # An infinite radius would give NaN in the kernels' products with zero.
        radius = 0.0 if one.is_half_space else one.radius
        return (first, second), (
            *center,
            *normal,
            radius,
            *other,
            two.radius,
            *pair.effective,
            self.vt,
        )

    def _make_early_return(self, link_map: LinkMap) -> ForceRecord:
        """Return the record that computes the pairs one by one in Simbody's order.

        Args:
            link_map: placement of the bodies in the links of the tree.
        """
        stations = [link_map.station(surface.body, surface.center) for surface in self.surfaces]
        links = (link for link, _ in stations)
        pairs = (index for pair in self.pairs for index in (pair.first, pair.second))
        numbers = (
            x
            for (_, center), surface in zip(stations, self.surfaces, strict=True)
            for x in (*center, surface.radius)
        )
        ints = len(stations), len(self.pairs), *links, *pairs
        return ForceRecord("early_return", ints, tuple(numbers), record_size=5 * len(stations))

    def pair_name(self, index: int) -> str:
        """Return the name of a pair.

        Args:
            index: index of the pair.

        Returns:
            The name of the force, with the surfaces if the force has several pairs.
        """
        if len(self.pairs) == 1:
            return self.name
        pair = self.pairs[index]
        return f"{self.name} ({self.surfaces[pair.second].name}, {self.surfaces[pair.first].name})"

    @property
    def columns(self) -> tuple[str, ...]:
        """Labels of force and torque on the frame of each surface, as in OpenSim.

        Returns:
            Six labels for each surface.
        """
        labels = [f"{kind}.{axis}" for kind in ("force", "torque") for axis in "XYZ"]
        return tuple(
            f"{self.name}.{surface.frame}.{label}" for surface in self.surfaces for label in labels
        )

    def find_copied_offsets(self) -> None:
        """Return None, since the report adds up the loads of pairs."""

    def report(
        self, records: Sequence[Sequence[float]], origins: Sequence[Sequence[float]]
    ) -> list[float]:
        """Return one row of the columns.

        The contact force acts on surface 2 and, with the opposite sign, on surface 1.

        Args:
            records: output records of the pairs after an evaluation.
            origins: origin of each body in ground, m; the last one is that of ground.

        Returns:
            Force (N) on the body of each surface, and torque (N m) about the body's origin, in
            ground. Surfaces on one body have the same load.
        """
        loads: dict[int, list[float]] = {}
        for pair, record in zip(self.pairs, records, strict=False):
            # `not >` also leaves out a depth of NaN.
            if not record[CONTACT_WORK.DEPTH] > 0.0:
                continue
            # The record holds the load on the second surface; the first one has the opposite.
            force = vector(record, 0)
            torque = vector(self.find_torque(records, pair), 0)
            for surface, sign in (
                (self.surfaces[pair.first], -1.0),
                (self.surfaces[pair.second], 1.0),
            ):
                load = loads.setdefault(surface.body, [0.0] * 6)
                moment = cross(minus(vector(record, 3), vector(origins[surface.body], 0)), force)
                for axis, part in enumerate((*force, *plus(torque, moment))):
                    load[axis] += sign * part
        row: list[float] = []
        for surface in self.surfaces:
            row += loads.get(surface.body, [0.0] * 6)
        return row

    def find_torque(self, records: Sequence[Sequence[float]], pair: ContactPair) -> Sequence[float]:
        """Return the torque on surface 2 of a contact in addition to that of the force at its point.

        Args:
            records: output records after an evaluation.
            pair: the contact.

        Returns:
            Torque (3,) in ground, N m.
        """
        return 0.0, 0.0, 0.0

    def compute_energy(self, records: Sequence[Sequence[float]]) -> float:
        """Return the potential energy of the Hertz springs, J.

        Args:
            records: output records of the pairs after an evaluation.
        """
        return sum(
            contact_energy(
                record[CONTACT_WORK.DEPTH], record[CONTACT_WORK.RADIUS], pair.effective[0]
            )
            for pair, record in zip(self.pairs, records, strict=False)
            if record[CONTACT_WORK.DEPTH] > 0.0
        )


@register_force_type
class HuntCrossley(PairContact):
    """HuntCrossleyForce on half spaces, spheres and ellipsoids."""

    component: ClassVar = HuntCrossleyForce

    @classmethod
    def make(cls, builder: ElementBuilder, force: HuntCrossleyForce) -> HuntCrossley:
        """Return the element of a force.

        Raises:
            ModelError: a geometry does not exist, or a parameter has no meaning.
            UnsupportedError: osimlite cannot compute contact of one of the geometries.
        """
        surfaces = [
            read_surface(builder, force, *result) for result in read_geometries(builder, force)
        ]
        builder.check_finite(
            force,
            (force.transition_velocity, *(x for surface in surfaces for x in surface.material)),
        )
        pairs = []
        for first, second in combinations(range(len(surfaces)), 2):
            a, b = surfaces[first], surfaces[second]
            # Surfaces on one body never move against each other, and two half spaces always
            # overlap. Simbody ignores both.
            if a.body == b.body or (a.is_half_space and b.is_half_space):
                continue
            # The kernels expect the half space first.
            if b.is_half_space:
                first, second, a, b = second, first, b, a
            try:
                pairs.append(
                    ContactPair(first, second, combine_materials(*a.material, *b.material))
                )
            except ValueError as error:
                raise ModelError(f"the force '{builder.path(force)}': {error}") from None
        early_return = builder.early_return and len(pairs) > 1
        if early_return and any(surface.radii for surface in surfaces):
            raise builder.make_unsupported_error(
                force, " with an ellipsoid and the option simbody_early_return"
            )
        path = builder.path(force)
        vt = force.transition_velocity
        return cls(path, force.name, tuple(surfaces), tuple(pairs), vt, early_return)


def _pack_shape(surface: ContactSurface, link_map: LinkMap) -> tuple[float, ...]:
    """Return an ellipsoid or a sphere as numbers of a kernel.

    Args:
        surface: the surface.
        link_map: placement of the bodies in the links of the tree.

    Returns:
        Three axes in the link, and the half axes (m) along them.
    """
    if surface.radii is None or surface.axes is None:
        return (
            1.0,
            0.0,
            0.0,
            0.0,
            1.0,
            0.0,
            0.0,
            0.0,
            1.0,
            surface.radius,
            surface.radius,
            surface.radius,
        )
    axes = (link_map.direction(surface.body, axis) for axis in zip(*surface.axes, strict=True))
    return (*(x for axis in axes for x in axis), *surface.radii)


def read_geometries(
    builder: ElementBuilder, force: Any
) -> Iterator[tuple[ContactGeometry, Material]]:
    """Yield the contact geometries of a force in its order.

    Args:
        builder: builder of the model's elements.
        force: force component of the model.

    Yields:
        A geometry, and the material that the force gives it.

    Raises:
        ModelError: the model has no geometry of a name.
    """
    for parameters in force.contact_parameters.objects:
        material = (
            parameters.stiffness,
            parameters.dissipation,
            parameters.static_friction,
            parameters.dynamic_friction,
            parameters.viscous_friction,
        )
        spec = type(parameters).field_specs()["geometry"]
        for position, word in enumerate(parameters.geometry):
            use = Use(parameters, builder.tree.owner_of(parameters), spec, word, position)
            geometry: Any = builder.tree.resolve(use).target
            if geometry is None:
                text = word if isinstance(word, str) else word.name
                raise ModelError(
                    f"the force '{builder.path(force)}' names the contact geometry '{text}', which the model does not "
                    "have; run 'osimlite validate'"
                )
            yield geometry, material


def read_surface(
    builder: ElementBuilder, force: Any, geometry: Any, material: Material
) -> ContactSurface:
    """Return a contact geometry as the surface of a contact.

    Args:
        builder: builder of the elements.
        force: the force, for messages.
        geometry: the contact geometry.
        material: parameters that the force gives it.

    Raises:
        ModelError: a radius of an ellipsoid is not positive.
        UnsupportedError: the geometry is of another class, or not fixed to a body.
    """
    # Classes are compared by name, so that a model without contact does not import them.
    if not any(
        map(partial(is_a, geometry), ("ContactHalfSpace", "ContactSphere", "ContactEllipsoid"))
    ):
        raise builder.make_unsupported_error(
            force, f" on the {get_class_name(geometry)} '{builder.path(geometry)}'"
        )
    frame, body, frame_in_body = find_frame(builder, geometry)
    center = frame_in_body[:3, 3]
    axes = frame_in_body[:3, :3]
    # The half space is solid at x > 0 of the geometry's frame.
    normal = -axes[:, 0]
    if is_a(geometry, "ContactEllipsoid"):
        builder.check_finite(geometry, (*center, *axes.ravel(), *geometry.radii))
        if not min(geometry.radii) > 0.0:
            raise ModelError(
                f"the radii of '{builder.path(geometry)}' are not all positive; make them positive"
            )
        center_in_body = to_triple(center)
        still = (0.0, 0.0, 0.0)
        rows = to_triple(axes[0]), to_triple(axes[1]), to_triple(axes[2])
        # The longest radius bounds the ellipsoid, as a sphere's radius does, where only a bound is
        # needed.
        longest = max(geometry.radii)
        radii = to_triple(geometry.radii)
        return ContactSurface(
            geometry.name, body, frame, center_in_body, longest, still, material, radii, rows
        )
    radius = geometry.radius if is_a(geometry, "ContactSphere") else inf
    builder.check_finite(geometry, (*center, *normal, 0.0 if radius == inf else radius))
    return ContactSurface(
        geometry.name, body, frame, to_triple(center), radius, to_triple(normal), material
    )


def find_frame(builder: ElementBuilder, geometry: ContactGeometry) -> tuple[str, int, Array]:
    """Return the frame and the body to which a contact geometry is fixed.

    Args:
        builder: builder of the elements.
        geometry: the contact geometry.

    Returns:
        Name of its frame, the frame's body, and the geometry's axes and origin (4, 4) in the body.

    Raises:
        UnsupportedError: the geometry is not fixed to a body.
    """
    frame = builder.tree.target(geometry, "socket_frame", geometry.socket_frame)
    if not isinstance(frame, PhysicalFrame):
        raise UnsupportedError(
            f"the contact geometry '{builder.path(geometry)}' on the {get_class_name(frame)} '{builder.path(frame)}'"
        )
    body, frame_in_body = builder.find_placement(frame)
    return frame.name, body, frame_in_body @ make_offset(geometry.location, geometry.orientation)
