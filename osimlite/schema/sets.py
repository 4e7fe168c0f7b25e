"""Sets: the lists a model is made of, and named groups of their members."""

from osimlite.schema.base import ModelComponent, Object, none
from osimlite.schema.fields import LegacyMany
from osimlite.schema.references import SetMemberNames


class ObjectGroup(Object):
    """A named selection of the members of the set it belongs to."""

    members: SetMemberNames = ()
    """Names of the members that the selection holds."""


class ModelComponentSet(ModelComponent, abstract=True):
    """A set with a place in the component tree; there it is always called by its class name in lower case."""


class ComponentSet(ModelComponentSet):
    """Further components of a model."""

    objects: LegacyMany[ModelComponent] = none()
    """Components of any class that no other set takes, such as reporters."""
    groups: LegacyMany[ObjectGroup] = none()
    """Named selections of the components; the mechanics ignore them."""
