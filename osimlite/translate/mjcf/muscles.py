"""Muscles with MuJoCo's law: a rigid tendon in series with fibers whose force curves are parabolas.

MuJoCo's `lengthrange` and `range` express the tendon slack length LT and the optimal fiber length
along the tendon L0 (m): (length - LT) / L0 is its normalized length. These remain the model's own
unless forces are fitted. The ends of the active curve and the height of the passive one, for which
OpenSim has no number, are always fitted to the isometric tension of the muscle in equilibrium with
its elastic tendon.

Source: MuJoCo's manual (Modeling, Muscles) and the public code of `mju_muscleGainLength` and
    `mju_muscleBias`.
"""

from __future__ import annotations

import math
from collections import ChainMap
from collections.abc import Sequence
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.require import require
from osimlite.base.text import add_article
from osimlite.errors import OsimliteError
from osimlite.mechanics.laws.deprecated_muscles import schutte_velocity
from osimlite.mechanics.multibody.schema_functions import convert_function
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.muscles import Muscle
from osimlite.schema.old_muscles import Delp1990Muscle_Deprecated, Schutte1993Muscle_Deprecated
from osimlite.schema.states import list_states
from osimlite.translate.fidelity import Error
from osimlite.translate.mjcf.draft import MjcfDraft, Untranslatable, add_element, clear_rounding
from osimlite.translate.mjcf.isometric import (
    compute_isometric_tension,
    compute_mujoco_active_force,
)

COMPARED_ACTIVATIONS = (0.01, 0.5, 1.0)
"""Activations at which isometric tensions are compared."""
LENGTH_COUNT = 24
"""Number of path lengths at which tensions are compared: quantiles of those that occur."""
LOWER_BOUNDS = (0.0, 1.05, 1.05, 0.0)
"""Smallest values of lmin, lmax, end and fpmax in a fit."""
UPPER_BOUNDS = (0.95, 4.0, 6.0, 20.0)
"""Largest values of lmin, lmax, end and fpmax in a fit."""
MAX_TENSION = 3.0
"""Tension over the maximum isometric force above which a pose is unrealistic and not compared."""
FIT_TOLERANCE = 1e-5
"""Relative change of the error or of the numbers at which a fit ends."""
DIFFERENCE_STEP = 2.0**-26
"""Relative change of a number in one-sided differences: the square root of the machine precision."""
UNUSED_SCALE = 200.0
"""MuJoCo's default of `scale`, which has no effect where `force` is given."""
DEFAULT_FVMAX = 1.4
"""Largest force of lengthening fibers over the isometric force, for a muscle class without such a
number.
"""
MIN_POSITIVE = 1e-12
"""Smallest rate or ratio of forces that is written, since MuJoCo requires positive ones."""
FIT_RANGE = 0.25
"""Largest relative change of tendon, fibers and strength, and shift of the passive curve, in a fit
of forces.
"""


