"""Muscles of MuJoCo as Millard muscles with fitted curves, or exactly as RigidTendonMuscles."""

from __future__ import annotations

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.function_types import ExpressionBasedFunction
from osimlite.schema.millard_muscles import Millard2012EquilibriumMuscle, RigidTendonMuscle
from osimlite.schema.muscles import Muscle
from osimlite.translate.fidelity import Error
from osimlite.translate.mjcf_import.draft import ConversionDraft, TendonPath
from osimlite.translate.mjcf_import.muscle_fits import FittedCurves, Shape, fit_curves

MIN_SLACK_M = 1e-4
"""Least tendon slack length; OpenSim requires one above 0."""
MAX_PASSIVE = 10.0
"""Passive force at which a RigidTendonMuscle cuts its curve off, as a part of the isometric force."""
DEFAULT_ACTIVATION = 0.01
"""Activation at the start. MuJoCo starts with 0, which OpenSim's muscle of De Groote does not accept."""
LONGEST_QUANTILE = 0.95
"""Quantile of the lengths in sampled poses up to which the passive curve is fitted."""
MAX_LENGTH = 4.0
"""Normalized length beyond which no passive curve is fitted."""
SPEEDS = (-0.5, -0.25, 0.0, 0.25, 0.5)
"""Normalized velocities at which forces are compared."""


class MuscleData(NamedTuple):
    """A muscle of MuJoCo as the numbers of a rigid-tendon muscle."""

    force: float  # maximum isometric force, N
    fiber: float  # optimal fiber length, m
    slack: float  # tendon slack length, m
    vmax: float  # maximum contraction velocity, optimal fiber lengths per second
    shape: Shape

    def replace_slack(self, slack: float) -> MuscleData:
        """Return the same muscle with another slack length.

        Parabolas of the fiber length stay parabolas if the length is measured from another origin,
        so that the curves are as exact as before.
        """
        fiber = self.fiber + self.slack - slack
        ratio = self.fiber / fiber
        shift = (self.slack - slack) / fiber
        shape = self.shape
        return MuscleData(
            self.force,
            fiber,
            slack,
            self.vmax * ratio,
            shape._replace(
                lmin=shape.lmin * ratio + shift,
                lmax=shape.lmax * ratio + shift,
                passive_start=shape.passive_start * ratio + shift,
                passive_width=shape.passive_width * ratio,
            ),
        )

    def tension(self, lengths: Array, speed: float, activation: float) -> Array:
        """Return MuJoCo's tension (N) at tendon lengths (m) and a normalized velocity."""
        x = (lengths - self.slack) / self.fiber
        factor = float(self.shape.velocity(np.array([speed]))[0])
        return self.force * (activation * self.shape.active(x) * factor + self.shape.passive(x))


def read_muscle(draft: ConversionDraft, actuator: int, gear: float, shift: float) -> MuscleData:
    """Return the numbers of a muscle, with lengths of the path.

    Args:
        draft: OpenSim model under construction.
        actuator: index of the actuator.
        gear: factor from the length of the path to MuJoCo's actuator length; positive.
        shift: number that was added to the path, m.
    """
    model = draft.mj
    gain, bias = model.actuator_gainprm[actuator], model.actuator_biasprm[actuator]
    shortest, longest = map(float, model.actuator_lengthrange[draft.get_output_index(actuator)])

    def lengths(numbers: Array) -> tuple[float, float]:
        # Two lengths of the path, at both ends of the normalized range, give fiber and tendon.
        fiber = (longest - shortest) / (float(numbers[1]) - float(numbers[0]))
        return fiber, shortest - float(numbers[0]) * fiber

    def strength(numbers: Array) -> float:
        force = float(numbers[2])
        # A negative force means that MuJoCo scales by the acceleration at unit force.
        return (
            force
            if force >= 0.0
            else float(numbers[3] / model.actuator_acc0[draft.get_output_index(actuator)])
        )

    fiber, slack = lengths(gain)
    # Active and passive curves may be scaled differently.
    passive_fiber, passive_slack = lengths(bias)
    force = strength(gain)
    passive_middle = 0.5 * (1.0 + float(bias[5]))
    start = (passive_slack + passive_fiber - slack) / fiber
    shape = Shape(
        float(gain[4]),
        float(gain[5]),
        float(gain[8]),
        start,
        (passive_middle - 1.0) * passive_fiber / fiber,
        float(bias[7]) * strength(bias) / force if force else 0.0,
    )
    return MuscleData(force * gear, fiber / gear, slack / gear + shift, float(gain[6]), shape)


