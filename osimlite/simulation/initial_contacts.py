"""Contact surfaces that are inside each other when a simulation starts."""

from __future__ import annotations

from math import inf

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.mechanics.multibody.kinematics import MechanismKinematics
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.contact import START_DEPTH_M, START_DEPTH_SHARE
from osimlite.simulation.elements import Forces
from osimlite.simulation.elements.contact import ContactSurface, PairContact
from osimlite.simulation.elements.force_type import DeclaredForce


class DeepContact(NamedTuple):
    """Sphere inside another surface of its contact force.

    Attributes:
        sphere: name of the sphere.
        surface: name of the half space or sphere that it is inside.
        depth: depth, m.
        is_sunk: whether even its centre is inside a half space, which the rule OSIM521 warns of.
    """

    sphere: str
    surface: str
    depth: float
    is_sunk: bool


def find_deep_contacts(
    forces: Forces, mechanism: Mechanism, q: Array, time: float
) -> list[DeepContact]:
    """Return spheres that are inside other surfaces by more than the limits of the rule OSIM521.

    Args:
        forces: force elements of the model.
        mechanism: bodies and joints of the model.
        q: coordinate values (n,), rad or m.
        time: time of prescribed coordinates, s.

    Returns:
        The contacts, the deepest first.
    """
    pairs: list[tuple[ContactSurface, ContactSurface]] = []
    for element in forces.elements:
        if isinstance(element, PairContact):
            for pair in element.pairs:
                pairs.append((element.surfaces[pair.first], element.surfaces[pair.second]))
        elif isinstance(element, DeclaredForce) and isinstance(element.location, tuple):
            # The half space and the sphere of a SmoothSphereHalfSpaceForce.
            match element.location:
                case (ContactSurface() as half_space, ContactSurface() as sphere):
                    pairs.append((half_space, sphere))
    if not pairs:
        return []
    state = mechanism.at(q, time=time)
    contacts = []
    for first, second in pairs:
        if first.mesh or first.radii or second.mesh or second.radii:
            continue
        # A half space is the other surface, whatever the order in the file.
        sphere, surface = (second, first) if first.radius == inf else (first, second)
        depth = _compute_depth(state, sphere, surface)
        # Between two half spaces the depth is infinite. A NaN is not larger.
        if inf > depth > max(START_DEPTH_M, START_DEPTH_SHARE * sphere.radius):
            is_sunk = surface.radius == inf and depth > sphere.radius
            contacts.append(DeepContact(sphere.name, surface.name, depth, is_sunk))
    return sorted(contacts, key=lambda contact: -contact.depth)


def _compute_depth(
    state: MechanismKinematics, sphere: ContactSurface, surface: ContactSurface
) -> float:
    """Return the depth of a sphere in another surface (m), negative if they are apart."""
    arm = state.point(sphere.body, np.array(sphere.center)) - state.point(
        surface.body, np.array(surface.center)
    )
    if surface.radius == inf:
        normal = state.rotations[surface.body] @ np.array(surface.normal)
        return float(sphere.radius - arm @ normal)
    return float(sphere.radius + surface.radius - np.linalg.norm(arm))