class Curves(NamedTuple):
    """Isometric parameters of a muscle of MuJoCo.

    Attributes:
        tendon: length of the tendon (m).
        fiber: optimal length of the fibers along the tendon (m).
        force: force at this length, fully active and at rest (N).
        lmin: normalized length below which there is no active force.
        lmax: normalized length above which there is no active force.
        end: normalized length; the passive force is linear from halfway between 1 and this length.
        fpmax: twice the ratio of the passive force at that halfway length to `force`.
        shift: normalized length minus 1 at which the passive force begins.
    """

    tendon: float
    fiber: float
    force: float
    lmin: float = 0.5
    lmax: float = 1.6
    end: float = 1.6
    fpmax: float = 1.3
    shift: float = 0.0

    def compute_tension(self, lengths: Array, activation: float) -> Array:
        """Return the tensions (L,) (N) at rest for lengths of the path (L,) (m) and one activation."""
        return self.compute_tensions(lengths, (activation,))[0]

    def compute_tensions(
        self, lengths: Array, activations: Sequence[float] = COMPARED_ACTIVATIONS
    ) -> Array:
        """Return the tensions (A, L) (N) at rest, with MuJoCo's formulas.

        Args:
            lengths: lengths of the path (L,) (m).
            activations: activations (A,).
        """
        x = (lengths - self.tendon) / self.fiber
        active = compute_mujoco_active_force(x, self.lmin, self.lmax)
        stretch = np.maximum(x - self.shift - 1.0, 0.0) / (0.5 * (1.0 + self.end) - 1.0)
        passive = self.fpmax * np.where(stretch <= 1.0, 0.5 * stretch**2, stretch - 0.5)
        return self.force * (np.multiply.outer(activations, active) + passive)

    @classmethod
    def read(cls, lengthrange: Array, gain: Array, bias: Array) -> Curves:
        """Return the parameters of an actuator.

        Args:
            lengthrange: length range (2,) (m).
            gain: MuJoCo's gain parameters.
            bias: MuJoCo's bias parameters.
        """
        (shortest, longest), (first, last) = lengthrange, gain[:2]
        fiber = (longest - shortest) / (last - first)
        # A bias with another scale than the gain is not a shift of the passive curve.
        same_scale = math.isclose(bias[1] - bias[0], last - first, rel_tol=1e-9)
        shift = gain[0] - bias[0] if same_scale else math.nan
        return cls(
            shortest - first * fiber, fiber, gain[2], gain[4], gain[5], bias[5], bias[7], shift
        )

    def make_parameters(self, vmax: float, fvmax: float) -> tuple[Array, Array]:
        """Return MuJoCo's parameters of an actuator whose length range is (tendon, tendon + fiber).

        Args:
            vmax: largest shortening velocity (optimal fiber lengths per second).
            fvmax: largest force of lengthening fibers over the isometric force.

        Returns:
            Gain and bias parameters (9,).
        """
        fpmax = max(self.fpmax, MIN_POSITIVE)
        gain = np.array(
            (0.0, 1.0, self.force, UNUSED_SCALE, self.lmin, self.lmax, vmax, fpmax, fvmax)
        )
        bias = np.array(
            (
                -self.shift,
                1.0 - self.shift,
                self.force,
                UNUSED_SCALE,
                self.lmin,
                self.end,
                vmax,
                fpmax,
                fvmax,
            )
        )
        return clear_rounding(gain), clear_rounding(bias)


def add_muscle(draft: MjcfDraft, force: Muscle, path: str) -> str:
    """Add a muscle on the tendon of its path.

    Args:
        draft: MJCF under construction.
        force: muscle of the model.
        path: absolute path of the muscle.

    Returns:
        Kind and name of the element.

    Raises:
        Untranslatable: a length, a force or a velocity is not positive, or the tension cannot be
            computed.
    """
    path_tendon = draft.find_tendon(path)
    # MuJoCo has no pennation: lengths and forces are projected on the tendon at the optimal length.
    cosine = math.cos(force.pennation_angle_at_optimal)
    model_curves = Curves(
        force.tendon_slack_length,
        force.optimal_fiber_length * cosine,
        force.max_isometric_force * cosine,
    )
    if not (
        model_curves.tendon + model_curves.fiber > model_curves.tendon
        and model_curves.force > 0.0
        and model_curves.tendon >= 0.0
    ):
        raise Untranslatable("its lengths or its force are not positive")
    rates = _read_rates(force)
    vmax = rates.vmax / cosine**2
    fvmax = rates.fvmax
    if not min(vmax, fvmax) > MIN_POSITIVE:
        raise Untranslatable(
            "its maximum contraction velocity or its eccentric force is not positive"
        )
    fits = draft.options.fit == "force"
    try:
        sampled_lengths = [
            # Quantiles weight lengths by how often they occur.
            np.quantile(lengths, np.linspace(0.0, 1.0, LENGTH_COUNT))
            for lengths in (path_tendon.lengths, path_tendon.held_out)
        ]
        tensions, held_out = np.split(
            compute_isometric_tension(force, np.concatenate(sampled_lengths), COMPARED_ACTIVATIONS),
            2,
            axis=1,
        )
    except OsimliteError as error:
        raise Untranslatable(f"its tension cannot be computed: {error.message}") from error
    # Fitted to one set of poses, judged in the other.
    curves = _fit_curves(model_curves, sampled_lengths[0], tensions, free=fits)
    name = draft.make_name("actuator", path)
    limits = (max(force.min_control, 0.0), min(force.max_control, 1.0))
    activation, deactivation = rates.rise, rates.fall
    # Without time constants or an activation state, the control is the activation.
    has_activation = activation > 0.0 and deactivation > 0.0 and "activation" in list_states(force)
    gain, bias = curves.make_parameters(vmax, fvmax)
    add_element(
        draft.get_section("actuator"),
        "general",
        name=name,
        tendon=path_tendon.name,
        lengthrange=(curves.tendon, curves.tendon + curves.fiber),
        dyntype="muscle" if has_activation else "none",
        dynprm=(activation, deactivation, 0.0) if has_activation else None,
        gaintype="muscle",
        gainprm=gain,
        biastype="muscle",
        biasprm=bias,
        ctrlrange=limits if limits[0] < limits[1] else None,
    )
    if has_activation:
        draft.activations[name] = getattr(force, "default_activation", 0.0)
    draft.record_result(path, f"actuator {name}")
    force_errors = (
        (curves.compute_tensions(sampled_lengths[1]) - held_out) / force.max_isometric_force
    )[_select_tensions(held_out, model_curves)]
    draft.fidelity.add(
        "muscle",
        path,
        f"{add_article(type(force).__name__)}: {', '.join(_list_lost_features(force))}",
        "a MuJoCo muscle, "
        + (
            "fitted to the isometric force"
            if fits
            else "with the same optimal fiber length and tendon slack length"
        )
        + rates.note
        + (
            ""
            if has_activation
            else "; without activation dynamics: the activation is equal to the control"
        ),
        f"actuator {name}",
        {"isometric force": Error.measure(force_errors, "Fmax")} if len(force_errors) else {},
    )
    return f"actuator {name}"


