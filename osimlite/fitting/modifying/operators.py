"""OpenSim's operators on models: one function for each class, and ModelProcessor.

The results are those of OpenSim's ModelProcessor, including names and order.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from osimlite.base.text import add_article, suggest_name
from osimlite.errors import ModelError, UnsupportedError
from osimlite.io.document.cache import read_copy
from osimlite.io.document.reader import read_document
from osimlite.io.document.source import Source
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.constraints import Coupler
from osimlite.schema.actuators import CoordinateActuator
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.forces import Force
from osimlite.schema.frames import Ground, PhysicalOffsetFrame
from osimlite.schema.joints import Joint, WeldJoint
from osimlite.schema.millard_muscles import Millard2012EquilibriumMuscle
from osimlite.schema.model import Model
from osimlite.schema.muscles import Muscle, PathActuator, Thelen2003Muscle
from osimlite.schema.prescribed import ExternalLoads
from osimlite.schema.smooth_muscles import DeGrooteFregly2016Muscle
from osimlite.schema.tools import processors as p
from osimlite.schema.tools.processors import ModelOperator, ModelProcessor

GREY = (0.5, 0.5, 0.5)
"""Color of paths that belonged to muscles."""
COMMON_PROPERTIES = (
    "appliesForce",
    "min_control",
    "max_control",
    "max_isometric_force",
    "optimal_fiber_length",
    "tendon_slack_length",
    "pennation_angle_at_optimal",
    "max_contraction_velocity",
    "ignore_tendon_compliance",
    "ignore_activation_dynamics",
)
"""Properties that muscles of all classes have."""

Operation = Callable[[Model, Any, Path], None]
"""Function that changes a model by an operator; files are resolved from a folder."""
OPERATIONS: dict[type, Operation] = {}
"""Operations by class of the operator."""


def register_operation(cls: type) -> Callable[[Operation], Operation]:
    """Return a decorator that registers the operation of an operator."""

    def register(function: Operation) -> Operation:
        OPERATIONS[cls] = function
        return function

    return register


def find_muscles(model: Model) -> list[Muscle]:
    """Return the muscles in the model's set of forces, in its order."""
    return [force for force in model.force_set.objects if isinstance(force, Muscle)]


SETTINGS: dict[type, tuple[type[Muscle], str, Callable[[Any, Any], object]]] = {
    p.ModOpIgnoreActivationDynamics: (
        Muscle,
        "ignore_activation_dynamics",
        lambda operator, old: True,
    ),
    p.ModOpIgnoreTendonCompliance: (Muscle, "ignore_tendon_compliance", lambda operator, old: True),
    p.ModOpScaleMaxIsometricForce: (
        Muscle,
        "max_isometric_force",
        lambda operator, old: old * operator.scale_factor,
    ),
    p.ModOpIgnorePassiveFiberForcesDGF: (
        DeGrooteFregly2016Muscle,
        "ignore_passive_fiber_force",
        lambda operator, old: True,
    ),
    p.ModOpScaleActiveFiberForceCurveWidthDGF: (
        DeGrooteFregly2016Muscle,
        "active_force_width_scale",
        lambda operator, old: operator.scale_factor,
    ),
    p.ModOpTendonComplianceDynamicsModeDGF: (
        DeGrooteFregly2016Muscle,
        "tendon_compliance_dynamics_mode",
        lambda operator, old: operator.mode,
    ),
}
"""Operators that set a property of muscles.

Each has the class of the muscles, the property, and a function of the operator and the old value.
"""


def _set_muscle_property(model: Model, operator: Any, folder: Path) -> None:
    """Set a property of muscles; see `SETTINGS`."""
    muscle_class, name, compute_value = SETTINGS[type(operator)]
    for muscle in model.components(muscle_class):
        setattr(muscle, name, compute_value(operator, getattr(muscle, name)))


OPERATIONS.update(dict.fromkeys(SETTINGS, _set_muscle_property))


@register_operation(p.ModOpRemoveMuscles)
def _remove_muscles(model: Model, operator: Any, folder: Path) -> None:
    """Remove all muscles from the set of forces and from its groups."""
    for muscle in find_muscles(model):
        _remove_muscle(model, muscle)


@register_operation(p.ModOpReplaceMusclesWithPathActuators)
def _replace_with_path_actuators(model: Model, operator: Any, folder: Path) -> None:
    """Replace all muscles by path actuators."""
    for muscle in find_muscles(model):
        actuator = PathActuator(name=muscle.name, optimal_force=muscle.max_isometric_force)
        # Other properties of a muscle mean nothing for a path actuator.
        for name in ("appliesForce", "min_control", "max_control"):
            setattr(actuator, name, getattr(muscle, name))
        _replace_muscle(model, muscle, actuator)
        if hasattr(actuator.geometry_path, "appearance"):
            actuator.geometry_path.appearance.color = GREY


