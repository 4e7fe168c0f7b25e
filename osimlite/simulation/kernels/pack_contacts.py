"""Contacts and limits as items."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from osimlite.errors import UnsupportedError
from osimlite.forces.coordinate_limit import limit_energy, limit_force
from osimlite.forces.hunt_crossley import contact_energy
from osimlite.simulation.contact_elements import ContactPair, HuntCrossley, PairContact
from osimlite.simulation.elements import CoordinateLimit
from osimlite.simulation.kernels.items import Item, Places
from osimlite.simulation.kernels.layout import CONTACT_WORK, DEPTH_OF, RADIUS_OF


def pack_pairs(element: HuntCrossley, places: Places) -> list[Item]:
    """An item for each pair of half spaces and spheres."""
    if element.early_return:
        raise UnsupportedError(
            f"the compiled engine does not reproduce Simbody's early return in '{element.path}'; take --engine bullet"
        )
    found: list[Item] = []
    for pair in element.pairs:
        links, numbers = pair_numbers(element, pair, places)
        law = "touch_half_space" if element.surfaces[pair.first].is_half_space else "touch_spheres"
        found.append(Item(_kept(element.pairs[len(found)]), law, links, numbers, is_contact=True))
    return found


def pair_numbers(element: PairContact, pair: ContactPair, places: Places) -> tuple[tuple[int, int], tuple[float, ...]]:
    """Links and numbers of a pair."""
    one, two = element.surfaces[pair.first], element.surfaces[pair.second]
    first, center = places.station(one.body, one.center)
    second, other = places.station(two.body, two.center)
    normal, radius = places.direction(one.body, one.normal), 0.0 if one.is_half_space else one.radius
    return (first, second), (*center, *normal, radius, *other, two.radius, *pair.effective, element.vt)


def contact_kept(row: Sequence[float], stiffness: float) -> Any:
    """What a contact wants for its report: force, point and energy, None without contact."""
    if not row[DEPTH_OF] > 0.0:
        return None
    return (*row[:6], contact_energy(row[DEPTH_OF], row[RADIUS_OF], stiffness))


def _kept(pair: ContactPair) -> Any:
    return lambda record, values, speeds: [contact_kept(record[:CONTACT_WORK], pair.effective[0])]


def pack_limit(element: CoordinateLimit, places: Places) -> list[Item]:
    """One item; without a law if the coordinate is locked."""

    def kept(record: Sequence[float], values: Sequence[float], speeds: Sequence[float]) -> list[Any]:
        q, (Ku, qu, Kl, ql, _, t) = values[element.coordinate], element.constants
        force = limit_force(q, speeds[element.coordinate], *element.constants)
        return [(force, limit_energy(q, Ku, qu, Kl, ql, t))]

    freedom = places.freedom(element.coordinate)
    if freedom < 0:
        return [Item(kept)]
    return [Item(kept, "limit", (freedom,), element.constants)]
