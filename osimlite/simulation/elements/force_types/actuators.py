"""Actuators that apply their control, scaled by an optimal force, to a coordinate, a body, points or a path."""

from osimlite.mechanics.laws.springs import mckibben_tension
from osimlite.schema.actuators import (
    ActivationCoordinateActuator,
    BodyActuator,
    CoordinateActuator,
    PointActuator,
    PointToPointActuator,
    TorqueActuator,
)
from osimlite.schema.muscles import PathActuator
from osimlite.schema.path_forces import McKibbenActuator
from osimlite.simulation.elements.force_type import ForceType, State
from osimlite.simulation.elements.geometries.body import AXIS, BODY, POINT, POINTS
from osimlite.simulation.elements.geometries.coordinate import COORDINATE
from osimlite.simulation.elements.geometries.geometry import ForceGeometry
from osimlite.simulation.elements.geometries.path import PATH
from osimlite.simulation.elements.parameters import Number, require_positive
from osimlite.simulation.elements.registry import register_force_type


def scale_control(control: float, optimal_force: float) -> float:
    """Return the force F x of an ideal actuator.

    Args:
        control: x.
        optimal_force: F, N or N.m.

    Returns:
        Force (N) or torque (N.m).
    """
    return optimal_force * control


def define_actuator(component: type, geometry: ForceGeometry, output: str) -> ForceType:
    """Return the force type of an actuator whose output is its control times its optimal force.

    Args:
        component: class of the actuator.
        geometry: geometry that applies the output.
        output: name of the output that the geometry applies.

    Returns:
        Declaration of the class, which still has to be registered.
    """
    return ForceType(
        component,
        geometry,
        scale_control,
        inputs=(),
        outputs=(output,),
        parameters=("optimal_force",),
        has_control=True,
        labels={"{name}": output},
    )


register_force_type(define_actuator(CoordinateActuator, COORDINATE, "force"))


def scale_activation(
    control: float, activation: float, optimal_force: float, time: float
) -> tuple[float, float]:
    """Return force F a and activation rate (x - a) / T of first-order activation dynamics.

    Args:
        control: x.
        activation: a.
        optimal_force: F, N.m or N.
        time: time constant T, s.

    Returns:
        Force (N.m, N) and rate of the activation (1/s).
    """
    return optimal_force * activation, (control - activation) / time


register_force_type(
    ForceType(
        ActivationCoordinateActuator,
        COORDINATE,
        scale_activation,
        inputs=(),
        outputs=("force", "activation_rate"),
        parameters=("optimal_force", require_positive("activation_time_constant")),
        has_control=True,
        states=(State("activation"),),
        labels={"{name}": "force"},
        states_change_when_off=True,
    )
)


register_force_type(define_actuator(TorqueActuator, AXIS, "torque"))


register_force_type(define_actuator(PointActuator, POINT, "force"))


register_force_type(define_actuator(PointToPointActuator, POINTS, "force"))


def pass_controls(
    tx: float, ty: float, tz: float, fx: float, fy: float, fz: float
) -> tuple[float, float, float, float, float, float]:
    """Return the six controls of a BodyActuator, which are its loads.

    Returns:
        Torque (N.m) and force (N).
    """
    return tx, ty, tz, fx, fy, fz


register_force_type(
    ForceType(
        BodyActuator,
        BODY,
        pass_controls,
        outputs=("tx", "ty", "tz", "fx", "fy", "fz"),
        has_control=True,
        labels={},
    )
)


register_force_type(define_actuator(PathActuator, PATH, "tension"))


register_force_type(
    ForceType(
        McKibbenActuator,
        PATH,
        mckibben_tension,
        inputs=("length",),
        outputs=("tension",),
        parameters=(
            Number("number_of_turns", lambda value: value != 0.0, "is 0; give it another value"),
            "thread_length",
            "cord_length",
        ),
        has_control=True,
        labels={"{name}": "tension"},
    )
)
