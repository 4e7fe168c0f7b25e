"""Constraints between bodies or coordinates: what all have in common."""

from osimlite.schema.base import ModelComponent, none
from osimlite.schema.fields import Flag, LegacyMany
from osimlite.schema.sets import ModelComponentSet, ObjectGroup


class Constraint(ModelComponent, abstract=True):
    """A condition on positions that the motion keeps, while `isEnforced`."""

    isEnforced: Flag = True


class ConstraintSet(ModelComponentSet):
    """The constraints of a model."""

    objects: LegacyMany[Constraint] = none()
    groups: LegacyMany[ObjectGroup] = none()
