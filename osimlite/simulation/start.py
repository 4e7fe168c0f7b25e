"""Where a simulation starts: values and speeds of coordinates as people give them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from osimlite.errors import SettingError
from osimlite.multibody.mechanism import Mechanism
from osimlite.quantity import Quantity, doubt, quantity

if TYPE_CHECKING:
    from osimlite.multibody.parts import CoordinateInfo


def in_units_of(mechanism: Mechanism, name: str, given: float | str) -> float:
    """A value or speed of a coordinate in rad or m (per second); a text such as ``"30deg"`` may carry a unit.

    Raises:
        ModelError: there is no such coordinate.
        SettingError: the text is no quantity, or its unit does not fit the coordinate.
    """
    kind = mechanism.coordinates[mechanism.coordinate_index(name)].motion_type
    if not isinstance(given, str):
        return float(given)
    read = quantity(given)
    if read is None:
        raise SettingError(f"coordinate '{name}' takes a number such as 0.5 or 30deg, not '{given}'")
    if read.unit is not None and kind != "coupled" and read.is_angle != (kind == "rotational"):
        wanted = "deg or rad" if kind == "rotational" else "m, cm or mm"
        raise SettingError(f"coordinate '{name}' is {kind}: give '{given}' in {wanted}")
    return read.value


def doubt_of(info: CoordinateInfo, name: str, given: float | str) -> str:
    """What is odd about a value as people give it: degrees that are taken for radians.

    Args:
        info: of the coordinate.
        name: what it was called.
        given: rad or m, or a text with a unit.

    Returns:
        A sentence, or "" if there is nothing odd.
    """
    if info.motion_type != "rotational":
        return ""
    return doubt(name, quantity(given) if isinstance(given, str) else Quantity(float(given), None), info.range)
