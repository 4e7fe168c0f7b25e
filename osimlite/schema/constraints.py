"""Constraints between bodies or coordinates."""

from __future__ import annotations

from osimlite.schema.base import ModelComponent, none
from osimlite.schema.fields import Flag, LegacyMany
from osimlite.schema.sets import ModelComponentSet, ObjectGroup


class Constraint(ModelComponent, abstract=True):
    """A condition on positions that the motion keeps, while `isEnforced`."""

    isEnforced: Flag = True  # noqa: N815 - OpenSim's own property name


class ConstraintSet(ModelComponentSet):
    """The constraints of a model."""

    objects: LegacyMany[Constraint] = none()
    groups: LegacyMany[ObjectGroup] = none()
