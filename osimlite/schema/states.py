"""Variables of a model as tables and Moco name them: states, controls, generalized forces, outputs."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

from osimlite.base.named_tuples import NamedTuple
from osimlite.schema.base import Component
from osimlite.schema.specs import get_class_names

if TYPE_CHECKING:
    from osimlite.schema.joints import Joint, MotionType
    from osimlite.schema.tree import Tree


class Output(NamedTuple):
    """Type of an output, and whether it has channels."""

    type: str
    channels: bool


@cache
def list_outputs(cls: type[Component]) -> dict[str, Output]:
    """Return the outputs of a class.

    Returns:
        Outputs by name.
    """
    result: dict[str, Output] = {}
    for base in cls.__mro__:
        facts = base.__dict__.get("facts")
        for entry in facts.outputs.split() if facts is not None else ():
            name, _, kind = entry.partition(":")
            result[name.removesuffix("[]")] = Output(kind or "double", name.endswith("[]"))
    return result


def list_states(component: Component) -> list[str]:
    """Return the names of the state variables of one component, in OpenSim's order."""
    # A class without states of its own has those of its nearest base.
    state_texts = (
        base.__dict__["facts"].states
        for base in type(component).__mro__
        if "facts" in base.__dict__
    )
    entries = [entry.partition("?") for entry in next(filter(None, state_texts), "").split()]
    return [
        name
        for name, _, flag in entries
        if not flag or getattr(component, flag.lstrip("!")) != flag.startswith("!")
    ]


def list_motions(joint: Joint) -> dict[str, MotionType]:
    """Return how a joint moves with each of its coordinates.

    A coordinate of a CustomJoint is rotational or translational if it drives an axis with a slope
    of 1 or -1; otherwise it is coupled.

    Returns:
        Types of motion by the name of the coordinate.
    """
    names = [coordinate.name for coordinate in joint.coordinates]
    if joint.motion_types is not None:
        return dict(zip(names, joint.motion_types, strict=False))
    result: dict[str, MotionType] = dict.fromkeys(names, "coupled")
    transform: Any = getattr(joint, "spatial_transform", None)
    for axis_name, axis in transform.axes().items() if transform is not None else ():
        if type(axis.function).__name__ == "LinearFunction" and axis.function.coefficients[:1] in (
            (1.0,),
            (-1.0,),
        ):
            result |= dict.fromkeys(
                axis.names, "rotational" if axis_name.startswith("r") else "translational"
            )
    return result


def find_variables(tree: Tree, kind: str) -> dict[str, Component]:
    """Return the components of a model by the names of their variables.

    Args:
        tree: tree of the model.
        kind: ``state variable``, ``control``, ``state or control variable``, ``generalized force``
            or ``output``; for a class of components, their paths are the names.

    Returns:
        Components by name of the variable.
    """
    return tree.index_by_name(f"variables: {kind}", lambda: _iterate_variables(tree, kind))


def _iterate_variables(tree: Tree, kind: str) -> Any:
    """Yield names of a kind with their components: states, controls, outputs, forces, or a class."""
    for component in tree.components:
        path = tree.path_of(component)
        classes = get_class_names(type(component))
        if kind.startswith("state"):
            yield from ((f"{path}/{name}", component) for name in list_states(component))
        if kind.endswith(("control", "control variable")) and "Actuator" in classes:
            # A body actuator has one control for each component of torque and force.
            yield from (
                ((f"{path}_{number}", component) for number in range(6))
                if "BodyActuator" in classes
                else ((path, component),)
            )
        if kind == "generalized force" and "Joint" in classes:
            joint: Any = component
            motions = list_motions(joint)
            for coordinate in joint.coordinates:
                ending = "moment" if motions[coordinate.name] == "rotational" else "force"
                yield f"{coordinate.name}_{ending}", coordinate
        if kind == "output":
            yield from ((f"{path}|{name}", component) for name in list_outputs(type(component)))
        if kind in classes:
            yield path, component
