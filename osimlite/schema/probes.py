"""Probes, which report quantities of a simulation: what all have in common."""

from typing import Annotated

from osimlite.schema.base import ModelComponent, none
from osimlite.schema.fields import Flag, LegacyMany, Number, Reals, reals, word
from osimlite.schema.sets import ModelComponentSet, ObjectGroup


class Probe(ModelComponent, abstract=True):
    """Something measured along a simulation, possibly integrated or differentiated, times `gain`."""

    enabled: Flag = True
    probe_operation: Annotated[
        str, word("value", "integrate", "differentiate", "minimum", "minabs", "maximum", "maxabs")
    ] = "value"
    initial_conditions_for_integration: Annotated[Reals, reals()] = ()
    gain: Number = 1.0


class ProbeSet(ModelComponentSet):
    """The probes of a model."""

    objects: LegacyMany[Probe] = none()
    groups: LegacyMany[ObjectGroup] = none()
