"""Behaviour of OpenSim 4.6 that depends on the class of an object and not on its properties' declarations."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from osimlite.base.named_tuples import NamedTuple

REFUSED: Final = "OpenSim rejects the model"
TOUCHING: Final = "forces and motion become NaN as soon as the surfaces touch"
NAN: Final = "accelerations become NaN, without a message"
STOPS: Final = "OpenSim cannot take even one time step"
STUCK: Final = (
    "OpenSim finds no equilibrium for the muscle and fails when it computes accelerations"
)

NO_EQUILIBRIUM: Final = "OpenSim finds no equilibrium for the muscle"
IDLE: Final = "the actuator does nothing, whatever its control"
FLAT: Final = "OpenSim computes with it, on a flat or mirrored surface"

BELOW_QUARTER_TURN: Final = "0 to 1.5707963267948866"
"""Range of pennation angles in radians; OpenSim's check requires slightly less than pi / 2."""
UP_TO_QUARTER_TURN: Final = "0 to 1.5707963267948966"
"""Range of angles from 0 to pi / 2 in radians."""
LEAST_TIME_CONSTANT: Final = "> 2.0097183471152322e-14"
"""In seconds: OpenSim refuses time constants up to SimTK::SignificantReal."""

SELF, HOLDER, PATH = "own", "holder", "path"
MEAN, ALONG, ACROSS, AXES = "mean", "along", "across", "axes"

Contradiction = tuple[str | None, str]
"""Property that should be changed (None if there are several), and what is wrong."""

_NONE: Final[Mapping[str, str]] = MappingProxyType({})


class Facts(NamedTuple):
    """Behaviour of OpenSim with objects of a class; the class attribute `facts`.

    The consequences of numbers were measured with OpenSim 4.6: each number was put into a valid
    model, which was loaded, initialized and asked for accelerations. Where nothing is declared,
    OpenSim computes with the number.

    Attributes:
        states: names of the state variables in OpenSim's order; without any, those of the base.
            ``name?flag`` is a state if the property `flag` is true, ``name?!flag`` if it is false.
        outputs: outputs beyond those of the base, as OpenSim lists them: ``[]`` marks an output with
            channels, and a type follows the name unless it is a number.
        domains: numbers that OpenSim accepts in this class, by property, where the range is
            narrower than in the declaration of the property.
        refused: properties for which OpenSim rejects the model if a number is outside its domain.
        outside: other consequences of a number outside its domain, with the properties they apply to.
        zero: consequences of the number 0, which take precedence; an empty text means that OpenSim
            computes with 0.
        missing: consequences of a missing number that has no default.
        doubtful: reasons to doubt a number outside its domain with which OpenSim computes, by
            property.
        mujoco: properties of a muscle from which the numbers of MuJoCo's muscle are read, by
            MuJoCo's names (vmax, fvmax) or rise and fall, the time constants. A dot leads into the
            object that a property holds. Missing entries are taken from the base.
        scales: factors by which scaling a model multiplies numbers, by property. A factor is that
            of a body along its axes: SELF of the frame itself, HOLDER of the frame that holds the
            object, or that of a socket or coordinate, followed by the axis (x, y, z; MEAN; ALONG and ACROSS
            the Z axis of a surface; AXES for all three). PATH is the ratio of path lengths, and an
            empty text stands for no scaling. Missing entries are taken from the base.
    """

    states: str = ""
    outputs: str = ""
    domains: Mapping[str, str] = _NONE
    refused: str = ""
    outside: Mapping[str, str] = _NONE
    zero: Mapping[str, str] = _NONE
    missing: Mapping[str, str] = _NONE
    doubtful: Mapping[str, str] = _NONE
    mujoco: Mapping[str, str] = _NONE
    scales: Mapping[str, str] = _NONE
