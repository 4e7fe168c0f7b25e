"""Sets: the lists a model is made of, and named groups of their members."""

from typing import TYPE_CHECKING, Any

from osimlite.schema.base import ModelComponent, Object, none
from osimlite.schema.fields import LegacyMany
from osimlite.schema.references import SetMemberNames

if TYPE_CHECKING:
    Member = Any  # each set says which: a list of bodies is not a list of objects
else:
    Member = Object


class ObjectGroup(Object):
    """A named selection of the members of the set it belongs to."""

    members: SetMemberNames = ()
    """Names of the members that the selection holds."""


class Set(Object, abstract=True):
    """Objects of one kind, each with a name of its own."""

    objects: LegacyMany[Member] = none()
    """The members."""
    groups: LegacyMany[ObjectGroup] = none()
    """Named selections of the members; the mechanics ignore them, and so do the tools."""


class ModelComponentSet(Set, ModelComponent, abstract=True):
    """A set with a place in the component tree; there it is always called by its class name in lower case."""


class ComponentSet(ModelComponentSet):
    """Further components of a model."""

    objects: LegacyMany[ModelComponent] = none()
    """Components of any class that no other set takes, such as reporters."""
