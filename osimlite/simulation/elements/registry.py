"""Tables of the modules that declare how components are computed, and access to the declarations.

A table names the module of every class. The module is imported when a model first has a component
of that class, because models rarely need more than a few of them. It then registers its
declarations::

    register_force_type(ForceType(PathSpring, ...))

To add a class, add its line to the table and register its declaration in that module.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import cache
from importlib import import_module
from typing import Any, TypeVar

from osimlite.base.load import make_module_name

T = TypeVar("T")


class Registry:
    """Declarations of one sort, by the names of the component classes that they belong to.

    Args:
        modules: names of modules, each with the names of its classes, separated by spaces; a name
            that begins with a dot is relative to this package.

    Attributes:
        modules: module that declares each class, by the name of the class.
    """

    def __init__(self, modules: Mapping[str, str]) -> None:
        self.modules = {name: module for module, names in modules.items() for name in names.split()}
        self._declarations: dict[str, Any] = {}

    def register(self, component: type, declaration: T) -> T:
        """Register the declaration of a class.

        Returns:
            The same declaration.

        Raises:
            TypeError: no table names the class.
        """
        name = component.__name__
        if name not in self.modules:
            raise TypeError(f"no table of {__name__} names the class {name}; add it to one")
        self._declarations[name] = declaration
        return declaration

    def find(self, component: type | str) -> Any:
        """Return the declaration of a class.

        Args:
            component: the class, or its name.

        Returns:
            The declaration; None if no table names the class.
        """
        name = component if isinstance(component, str) else component.__name__
        module = self.modules.get(name)
        if module is None:
            return None
        # Modules register their declarations when they are imported.
        if name not in self._declarations:
            import_module(module, __package__)
        return self._declarations[name]

    def __iter__(self) -> Iterator[Any]:
        """Return an iterator over all declarations, sorted by the names of their kernels."""
        return map(self.find, sorted(self.modules, key=kernel_name))

    def find_kernel(self, name: str) -> Any:
        """Return the declaration whose kernel has a name, or None."""
        for component in self.modules:
            if kernel_name(component) == name:
                return self.find(component)
        return None

    def module_of(self, component: type) -> str:
        """Return the absolute name of the module that declares a class."""
        module = self.modules[component.__name__]
        return f"{__package__}{module}" if module.startswith(".") else module


FORCE_TYPES = Registry(
    {
        ".force_types.actuators": "ActivationCoordinateActuator BodyActuator CoordinateActuator McKibbenActuator"
        " PathActuator PointActuator PointToPointActuator TorqueActuator",
        ".force_types.bushings": "BushingForce ExpressionBasedBushingForce FunctionBasedBushingForce",
        ".force_types.coordinate_forces": "CoordinateLinearStopForce ExponentialCoordinateLimitForce"
        " ExpressionBasedCoordinateForce SpringGeneralizedForce",
        ".force_types.coordinate_limit": "CoordinateLimitForce",
        ".force_types.millard_muscles": "Millard2012AccelerationMuscle Millard2012EquilibriumMuscle",
        ".force_types.old_muscles": "Delp1990Muscle_Deprecated Schutte1993Muscle_Deprecated",
        ".force_types.old_thelen_muscle": "Thelen2003Muscle_Deprecated",
        ".force_types.path_forces": "Blankevoort1991Ligament ClutchedPathSpring ExpressionBasedPathForce Ligament"
        " PathSpring",
        ".force_types.point_forces": "ExpressionBasedPointToPointForce PointToPointSpring PrescribedForce",
        ".force_types.rigid_tendon_muscle": "RigidTendonMuscle",
        ".force_types.smooth_contacts": "MeyerFregly2016Force SmoothSphereHalfSpaceForce",
        ".force_types.smooth_muscles": "DeGrooteFregly2016Muscle MeyerFregly2016Muscle",
        ".force_types.thelen_muscle": "Thelen2003Muscle",
        ".contact": "HuntCrossleyForce",
        ".external_loads": "ExternalForce",
        ".foundation": "ElasticFoundationForce",
    }
)
"""Force types, which compute and apply the forces of a class."""

PROBE_TYPES = Registry(
    {
        ".mechanical_probes": "ActuatorForceProbe ActuatorPowerProbe JointInternalPowerProbe SystemEnergyProbe",
        ".metabolic_probes": "Bhargava2004MuscleMetabolicsProbe Bhargava2004SmoothedMuscleMetabolics"
        " Umberger2010MuscleMetabolicsProbe",
    }
)
"""Probe types, which compute the results of a class of probes."""

CONTROLLERS = Registry(
    {
        ".control_sets": "ControlSetController",
        ".controllers": "PrescribedController ToyPropMyoController ToyReflexController",
        ".synergies": "SynergyController",
    }
)
"""Functions that yield the drives of a controller, called with the builder and the controller."""

PATHS = Registry(
    {
        ".geometries.paths.function_based_path": "FunctionBasedPath",
        ".geometries.paths.geometry_path": "GeometryPath",
        ".geometries.paths.scholz2015_geometry_path": "Scholz2015GeometryPath",
    }
)
"""Functions that read the path of a component, called with the builder and the owner of the path."""


def register_force_type(declaration: T) -> T:
    """Register a force type, or a class of elements, under the class in its attribute `component`.

    Returns:
        The same declaration.
    """
    component: type = declaration.component  # type: ignore[attr-defined]
    return FORCE_TYPES.register(component, declaration)


def register_probe_type(declaration: T) -> T:
    """Register a probe type under the class in its attribute `component`.

    Returns:
        The same declaration.
    """
    component: type = declaration.component  # type: ignore[attr-defined]
    return PROBE_TYPES.register(component, declaration)


def register_controller(component: type) -> Callable[[T], T]:
    """Return a decorator that registers the function for a class of controllers."""
    return lambda function: CONTROLLERS.register(component, function)


def register_path(component: type) -> Callable[[T], T]:
    """Return a decorator that registers the function for a class of paths."""
    return lambda function: PATHS.register(component, function)


@cache
def kernel_name(component: str) -> str:
    """Return the name of the kernel that computes the components of a class.

    Args:
        component: name of the class.

    Returns:
        The name in snake case: `path_spring` for PathSpring.
    """
    return make_module_name(component)