def _list_lost_features(force: Muscle) -> list[str]:
    """Return what the muscle has and MuJoCo's muscle lacks."""
    states = {*list_states(force)}
    return [
        # With a rigid tendon a muscle has no state of its fiber or tendon.
        *(["an elastic tendon"] if states & {"fiber_length", "normalized_tendon_force"} else []),
        *(["fibers at a changing angle"] if force.pennation_angle_at_optimal else []),
        "non-parabolic curves",
    ]


def _select_tensions(tensions: Array, curves: Curves) -> NDArray[np.bool_]:
    """Return which tensions (A, L) are compared: finite ones below `MAX_TENSION`."""
    return np.nan_to_num(tensions, nan=np.inf) < MAX_TENSION * curves.force


class Rates(NamedTuple):
    """Parameters of a muscle that concern time.

    Attributes:
        vmax: largest shortening velocity (optimal fiber lengths per second).
        fvmax: largest force of lengthening fibers over the isometric force.
        rise: time constant of rising activation (s).
        fall: time constant of falling activation (s).
        note: text about approximations for the account.
    """

    vmax: float
    fvmax: float
    rise: float
    fall: float
    note: str = ""


RISE_TO_63_PERCENT = 1.052
"""Time in units of MuJoCo's activation time constant in which full excitation raises the activation
from 0 to 1 - 1/e: the integral of (0.5 + 1.5 a) / (1 - a).
"""
FALL_TO_37_PERCENT = 0.715
"""Time in units of MuJoCo's deactivation time constant in which the activation falls from 1 to 1/e
without excitation: the integral of 1 / (a (0.5 + 1.5 a)).
"""


def _read_rates(force: Muscle) -> Rates:
    """Return the greatest velocity and the time constants of a muscle, by the law of its class."""
    if not isinstance(force, Schutte1993Muscle_Deprecated | Delp1990Muscle_Deprecated):
        vmax = _read_parameter(force, "vmax", 0.0)
        fvmax = _read_parameter(force, "fvmax", DEFAULT_FVMAX)
        return Rates(
            vmax,
            fvmax,
            _read_parameter(force, "rise", 0.0),
            _read_parameter(force, "fall", 0.0),
        )
    time = force.time_scale
    if not time > 0.0:
        return Rates(0.0, DEFAULT_FVMAX, 0.0, 0.0)
    if isinstance(force, Schutte1993Muscle_Deprecated):
        # The velocity at which a fully active muscle of this law has no force.
        vmax = -schutte_velocity(1.0, 1.0, 0.0, force.damping) if force.damping > 0.0 else 0.0
        fvmax = DEFAULT_FVMAX
    else:
        vmax, fvmax = _measure_velocity_curve(force)
    activation_rate = force.activation1 + force.activation2
    deactivation_rate = force.activation2
    rise = time / activation_rate / RISE_TO_63_PERCENT if activation_rate > 0.0 else 0.0
    fall = time / deactivation_rate / FALL_TO_37_PERCENT if deactivation_rate > 0.0 else 0.0
    note = (
        "; velocity from its time_scale. MuJoCo's time constants change with activation: rising to 63 % and falling to 37 % "
        "take as long as in the model"
    )
    return Rates(vmax / time, fvmax, rise, fall, note)


