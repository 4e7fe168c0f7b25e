"""What OpenSim 4.6 makes of a number outside the domain of its property, as the classes declare it."""

from __future__ import annotations

from osimlite.schema.base import Object
from osimlite.schema.facts import REFUSED


def consequence(
    cls: type[Object], name: str, number: float, *, rigid_tendon: bool = False
) -> tuple[str, bool]:
    """What happens with `number`, outside its domain, in a property; and whether that is a failure.

    A rigid tendon may have no length, where an elastic one needs some.
    """
    is_allowed = rigid_tendon and name == "tendon_slack_length"
    for base in cls.__mro__:
        facts = base.__dict__.get("facts")
        if facts is None:
            continue
        case = (
            facts.missing
            if number != number
            else facts.zero
            if number == 0 and not is_allowed
            else {}
        )
        for fates in (case, facts.outside, {REFUSED: facts.refused}):
            for fate, properties in fates.items():
                if name in properties.split():
                    return fate, bool(fate)
        if name in facts.doubts:
            return facts.doubts[name], False
    return "", False