@register_operation(p.ModOpReplaceMusclesWithDeGrooteFregly2016)
def _replace_with_degroote(model: Model, operator: Any, folder: Path) -> None:
    """Replace Thelen's and Millard's muscles by DeGrooteFregly2016Muscle.

    Raises:
        UnsupportedError: a muscle is of another class.
    """
    for muscle in find_muscles(model):
        properties: dict[str, Any] = {name: getattr(muscle, name) for name in COMMON_PROPERTIES}
        if isinstance(muscle, Millard2012EquilibriumMuscle):
            properties |= {
                "fiber_damping": muscle.fiber_damping,
                "passive_fiber_strain_at_one_norm_force": muscle.FiberForceLengthCurve.strain_at_one_norm_force,
                "tendon_strain_at_one_norm_force": muscle.TendonForceLengthCurve.strain_at_one_norm_force,
            }
        elif isinstance(muscle, Thelen2003Muscle):
            properties |= {
                # Thelen's muscle has no damping.
                "fiber_damping": 0.0,
                "passive_fiber_strain_at_one_norm_force": muscle.FmaxMuscleStrain,
                "tendon_strain_at_one_norm_force": muscle.FmaxTendonStrain,
            }
        else:
            raise UnsupportedError(
                f"'{muscle.name}' is {add_article(type(muscle).__name__)}, which no "
                "DeGrooteFregly2016Muscle replaces with the same behavior; Thelen2003Muscle and "
                "Millard2012EquilibriumMuscle can be replaced"
            )
        for name in (
            "default_activation",
            "activation_time_constant",
            "deactivation_time_constant",
        ):
            properties[name] = getattr(muscle, name)
        _replace_muscle(model, muscle, DeGrooteFregly2016Muscle(name=muscle.name, **properties))


def _replace_muscle(model: Model, muscle: Muscle, replacement: Any) -> None:
    """Replace a muscle by another force along its path, as the last force, as OpenSim does."""
    replacement.geometry_path = muscle.geometry_path.copy_deep()
    _remove_muscle(model, muscle)
    model.force_set.objects.append(replacement)


def _remove_muscle(model: Model, muscle: Muscle) -> None:
    """Remove a muscle from the set of forces and from its groups.

    Its replacement does not join the groups, as in OpenSim.
    """
    model.force_set.objects.remove(muscle)
    for group in model.force_set.groups:
        names = [
            str(getattr(member, "name", member)).rpartition("/")[2] for member in group.members
        ]
        group.members = tuple(
            member for member, name in zip(group.members, names, strict=True) if name != muscle.name
        )


@register_operation(p.ModOpAddReserves)
def _add_reserves(model: Model, operator: p.ModOpAddReserves, folder: Path) -> None:
    """Add reserve actuators for coordinates.

    Raises:
        ModelError: the optimal force is not positive, or the bound is negative.
    """
    if operator.optimal_force <= 0.0:
        raise ModelError(
            f"reserve actuators have an optimal_force of {operator.optimal_force:g}; set a "
            "positive one"
        )
    if operator.bound is not None and operator.bound < 0.0:
        raise ModelError(
            f"reserve actuators have a bound of {operator.bound:g}; set one that is not negative"
        )
    tree = model.tree()
    mechanism = build_mechanism(model)
    driven_paths = {tree.path_of(component) for component in _find_driven_coordinates(model)}
    dependent = {
        component.dependent for component in mechanism.constraints if isinstance(component, Coupler)
    }
    fixed_paths = {
        info.path
        for index, info in enumerate(mechanism.coordinates)
        if info.locked or info.prescribed is not None or index in dependent
    }
    for coordinate in list(model.components(Coordinate)):
        path = tree.path_of(coordinate) or ""
        # A reserve on a coordinate that cannot move by itself would do nothing.
        if path in fixed_paths or (
            operator.skip_coordinates_with_actuators and path in driven_paths
        ):
            continue
        if operator.skip_residual_coordinates and _is_on_ground(model, path):
            continue
        control_bounds: dict[str, Any] = (
            {}
            if operator.bound is None
            else {"min_control": -operator.bound, "max_control": operator.bound}
        )
        reserve = CoordinateActuator(
            # OpenSim's name, by which users select reserves in results.
            name="reserve" + path.replace("/", "_"),
            coordinate=coordinate.name,
            optimal_force=operator.optimal_force,
            **control_bounds,
        )
        model.force_set.objects.append(reserve)


def _find_driven_coordinates(model: Model) -> list[Any]:
    """Return the coordinates that an actuator drives."""
    names = {actuator.coordinate for actuator in model.components(CoordinateActuator)}
    return [coordinate for coordinate in model.components(Coordinate) if coordinate.name in names]


def _is_on_ground(model: Model, path: str) -> bool:
    """Return whether a coordinate belongs to a joint to ground."""
    joint = model.tree().find(path.rpartition("/")[0])
    return isinstance(_find_base(model, joint, "socket_parent_frame"), Ground)


def _find_base(model: Model, component: Any, socket: str) -> Any:
    """Return the body, or ground, to which the frame of a socket is fixed."""
    tree = model.tree()
    frame: Any = tree.target(component, socket, getattr(component, socket))
    # An offset frame may be fixed to another one.
    while isinstance(frame, PhysicalOffsetFrame):
        frame = tree.target(frame, "socket_parent", frame.socket_parent)
    return frame


