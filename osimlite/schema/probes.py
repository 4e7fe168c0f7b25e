"""Probes, which report quantities of a simulation: what all have in common."""

from typing import Annotated

from osimlite.schema.base import ModelComponent, none
from osimlite.schema.facts import Facts
from osimlite.schema.fields import Flag, LegacyMany, Number, Reals, reals, word
from osimlite.schema.sets import ModelComponentSet


class Probe(ModelComponent, abstract=True):
    """Something measured along a simulation, possibly integrated or differentiated, times `gain`."""

    facts = Facts(outputs="probe_outputs:Vector")

    enabled: Flag = True
    """Whether the probe is computed and reported."""
    probe_operation: Annotated[
        str, word("value", "integrate", "differentiate", "minimum", "minabs", "maximum", "maxabs")
    ] = "value"
    """What is reported of the quantity: itself, its integral, its rate, or its extreme so far."""
    initial_conditions_for_integration: Annotated[Reals, reals()] = ()
    """Where the integrals start, one number for each quantity of the probe."""
    gain: Number = 1.0
    """Factor of what is reported."""


class ProbeSet(ModelComponentSet):
    """The probes of a model."""

    objects: LegacyMany[Probe] = none()
    """The probes; tools write their values to a file."""