def make_muscle(
    draft: ConversionDraft, actuator: int, path: TendonPath, gear: float, lengths: Array
) -> Muscle | None:
    """Make a muscle, and record the errors of its curves.

    Args:
        draft: OpenSim model under construction.
        actuator: index of the actuator.
        path: path of the muscle.
        gear: factor from the length of the path to MuJoCo's actuator length.
        lengths: lengths of the path that occur (P,), m.

    Returns:
        The muscle, not yet in the model; None if it cannot be made, which is recorded.
    """
    model = draft.mj
    if gear <= 0.0:
        draft.drop(
            "actuator", actuator, "a muscle with a gear that is not positive", f"gear {gear:g}"
        )
        return None
    data = read_muscle(draft, actuator, gear, path.shift)
    # NaN comes from ranges without a length.
    if not (
        np.all(np.isfinite((*data[:4], *data.shape)))
        and data.force > 0.0
        and data.fiber > 0.0
        and data.vmax > 0.0
        and data.shape.passive_width > 0.0
        and data.shape.lmin < 1.0 < data.shape.lmax
        and data.fiber + data.slack > MIN_SLACK_M
    ):
        draft.drop(
            "actuator",
            actuator,
            "a muscle whose lengths, force or curves are not positive",
            f"force {data.force:g} N, fiber length {data.fiber:g} m, tendon {data.slack:g} m",
        )
        return None
    detail = ""
    # The slack length moves into the fiber, which leaves the force as it is.
    if data.slack < MIN_SLACK_M:
        detail = f"; its tendon slack length of {data.slack:.4g} m is now part of the fiber"
        data = data.replace_slack(MIN_SLACK_M)
    name = draft.unique("force", draft.source.name_of("actuator", actuator))
    has_activation = int(model.actuator_dyntype[actuator]) == int(
        draft.source.mujoco.mjtDyn.mjDYN_MUSCLE
    )
    limits = (0.0, 1.0)
    if model.actuator_ctrllimited[draft.get_control_index(actuator)]:
        lower, upper = map(float, model.actuator_ctrlrange[draft.get_control_index(actuator)])
        # OpenSim's muscles have controls from 0 to 1.
        limits = max(lower, 0.0), min(upper, 1.0)
    if draft.options.muscle == "exact":
        return _make_exact(draft, actuator, name, path, data, has_activation, limits, detail)
    # Polynomial paths can have odd lengths in single poses, which must not decide.
    longest = float(np.quantile(lengths, LONGEST_QUANTILE) - data.slack) / data.fiber
    curves = fit_curves(data.shape, min(longest, MAX_LENGTH))
    active, velocity, passive = curves.components()
    muscle = Millard2012EquilibriumMuscle(
        name=name,
        geometry_path=path.path,
        max_isometric_force=data.force,
        optimal_fiber_length=data.fiber,
        tendon_slack_length=data.slack,
        pennation_angle_at_optimal=0.0,
        max_contraction_velocity=data.vmax,
        ignore_tendon_compliance=True,
        ignore_activation_dynamics=not has_activation,
        min_control=limits[0],
        max_control=limits[1],
        fiber_damping=0.0,
        default_activation=DEFAULT_ACTIVATION,
        default_fiber_length=data.fiber,
        minimum_activation=0.0,
        active_force_length_curve=active,
        force_velocity_curve=velocity,
        fiber_force_length_curve=passive,
    )
    if has_activation:
        muscle.activation_time_constant = float(model.actuator_dynprm[actuator, 0])
        muscle.deactivation_time_constant = float(model.actuator_dynprm[actuator, 1])
    draft.record(
        "actuator",
        actuator,
        "muscle curves of parabolas",
        "a Millard2012EquilibriumMuscle with a rigid tendon and fitted curves",
        f"optimal fiber length {data.fiber:.4g} m{detail}",
        {
            "force": Error.measure(_compare(data, curves, lengths), "F0"),
            **_curve_errors(data.shape, curves),
        },
    )
    _record_dynamics(draft, actuator, has_activation)
    return muscle


