"""Hunt-Crossley contact, written as straight-line code: gaps of all pairs, and the law for those that touch."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from osimlite.forces.hunt_crossley import simbody_pair_order

if TYPE_CHECKING:
    from osimlite.simulation.contact_elements import ContactPair, ContactSurface, PairContact
    from osimlite.simulation.field import Writer
    from osimlite.simulation.script import Scalar


def write_contacts(element: PairContact, writer: Writer) -> None:
    """Write all contacts of one force."""
    if not element.early_return:
        for place, pair in enumerate(element.pairs):
            _Pair(element, writer, place, pair).write()
        return
    # Simbody's defect depends on the order in which it comes across the pairs, which changes with the pose.
    script = writer.script
    centers = [writer.chain.point(script, surface.body, surface.center) for surface in element.surfaces]
    texts = ", ".join(f"({', '.join(map(str, center))})" for center in centers)
    place_of = {frozenset((pair.first, pair.second)): place for place, pair in enumerate(element.pairs)}
    order = writer.constant(_PairOrder([surface.radius for surface in element.surfaces], place_of))
    with script.block(f"for place in {order}(({texts})):"):
        for place, pair in enumerate(element.pairs):
            with script.block(f"if place == {place}:"):
                _Pair(element, writer, place, pair, "break").write()


class _PairOrder:
    """The pairs of a force that touch or nearly do, by their place, in Simbody's order."""

    def __init__(self, radii: list[float], places: dict[frozenset[int], int]) -> None:
        self.radii = radii
        self.places = places

    def __call__(self, centers: Any) -> list[int]:
        pairs = [frozenset(pair) for pair in simbody_pair_order(centers, self.radii)]
        return [self.places[pair] for pair in pairs if pair in self.places]


class _Pair:
    """One pair of surfaces.

    `at_no_force` is the statement for a contact that separates too fast to push.
    """

    def __init__(
        self, element: PairContact, writer: Writer, place: int, pair: ContactPair, at_no_force: str = ""
    ) -> None:
        self.writer = writer
        self.script = writer.script
        self.place = place
        self.pair = pair
        self.one, self.two = element.surfaces[pair.first], element.surfaces[pair.second]
        self.vt = element.vt
        self.at_no_force = at_no_force

    def write(self) -> None:
        """Write the gap, and what happens if there is none."""
        writer, script = self.writer, self.script
        k, a, *rest = self.pair.effective
        center = writer.chain.point(script, self.two.body, self.two.center)
        other = writer.chain.point(script, self.one.body, self.one.center)
        if self.one.is_half_space:
            normal = writer.chain.direction(script, self.one.body, self.one.normal)
            apart = script.sum(
                *zip(center, normal, strict=True), *((-1.0, *xn) for xn in zip(other, normal, strict=True))
            )
            # Of an ellipsoid, this is where the sphere around it touches.
            touching = f"{apart} < {self.two.radius!r}"
        else:
            gap = script.combine((1.0, center), (-1.0, other))
            reach = self.one.radius + self.two.radius
            touching = f"{script.dot(gap, gap)} < {reach * reach!r}"
        with script.block(f"if {touching}:"):
            radius: float | str = self.two.radius
            if self.one.is_half_space and self.two.radii:
                d, radius, *point = writer.call(
                    "half_space_ellipsoid", *other, *normal, *center, *self._ellipsoid(self.two), a, results=5
                )
            elif self.one.is_half_space:
                d, *point = writer.call("half_space_sphere", *other, *normal, *center, self.two.radius, a, results=4)
            elif self.one.radii or self.two.radii:
                ends = (*other, *self._ellipsoid(self.one), *center, *self._ellipsoid(self.two))
                d, radius, nx, ny, nz, *point = writer.call("ellipsoid_ellipsoid", *ends, a, results=8)
                normal = (nx, ny, nz)
            else:
                d, radius, nx, ny, nz, *point = writer.call(
                    "sphere_sphere", *other, self.one.radius, *center, self.two.radius, a, results=8
                )
                normal = (nx, ny, nz)
            x, y, z = point
            columns = writer.chain.columns(script, self.one.body, self.two.body, (x, y, z))
            # The law wants the velocity of surface 1 relative to surface 2.
            velocity = script.combine((-1.0, writer.chain.velocity(script, columns)))
            force = writer.call("contact_force", d, radius, k, *rest, self.vt, *normal, *velocity, results=3)
            fx, fy, fz = force
            energy = [writer.call("contact_energy", d, radius, k)] if writer.reporting else []
            writer.keep(self.place, *force, *point, *energy)
            with script.block(f"if {fx} != 0.0 or {fy} != 0.0 or {fz} != 0.0:"):
                writer.push(columns, (fx, fy, fz))
                writer.touch(self.place, (fx, fy, fz))
                script.line("pass")
            if self.at_no_force:
                script.line(f"else: {self.at_no_force}")

    def _ellipsoid(self, surface: ContactSurface) -> tuple[Scalar, ...]:
        """Axes in ground by rows, and half axes, of an ellipsoid or a sphere."""
        if not (surface.radii and surface.axes):
            return 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, surface.radius, surface.radius, surface.radius
        axes = self.script.multiply(self.writer.chain.body(self.script, surface.body).rotation, surface.axes)
        return (*(entry for row in axes for entry in row), *surface.radii)