@register_operation(p.ModOpReplaceJointsWithWelds)
def _replace_joints_with_welds(
    model: Model, operator: p.ModOpReplaceJointsWithWelds, folder: Path
) -> None:
    """Replace joints by weld joints.

    Raises:
        ModelError: the model has no joint of a given path or name.
    """
    for path in map(str, operator.joint_paths):
        tree = model.tree()
        joints = {tree.path_of(existing) or "": existing for existing in model.components(Joint)}
        names = {existing.name: existing for existing in joints.values()}
        joint = joints.get(path) or names.get(path) or names.get(path.rpartition("/")[2])
        if joint is None:
            raise ModelError(
                f"the model has no joint '{path}'{suggest_name(path, [*joints, *names])}"
            )
        # Joints may be connected to frames of other components, which the weld leaves as they are.
        frames: list[PhysicalOffsetFrame] = []
        for socket in ("socket_parent_frame", "socket_child_frame"):
            frame = tree.target(joint, socket, getattr(joint, socket))
            base = _find_base(model, joint, socket)
            offset = PhysicalOffsetFrame(
                name=f"{base.name}_offset", socket_parent=tree.path_of(base) or ""
            )
            if isinstance(frame, PhysicalOffsetFrame):
                offset.translation = frame.translation
                offset.orientation = frame.orientation
            frames.append(offset)
        parent_name, child_name = (frame.name for frame in frames)
        weld = WeldJoint(
            name=joint.name,
            socket_parent_frame=parent_name,
            socket_child_frame=child_name,
            frames=frames,
        )
        model.joint_set.objects.remove(joint)
        # OpenSim puts the weld at the end of the set.
        model.joint_set.objects.append(weld)


@register_operation(p.ModOpReplacePathsWithFunctionBasedPaths)
def _replace_with_function_paths(
    model: Model, operator: p.ModOpReplacePathsWithFunctionBasedPaths, folder: Path
) -> None:
    """Replace paths by the function-based paths of a file."""
    path_set = read_document(
        Source.from_file(folder / operator.paths_file.strip()),
        expected_class=p.FunctionBasedPathSet,
    ).top
    replace_paths(model, path_set.objects)


def replace_paths(model: Model, paths: Any) -> None:
    """Replace the paths of forces.

    Args:
        model: model to change in place.
        paths: new paths, each named by the path of its force.

    Raises:
        ModelError: there is no such force, or it has no path.
    """
    forces = {model.tree().path_of(force) or "": force for force in model.components(Force)}
    for path in paths:
        force = forces.get(path.name)
        if force is None or not hasattr(force, "geometry_path"):
            raise ModelError(
                "the model has no force with a path "
                f"'{path.name}'{suggest_name(path.name, [*forces])}"
            )
        force.geometry_path = path.copy_deep()
        # In its file the name of a path says to which force it belongs.
        force.geometry_path.name = "path"


@register_operation(p.ModOpAddExternalLoads)
def _add_external_loads(model: Model, operator: p.ModOpAddExternalLoads, folder: Path) -> None:
    """Add external loads of a file to the model."""
    file = folder / operator.filepath.strip()
    loads = read_document(Source.from_file(file), expected_class=ExternalLoads).top
    assert isinstance(loads, ExternalLoads)
    loads.name = "externalloads"  # OpenSim drops the name in the file.
    # The model is in another folder than the loads.
    loads.datafile = str((file.parent / loads.datafile.strip()).absolute())
    model.add(loads)


def process_model(processor: ModelProcessor, folder: str | Path = ".") -> Model:
    """Return the model of a processor, changed by its operators.

    Args:
        processor: processor of a study or a tool.
        folder: folder of its document, from which its paths start.

    Raises:
        DocumentError: a file is missing or has another class.
        ModelError: the processor has no model, or an operator has an unknown name.
        UnsupportedError: an operator cannot be applied.
    """
    name = processor.filepath.strip()
    if name:
        model = read_copy(Path(folder) / name, Model)
    elif processor.model is not None:
        model = processor.model.copy_deep()
    else:
        raise ModelError("a ModelProcessor has neither a filepath nor a model; set one of them")
    apply_operators(model, processor.operators, folder)
    return model


def apply_operators(
    model: Model, operators: Iterable[ModelOperator], folder: str | Path = "."
) -> None:
    """Change a model by operators, in their order.

    Args:
        model: model to change in place.
        operators: operators to apply.
        folder: folder from which paths start.

    Raises:
        UnsupportedError: osimlite does not support the class of an operator.
        OsimliteError: an operator cannot be applied, see :func:`process_model`.
    """
    for operator in operators:
        operation = OPERATIONS.get(type(operator))
        if operation is None:
            name = getattr(operator, "class_name", "") or type(operator).__name__
            known_names = ", ".join(cls.__name__ for cls in OPERATIONS)
            raise UnsupportedError(f"osimlite cannot apply a {name}; it supports {known_names}")
        operation(model, operator, Path(folder))