def _curve_errors(shape: Shape, curves: FittedCurves) -> dict[str, Error]:
    lengths, velocities = np.linspace(0.5, 1.5, 101), np.linspace(-1.0, 1.0, 101)
    active, passive, velocity = curves.evaluate(lengths, velocities)
    return {
        "active force-length": Error.measure(active - shape.active(lengths), "F0"),
        "passive force-length": Error.measure(passive - shape.passive(lengths), "F0"),
        "force-velocity": Error.measure(velocity - shape.velocity(velocities), "F0"),
    }


def _compare(data: MuscleData, curves: FittedCurves, lengths: Array) -> Array:
    """Return the errors of the tension at full activation, over the isometric force."""
    speeds = np.array(SPEEDS)
    active, passive, velocity = curves.evaluate((lengths - data.slack) / data.fiber, speeds)
    # Tension over the isometric force, in rows of speeds.
    fitted_tensions = active * velocity[:, None] + passive
    exact_tensions = [data.tension(lengths, speed, 1.0) / data.force for speed in SPEEDS]
    return (fitted_tensions - np.array(exact_tensions)).ravel()


def _make_exact(
    draft: ConversionDraft,
    actuator: int,
    name: str,
    path: TendonPath,
    data: MuscleData,
    has_activation: bool,
    limits: tuple[float, float],
    detail: str,
) -> RigidTendonMuscle:
    """Make a muscle with MuJoCo's curves as formulas.

    Returns:
        Muscle with a rigid tendon and without activation dynamics.
    """
    curves = [
        ExpressionBasedFunction(name=curve_name, expression=formula, variables=("x",))
        for curve_name, formula in zip(
            ("active_force_length_curve", "passive_force_length_curve", "force_velocity_curve"),
            data.shape.formulas(),
            strict=True,
        )
    ]
    muscle = RigidTendonMuscle(
        name=name,
        geometry_path=path.path,
        max_isometric_force=data.force,
        optimal_fiber_length=data.fiber,
        tendon_slack_length=data.slack,
        pennation_angle_at_optimal=0.0,
        max_contraction_velocity=data.vmax,
        min_control=limits[0],
        max_control=limits[1],
        active_force_length_curve=curves[0],
        passive_force_length_curve=curves[1],
        force_velocity_curve=curves[2],
    )
    if has_activation:
        activation_time, deactivation_time = map(float, model_times(draft, actuator))
        draft.record(
            "actuator",
            actuator,
            "activation dynamics of a muscle with MuJoCo's own curves",
            "a RigidTendonMuscle with MuJoCo's curves as formulas, without activation dynamics: the "
            "activation is equal to the control",
            f"time constants {activation_time:g} and {deactivation_time:g} s{detail}",
        )
    else:
        draft.note_result("actuator", actuator, f"muscle {name}")
    if data.shape.fpmax > MAX_PASSIVE:
        draft.record(
            "actuator",
            actuator,
            f"a passive force of more than {MAX_PASSIVE:g} times the isometric force",
            "limited to this force",
        )
    return muscle


def model_times(draft: ConversionDraft, actuator: int) -> Array:
    """Return the time constants (2,) of the activation of a muscle, s."""
    return np.array(draft.mj.actuator_dynprm[actuator, :2])


def _record_dynamics(draft: ConversionDraft, actuator: int, has_activation: bool) -> None:
    model = draft.mj
    if has_activation and model.actuator_dynprm[actuator, 2]:
        draft.record(
            "actuator",
            actuator,
            "a smooth change between the time constants of activation",
            "an abrupt change",
            f"width {float(model.actuator_dynprm[actuator, 2]):g}",
        )
    if not has_activation and int(model.actuator_dyntype[actuator]):
        draft.record(
            "actuator",
            actuator,
            "activation dynamics other than a muscle's",
            "no activation dynamics",
        )
