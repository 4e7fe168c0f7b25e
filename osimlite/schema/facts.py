"""What OpenSim 4.6 does with the objects of a class that their properties do not say."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final, NamedTuple

REFUSED: Final = "OpenSim rejects the model"
TOUCHING: Final = "forces and motion become NaN as soon as the surfaces touch"
NAN: Final = "accelerations become NaN, without a message"
STOPS: Final = "OpenSim cannot take one step"
STUCK: Final = (
    "OpenSim finds no equilibrium for the muscle and fails when it computes accelerations"
)

NO_EQUILIBRIUM: Final = "OpenSim finds no equilibrium for the muscle"
IDLE: Final = "the actuator does nothing, whatever its control"
FLAT: Final = "OpenSim computes with it, on a flat or mirrored surface"

BELOW_QUARTER_TURN: Final = "0 to 1.5707963267948866"
"""In radians: a little less than a quarter turn, as OpenSim asks."""
UP_TO_QUARTER_TURN: Final = "0 to 1.5707963267948966"

OWN, HOLDER, PATH = "own", "holder", "path"
MEAN, ALONG, ACROSS, AXES = "mean", "along", "across", "axes"

Contradiction = tuple[str | None, str]
"""The property of an object that is best changed, None if it is not one alone, and what is wrong."""

_NONE: Final[Mapping[str, str]] = MappingProxyType({})


class Facts(NamedTuple):
    """What a class declares besides its properties: the attribute `facts` of it.

    What becomes of numbers was measured: each was put into a sound model, which was loaded,
    initialised and asked for accelerations. Where nothing is said, OpenSim computes with the
    number.

    Attributes:
        states: names of its state variables, in OpenSim's order; a class that names none has those
            of its base. A component has ``name?flag`` if that property is true, ``name?!flag`` if
            it is false.
        outputs: what it adds to the outputs of its base, as OpenSim lists them: ``[]`` marks an
            output with channels, and a type follows the name unless it is a number.
        domains: by property, the numbers that OpenSim takes in this class, where they are fewer
            than for others that share the property, or than its declaration says.
        refused: properties for which OpenSim refuses the model where a number is outside its
            domain.
        outside: what else happens with a number outside its domain, with the properties of which
            this is so.
        zero: likewise with 0 alone; it goes before the others, and without a text OpenSim computes
            with 0.
        missing: likewise without a number where there is no default.
        doubts: by property, what is doubtful about a number outside its domain that OpenSim
            computes with.
        mujoco: of a muscle, the properties that numbers of MuJoCo's muscle are read from, by
            MuJoCo's names (vmax, fvmax) or rise and fall, the time constants; a dot leads into the
            object that a property holds. What is not named here its base has.
        scales: by property, what it is multiplied by when the model is scaled: by the factors of a
            body along its axes, of which the word says whose they are (OWN the frame itself, HOLDER
            the frame that holds the object, or the socket that leads to a frame, or the coordinate
            of whose joint it is the parent frame), and a word behind it which one (x, y, z; MEAN;
            ALONG and ACROSS the Z axis of a surface, AXES of its three); or by how much longer the
            path has become (PATH), or by nothing. What is not named here its base has.
    """

    states: str = ""
    outputs: str = ""
    domains: Mapping[str, str] = _NONE
    refused: str = ""
    outside: Mapping[str, str] = _NONE
    zero: Mapping[str, str] = _NONE
    missing: Mapping[str, str] = _NONE
    doubts: Mapping[str, str] = _NONE
    mujoco: Mapping[str, str] = _NONE
    scales: Mapping[str, str] = _NONE
