"""Contacts of a walker that are feet, and contacts that are falls."""

from __future__ import annotations

import re
from collections.abc import Sequence

from osimlite.base.patterns import compile_later
from osimlite.base.records import dataclass
from osimlite.base.text import format_count, join_words, suggest_or_list
from osimlite.errors import OsimliteError
from osimlite.mechanics.multibody.mechanism import GROUND, Mechanism
from osimlite.simulation.batches import BatchEngine
from osimlite.simulation.elements.contact import HuntCrossley

_FOOT_WORDS = compile_later(r"foot|feet|toe|heel|calc|sole|ball|hallux|met(a|\d)", re.IGNORECASE)
"""Words in names of contacts and spheres that mean a part of the foot."""


@dataclass(frozen=True)
class FootContacts:
    """Contacts of a walker with the ground.

    Attributes:
        feet: contacts of each foot, by the names of the engine.
        fall_contacts: contacts that end the walk.
    """

    feet: tuple[tuple[str, ...], ...]
    fall_contacts: tuple[str, ...]

    @property
    def foot_of(self) -> dict[str, int]:
        """Index of the foot to which each contact belongs.

        Returns:
            Index of the foot, by the name of the contact.
        """
        return {contact: number for number, foot in enumerate(self.feet) for contact in foot}


@dataclass(frozen=True)
class _SoleContact:
    """Contact of a sphere on a moving body with a half space.

    Attributes:
        contact: name of the contact pair in the engine.
        words: text in which names of parts of the foot are searched.
        body: index of the body.
        reach: distance of the sphere from the joint of its body (m).
    """

    contact: str
    words: str
    body: int
    reach: float


def find_footing(engine: BatchEngine, feet: Sequence[str] | None = None) -> FootContacts:
    """Return which contacts with the ground are feet, and which end a walk.

    Bodies that touch the ground and carry no other such body are the ends of the legs. On each, the
    contact farthest from the joint belongs to the foot, and so do others that are at least half as
    far. If this is ambiguous (no contact is clearly farthest, or a contact farther up is named
    after a part of the foot), names decide. Every other contact with the ground ends the walk.

    Args:
        engine: engine of the model.
        feet: contacts of each foot, joined by `+` within one foot; found automatically by default.

    Raises:
        OsimliteError: a contact does not exist or is named twice, or the model does not have two
            legs.
    """
    if not engine.contacts:
        raise OsimliteError(
            f"'{engine.mechanism.name}' has no contact forces, so it cannot walk; add contact forces between feet and ground"
        )
    soles = _find_soles(engine)
    sole_contacts = [sole.contact for sole in soles]
    if feet:
        named_feet = tuple(
            tuple(contact_name.strip() for contact_name in foot.split("+")) for foot in feet
        )
        requested = [contact for foot in named_feet for contact in foot]
        for contact in requested:
            if contact not in engine.contacts:
                raise OsimliteError(
                    f"'{engine.mechanism.name}' has no contact force '{contact}'"
                    f"{suggest_or_list(contact, sole_contacts or engine.contacts)}"
                )
            if contact not in sole_contacts:
                raise OsimliteError(
                    f"no sphere touches a half space in '{contact}'"
                    f"{suggest_or_list(contact, sole_contacts) if sole_contacts else '; none does'}"
                )
            if requested.count(contact) > 1:
                raise OsimliteError(
                    f"'{contact}' is named for both feet, or twice; name it once, for one foot"
                )
        if len(named_feet) < 2:
            raise OsimliteError(
                f"a walk needs two feet, found '{feet[0]}' only; name the contact forces of both feet, each with a --foot (feet=)"
            )
    else:
        named_feet = _find_feet(engine.mechanism, soles)
    fall_contacts = tuple(
        name for name in sole_contacts if not any(name in foot for foot in named_feet)
    )
    return FootContacts(named_feet, fall_contacts)


def _find_feet(mechanism: Mechanism, soles: Sequence[_SoleContact]) -> tuple[tuple[str, ...], ...]:
    """Return the contacts of the feet from the structure of the model and the contacts' names.

    Raises:
        OsimliteError: no sphere of the model touches a half space, or the model does not have two
            legs.
    """
    bodies = {sole.body for sole in soles}
    ancestors_by_body = {body: set(_list_ancestors(mechanism, body)) for body in bodies}
    end_bodies = sorted(
        body
        for body in bodies
        if not any(body in ancestors_by_body[other_body] for other_body in bodies)
    )
    if not end_bodies:
        raise OsimliteError(
            f"no sphere of '{mechanism.name}' touches a half space; a foot needs a contact force between a "
            "sphere and a half space"
        )
    # A walk alternates between two feet.
    if len(end_bodies) != 2:
        names = join_words(mechanism.bodies[end].name for end in end_bodies)
        raise OsimliteError(
            f"'{mechanism.name}' touches the ground with the ends of {format_count(len(end_bodies), 'leg')} "
            f"({names}), but a walk needs two feet; name their contact forces with --foot (feet=)"
        )
    result = []
    for end in end_bodies:
        soles_of_leg = [sole for sole in soles if sole.body == end]
        farthest = max(sole.reach for sole in soles_of_leg)
        # A contact much closer to the joint, such as a knee, is no part of the foot.
        likely = [sole for sole in soles_of_leg if sole.reach >= 0.5 * farthest]
        named_like_feet = [sole for sole in likely if _FOOT_WORDS.search(sole.words)]
        # A heel may be on another body than the toes, farther up the same leg.
        shared_ancestors = set.intersection(*(ancestors_by_body[body] for body in end_bodies))
        leg = ancestors_by_body[end] - shared_ancestors
        rear_soles = [sole for sole in soles if sole.body in leg and _FOOT_WORDS.search(sole.words)]
        result.append(tuple(sole.contact for sole in (*rear_soles, *(named_like_feet or likely))))
    return tuple(result)


def _find_soles(engine: BatchEngine) -> list[_SoleContact]:
    """Return all contacts of spheres of moving bodies with half spaces."""
    result = []
    for element in engine.forces.elements:
        if not isinstance(element, HuntCrossley):
            continue
        for index, pair in enumerate(element.pairs):
            plane = element.surfaces[pair.first]
            sphere = element.surfaces[pair.second]
            # Only spheres on moving bodies against half spaces can be feet; ellipsoids have radii.
            if plane.is_half_space and not sphere.radii and sphere.body != GROUND:
                joint = engine.mechanism.bodies[sphere.body].mobilizer.child_frame[:3, 3]
                reach = (
                    sum((a - b) ** 2 for a, b in zip(sphere.center, joint.tolist(), strict=True))
                    ** 0.5
                )
                name = element.pair_name(index)
                result.append(_SoleContact(name, f"{name} {sphere.name}", sphere.body, reach))
    return result


def _list_ancestors(mechanism: Mechanism, body: int) -> list[int]:
    """Return the indices of the bodies between a body and ground."""
    result: list[int] = []
    while (body := mechanism.bodies[body].parent) != GROUND:
        result.append(body)
    return result
