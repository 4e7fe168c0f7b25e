"""Constraints between bodies or coordinates: what all have in common."""

from osimlite.schema.base import ModelComponent, none
from osimlite.schema.fields import Flag, LegacyMany
from osimlite.schema.sets import ModelComponentSet


class Constraint(ModelComponent, abstract=True):
    """A condition that the motion keeps."""

    isEnforced: Flag = True
    """Whether the constraint holds during a simulation."""


class ConstraintSet(ModelComponentSet):
    """The constraints of a model."""

    objects: LegacyMany[Constraint] = none()
    """The constraints; one that is not enforced does nothing."""
