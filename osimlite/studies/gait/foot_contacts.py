"""What of a walker stands on the ground, and what must not touch it."""

from __future__ import annotations

import re
from collections.abc import Sequence

from osimlite.base.records import dataclass
from osimlite.base.text import format_count, join_words, suggest_or_list
from osimlite.errors import OsimliteError
from osimlite.mechanics.multibody.mechanism import GROUND, Mechanism
from osimlite.simulation.batches import BatchEngine
from osimlite.simulation.elements.contact import HuntCrossley

_OF_A_FOOT = re.compile(r"foot|feet|toe|heel|calc|sole|ball|hallux|met(a|\d)", re.IGNORECASE)


@dataclass(frozen=True)
class FootContacts:
    """The contacts of a walker with the ground."""

    # the contacts of each foot, by the names that the engine has for them
    feet: tuple[tuple[str, ...], ...]
    falls: tuple[str, ...]  # contacts that end the walk

    @property
    def foot_of(self) -> dict[str, int]:
        """Number of the foot that each contact of a foot belongs to."""
        return {contact: number for number, foot in enumerate(self.feet) for contact in foot}


@dataclass(frozen=True)
class _Sole:
    """A contact of a moving body with a half space."""

    contact: str
    words: str
    body: int
    reach: float  # from where the joint holds the body, m


def find_footing(engine: BatchEngine, feet: Sequence[str] | None = None) -> FootContacts:
    """Tell the feet from what must not touch the ground.

    The bodies that touch the ground and carry no other body that does are the ends of the legs. On
    each, the contact farthest from the joint is the foot, and so is any other that is at least half
    as far; only if these leave a doubt (an end without one that is clearly farthest, or a contact
    farther up whose name is that of a part of the foot) do names decide. Every other contact with
    the ground ends the walk.

    Args:
        engine: of the model.
        feet: the contacts of each foot, with + between those of one foot, instead of looking for
            them.

    Raises:
        OsimliteError: a contact does not exist or is named twice, or the model has no two legs.
    """
    if not engine.contacts:
        raise OsimliteError(
            f"'{engine.mechanism.name}' has no contact forces, so that nothing walks"
        )
    soles = _find_soles(engine)
    known = [sole.contact for sole in soles]
    if feet:
        given = tuple(tuple(part.strip() for part in foot.split("+")) for foot in feet)
        named = [contact for foot in given for contact in foot]
        for contact in named:
            if contact not in known:
                raise OsimliteError(
                    f"no sphere touches a half space in '{contact}'"
                    f"{suggest_or_list(contact, known) if known else '; none does'}"
                )
            if named.count(contact) > 1:
                raise OsimliteError(
                    f"'{contact}' is given to the feet twice; name it once, for one of them"
                )
        if len(given) < 2:
            raise OsimliteError(
                f"a walk needs two feet, not only '{feet[0]}'; name the contacts of each"
            )
    else:
        given = _find_feet(engine.mechanism, soles)
    return FootContacts(
        given, tuple(name for name in known if not any(name in foot for foot in given))
    )


def _find_feet(mechanism: Mechanism, soles: Sequence[_Sole]) -> tuple[tuple[str, ...], ...]:
    bodies = {sole.body for sole in soles}
    above = {body: set(_list_ancestors(mechanism, body)) for body in bodies}
    ends = sorted(body for body in bodies if not any(body in above[other] for other in bodies))
    if not ends:
        raise OsimliteError(
            f"no sphere of '{mechanism.name}' touches a half space; feet are spheres on the ground"
        )
    if len(ends) != 2:
        names = join_words(mechanism.bodies[end].name for end in ends)
        raise OsimliteError(
            f"'{mechanism.name}' touches the ground with the ends of {format_count(len(ends), 'leg')} ({names}), not of "
            "two; say which contacts are feet with --foot"
        )
    result = []
    for end in ends:
        own = [sole for sole in soles if sole.body == end]
        farthest = max(sole.reach for sole in own)
        likely = [sole for sole in own if sole.reach >= 0.5 * farthest]
        named = [sole for sole in likely if _OF_A_FOOT.search(sole.words)]
        # Behind the toes there may be a heel, on a body of its own.
        shared = set.intersection(*(above[body] for body in ends))
        leg = above[end] - shared
        behind = [sole for sole in soles if sole.body in leg and _OF_A_FOOT.search(sole.words)]
        result.append(tuple(sole.contact for sole in (*behind, *(named or likely))))
    return tuple(result)


def _find_soles(engine: BatchEngine) -> list[_Sole]:
    result = []
    for element in engine.forces.elements:
        if not isinstance(element, HuntCrossley):
            continue
        for index, pair in enumerate(element.pairs):
            plane, sphere = element.surfaces[pair.first], element.surfaces[pair.second]
            if plane.is_half_space and not sphere.radii and sphere.body != GROUND:
                held = engine.mechanism.bodies[sphere.body].mobilizer.child_frame[:3, 3]
                reach = (
                    sum((a - b) ** 2 for a, b in zip(sphere.center, held.tolist(), strict=True))
                    ** 0.5
                )
                name = element.pair_name(index)
                result.append(_Sole(name, f"{name} {sphere.name}", sphere.body, reach))
    return result


def _list_ancestors(mechanism: Mechanism, body: int) -> list[int]:
    """The bodies that carry a body."""
    result: list[int] = []
    while (body := mechanism.bodies[body].parent) != GROUND:
        result.append(body)
    return result
