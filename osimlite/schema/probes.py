"""Probes: quantities a simulation reports."""

from __future__ import annotations

from typing import Annotated

from osimlite.schema.base import ModelComponent, none
from osimlite.schema.fields import Flag, LegacyMany, Number, Reals, Value, reals
from osimlite.schema.sets import ModelComponentSet, ObjectGroup


class Probe(ModelComponent, abstract=True):
    """Something measured along a simulation, possibly integrated or differentiated."""

    enabled: Flag = True
    probe_operation: Annotated[
        str, Value("string", choices=("value", "differentiate", "integrate", "minimum", "maximum"))
    ] = "value"
    initial_conditions_for_integration: Annotated[Reals, reals()] = ()
    gain: Number = 1.0


class ProbeSet(ModelComponentSet):
    """The probes of a model."""

    objects: LegacyMany[Probe] = none()
    groups: LegacyMany[ObjectGroup] = none()