def _measure_velocity_curve(force: Delp1990Muscle_Deprecated) -> tuple[float, float]:
    """Return the normalised velocity at which the force ends, and the greatest force, of a curve of Delp's muscle."""
    try:
        curve = convert_function(force.force_velocity_curve, 1, "the force_velocity_curve")
        velocities = np.linspace(-2.0, 2.0, 401).tolist()
        factors = [curve.evaluate((velocity,))[0] for velocity in velocities]
    except OsimliteError:
        return 0.0, DEFAULT_FVMAX
    # Shortening velocities without force; the slowest of them is the maximum.
    idle = [
        velocity
        for velocity, factor in zip(velocities, factors, strict=True)
        if velocity < 0.0 and factor <= 0.0
    ]
    return -max(idle, default=-1.0), max(max(factors), 1.0)


def _read_parameter(force: Muscle, name: str, default: float) -> float:
    """Return a parameter of MuJoCo from the property that the muscle class declares for it."""
    properties = ChainMap(
        *(base.__dict__["facts"].mujoco for base in type(force).__mro__ if "facts" in base.__dict__)
    )
    try:
        return float(attrgetter(properties[name])(force))
    except AttributeError:
        return default


def _fit_curves(initial: Curves, lengths: Array, tensions: Array, *, free: bool) -> Curves:
    """Return the curves nearest to tensions (A, L) at lengths (L,).

    If `free`, tendon, fibers and strength are fitted, too.
    """
    is_compared = _select_tensions(tensions, initial)
    if not is_compared.any():
        return initial
    search = require("scipy.optimize", extra="sim", purpose="muscles of MuJoCo").least_squares

    def make_curves(x: Sequence[Any]) -> Curves:
        lmin, lmax, end, fpmax, *tendon_terms = x
        tendon, fiber, strength, shift = tendon_terms or (0.0, 0.0, 0.0, 0.0)
        scaled = (
            initial.tendon + tendon * initial.fiber,
            initial.fiber * (1.0 + fiber),
            initial.force * (1.0 + strength),
        )
        return Curves(*scaled, lmin, lmax, end, fpmax, shift)

    def compute_residuals(x: Array) -> Array:
        return ((make_curves(x.tolist()).compute_tensions(lengths) - tensions) / initial.force)[
            is_compared
        ]

    def differentiate(x: Array) -> Array:
        # The same one-sided differences as those of least_squares, backwards at upper bounds, but all
        # columns in one call.
        step = np.where(x >= 0.0, DIFFERENCE_STEP, -DIFFERENCE_STEP) * np.maximum(1.0, np.abs(x))
        step = np.where((x + step < lower) | (x + step > upper), -step, step)
        displaced_tensions = make_curves(
            [*np.vstack((x, x + np.diag(step))).T[:, :, None]]
        ).compute_tensions(lengths)
        residuals = (
            ((displaced_tensions - tensions[:, None]) / initial.force)
            .swapaxes(1, 2)[is_compared]
            .T.copy()
        )
        return ((residuals[1:] - residuals[0]) / (x + step - x)[:, None]).T

    start = [initial.lmin, initial.lmax, initial.end, initial.fpmax]
    lower = list(LOWER_BOUNDS)
    upper = list(UPPER_BOUNDS)
    if free:
        start = [*start, *[0.0] * 4]
        lower = [*lower, *[-FIT_RANGE] * 4]
        upper = [*upper, *[FIT_RANGE] * 4]
    # The curves have kinks, at which a search may end; a second start is tried.
    starts = start, [0.2, 2.2, *start[2:]]
    result = [
        search(
            compute_residuals,
            search_result,
            differentiate,
            bounds=(lower, upper),
            ftol=FIT_TOLERANCE,
            xtol=FIT_TOLERANCE,
        )
        for search_result in starts
    ]
    best = min(result, key=lambda search_result: search_result.cost)
    return make_curves(best.x)
