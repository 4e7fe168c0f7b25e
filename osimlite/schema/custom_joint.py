"""CustomJoint, whose motion is given by six functions of its coordinates."""

from collections.abc import Mapping
from typing import Annotated, Any

from osimlite.schema.base import Object, make_default
from osimlite.schema.facts import Facts
from osimlite.schema.fields import Single, Unnamed, Vec3, vec3
from osimlite.schema.functions import Constant, Function, LinearFunction
from osimlite.schema.joints import Joint
from osimlite.schema.references import OwnJointCoordinates
from osimlite.schema.specs import FieldSpec

_X, _Y, _Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
_AXES = "rotation1", "rotation2", "rotation3", "translation1", "translation2", "translation3"


class TransformAxis(Object):
    """A rotation about or a translation along an axis, by a function of coordinates of the joint."""

    coordinates: OwnJointCoordinates = ()
    """Coordinates of the joint that are the arguments of `function`, in this order."""
    axis: Annotated[Vec3, vec3()] = _X
    """Direction of the axis; its length does not matter."""
    function: Single[Function] = make_default(Constant, name="function")
    """Angle (rad) or displacement (m) as a function of the coordinates."""

    @property
    def names(self) -> list[str]:
        """Names of the coordinates on which the function depends."""
        return [word if isinstance(word, str) else word.name for word in self.coordinates]

    @classmethod
    def replace_empty_function(cls, spec: FieldSpec, values: Mapping[str, Any]) -> Function:
        """Return the function of an axis whose element ``<function>`` is empty.

        The axis then moves as its only coordinate does. Without the element the axis does not move. With
        several coordinates OpenSim rejects the model.

        Args:
            spec: declaration of the property ``function``.
            values: other properties of the axis.
        """
        if len(values.get("coordinates", ())) == 1:
            return LinearFunction(name=spec.tag, coefficients=(1.0, 0.0))
        return Constant(name=spec.tag)


def _make_axis(name: str, direction: Vec3) -> Any:
    return make_default(TransformAxis, name=name, axis=direction)


class SpatialTransform(Object):
    """Three body-fixed rotations in order, then three translations along axes of the parent frame."""

    rotation1: Single[TransformAxis] = _make_axis("rotation1", _X)
    """First rotation, about an axis of the parent frame."""
    rotation2: Single[TransformAxis] = _make_axis("rotation2", _Y)
    """Second rotation, about an axis that the first has turned."""
    rotation3: Single[TransformAxis] = _make_axis("rotation3", _Z)
    """Third rotation, about an axis that the first two have turned."""
    translation1: Single[TransformAxis] = _make_axis("translation1", _X)
    """First translation, along an axis of the parent frame that no rotation turns."""
    translation2: Single[TransformAxis] = _make_axis("translation2", _Y)
    """Second translation, along an axis of the parent frame that no rotation turns."""
    translation3: Single[TransformAxis] = _make_axis("translation3", _Z)
    """Third translation, along an axis of the parent frame that no rotation turns."""

    def axes(self) -> dict[str, TransformAxis]:
        """Return the six axes in order: three rotations, then three translations.

        Returns:
            Axes by name.
        """
        return {name: getattr(self, name) for name in _AXES}


class CustomJoint(Joint):
    """Any motion of up to six degrees of freedom, given by functions of the coordinates in `spatial_transform`."""

    facts = Facts(scales={"spatial_transform": "socket_parent_frame"})

    spatial_transform: Unnamed[SpatialTransform] = make_default(SpatialTransform)
    """Rotations and translations of the joint as functions of the coordinates."""
