"""Contacts and limits as items."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from osimlite.errors import UnsupportedError
from osimlite.forces.coordinate_limit import limit_energy, limit_force
from osimlite.forces.hunt_crossley import contact_energy
from osimlite.simulation.contact_elements import ContactPair, ContactSurface, PairContact
from osimlite.simulation.elements import CoordinateLimit
from osimlite.simulation.kernels.items import Item, Places, of_record
from osimlite.simulation.kernels.layout import CONTACT_WORK, DEPTH_OF, RADIUS_OF
from osimlite.simulation.kernels.meshes import MESH_WORK
from osimlite.simulation.mesh_contact import ElasticFoundation


def pack_pairs(element: PairContact, places: Places) -> list[Item]:
    """An item for each pair of half spaces, spheres and ellipsoids."""
    found = []
    for pair in element.pairs:
        one, two = element.surfaces[pair.first], element.surfaces[pair.second]
        links, numbers = pair_numbers(element, pair, places)
        law = "touch_half_space" if one.is_half_space else "touch_spheres"
        if one.radii or two.radii:
            law = "touch_ellipsoid" if one.is_half_space else "touch_ellipsoids"
            shapes = (surface for surface in (one, two) if not surface.is_half_space)
            numbers = (*numbers, *(x for surface in shapes for x in _shape(surface, places)))
        found.append(Item(_kept(pair), law, links, numbers, is_contact=True, is_part=element.early_return))
    if element.early_return:
        found.append(_early_return(element, places))
    return found


def _shape(surface: ContactSurface, places: Places) -> tuple[float, ...]:
    """Axes in the link, and half axes, of an ellipsoid or a sphere."""
    if surface.radii is None or surface.axes is None:
        return 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, surface.radius, surface.radius, surface.radius
    axes = (places.direction(surface.body, axis) for axis in zip(*surface.axes, strict=True))
    return (*(x for axis in axes for x in axis), *surface.radii)


def _early_return(element: PairContact, places: Places) -> Item:
    """What computes the pairs one by one in Simbody's order."""
    stations = [places.station(surface.body, surface.center) for surface in element.surfaces]
    links = (link for link, _ in stations)
    pairs = (place for pair in element.pairs for place in (pair.first, pair.second))
    numbers = (
        x for (_, center), surface in zip(stations, element.surfaces, strict=True) for x in (*center, surface.radius)
    )
    ints = len(stations), len(element.pairs), *links, *pairs
    return Item(lambda record, values, speeds: [], "early_return", ints, tuple(numbers), room=5 * len(stations))


def pair_numbers(element: PairContact, pair: ContactPair, places: Places) -> tuple[tuple[int, int], tuple[float, ...]]:
    """Links and numbers of a pair."""
    one, two = element.surfaces[pair.first], element.surfaces[pair.second]
    first, center = places.station(one.body, one.center)
    second, other = places.station(two.body, two.center)
    normal, radius = places.direction(one.body, one.normal), 0.0 if one.is_half_space else one.radius
    return (first, second), (*center, *normal, radius, *other, two.radius, *pair.effective, element.vt)


def pack_foundation(element: ElasticFoundation, places: Places) -> list[Item]:
    """Two items for each pair of a mesh and a half space or a sphere: what computes it, and its place as a contact.

    Raises:
        UnsupportedError: two meshes touch.
    """
    found = []
    for place, pair in enumerate(element.pairs):
        one, two = element.surfaces[pair.first], element.surfaces[pair.second]
        mesh = two.mesh
        if mesh is None or one.mesh is not None:
            raise UnsupportedError(
                f"the compiled engine cannot compute '{element.path}', where meshes touch meshes; "
                "take --engine bullet, or leave it out"
            )
        links, numbers = pair_numbers(element, pair, places)
        stiffness, *material = two.material
        middles = (places.station(two.body, middle)[1] for middle in mesh.centroids.tolist())
        springs = (
            x for area, middle in zip(mesh.areas.tolist(), middles, strict=True) for x in (stiffness * area, *middle)
        )
        ints = *links, len(mesh.areas), int(one.is_half_space), place
        own = (*numbers[:11], *material, element.vt, *springs)
        found.append(Item(lambda record, values, speeds: [], "touch_mesh", is_contact=True, is_part=True))
        found.append(Item(of_record(_mesh_kept), "touch_mesh", ints, own, room=MESH_WORK))
    return found


def _mesh_kept(record: Sequence[float]) -> tuple[float, ...]:
    return tuple(record[:MESH_WORK])


def contact_kept(row: Sequence[float], stiffness: float) -> Any:
    """What a contact wants for its report: force, point and energy, None without contact."""
    if not row[DEPTH_OF] > 0.0:
        return None
    return (*row[:6], contact_energy(row[DEPTH_OF], row[RADIUS_OF], stiffness))


def _kept(pair: ContactPair) -> Any:
    return lambda record, values, speeds: [contact_kept(record[:CONTACT_WORK], pair.effective[0])]


def pack_limit(element: CoordinateLimit, places: Places) -> list[Item]:
    """The force, and its power where that is a state; without laws if the coordinate is locked."""

    def kept(record: Sequence[float], values: Sequence[float], speeds: Sequence[float]) -> list[Any]:
        q, (Ku, qu, Kl, ql, _, t) = values[element.coordinate], element.constants
        force = limit_force(q, speeds[element.coordinate], *element.constants)
        return [(force, limit_energy(q, Ku, qu, Kl, ql, t))]

    freedom = places.freedom(element.coordinate)
    force, power = (None, None) if freedom < 0 else ("limit", "limit_power")
    items = [Item(kept, force, (freedom,), element.constants)]
    if element.states:
        items.append(Item(lambda *_: [], power, (freedom,), element.constants, has_state=True))
    return items
