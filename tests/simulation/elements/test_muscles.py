"""Tests of muscles against tables from OpenSim: state derivatives, forces, energies and equilibria."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from osimlite.errors import ModelError, SimulationError
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.extremes import any_numbers
from osimlite.schema.muscle_curves import (
    ActiveForceLengthCurve,
    ForceVelocityCurve,
    TendonForceLengthCurve,
)
from osimlite.schema.muscles import PathActuator
from osimlite.simulation import Simulation
from osimlite.simulation.elements import force_elements
from osimlite.simulation.system import System
from tests.simulation.checked import Checked
from tests.simulation.elements.muscle_rows import CONFIGURATIONS, FOLDER, hung, muscle, table
from tests.suite import choose

CASES = [
    name
    for name, settings in CONFIGURATIONS.items()
    if (FOLDER / f"{settings['cls']}.csv.gz").exists()
]
RECORDED = {
    "tension": "Actuation",
    "activation": "Activation",
    "fiber_length": "FiberLength",
    "cos_pennation": "CosPennationAngle",
    "active_force_length": "ActiveForceLengthMultiplier",
    "force_velocity": "ForceVelocityMultiplier",
    "fiber_velocity": "FiberVelocity",
    "active_fiber_force": "ActiveFiberForce",
    "passive_fiber_force": "PassiveFiberForce",
}
"""Column of OpenSim's table for each value of the record of a muscle."""


DIGITS = {"Millard2012EquilibriumMuscle": 2e-11, "Millard2012AccelerationMuscle": 2e-11}
"""Relative tolerance for classes of muscles with less precise numbers; 2e-12 for all others."""


NOWHERE = r"no equilibrium was found for '/forceset/mu', whose path of 0\.\d+ m is 0\.\d+ m (long|short)er than the sum"


def system(model, code=None):
    mechanism = build_mechanism(model)
    return System(mechanism, force_elements(model, mechanism), code=code)


def states(ready):
    return [path.rpartition("/")[2] for path in ready.state.paths]


@any_numbers
@pytest.mark.parametrize("code", [None, Checked("Python")], ids=["compiled", "Python"])
@pytest.mark.parametrize("case", CASES)
def test_derivatives_forces_and_energy(case, code):
    name = CONFIGURATIONS[case]["cls"]
    rows, digits = (
        table(name, case)[:: choose(2, 1) if code is None else 8],
        DIGITS.get(name, 2e-12),
    )
    ready = system(hung(muscle(case), [float(row["excitation"]) for row in rows]), code)
    (element,) = ready.forces.elements
    m: Any = element.values[1] if name == "Millard2012EquilibriumMuscle" else None
    is_searched = m is not None and m.damping > 0.0 and not m.is_rigid
    for number, row in enumerate(rows):
        y = [float(row[name]) for name in ("path_length", "path_speed", *states(ready))]
        if row["error"]:
            with pytest.raises(
                SimulationError,
                match="there is no solution for '/forceset/mu', whose path of",
            ):
                ready.compute_applied_forces(float(number), y)
            continue
        _, force, *rates = ready.compute_applied_forces(float(number), y)
        ((_, records),) = ready.read_records()
        known = element.list_named_values(records[-1])
        ours = dict(zip([f"d_{name}" for name in states(ready)], rates, strict=True))
        ours |= {theirs: known[own] for own, theirs in RECORDED.items() if row[theirs] != "n/a"}
        for name, value in ours.items():
            expected = float(row[name])
            # A difference of forces has an absolute error, which is relative to the strength.
            scale = (
                1e-3 * digits * known["max_isometric_force"]
                if "Force" in name or name == "Actuation"
                else 0.0
            )
            if is_searched:
                # OpenSim's search for the fiber velocity leaves an error of 1e-10 of the strength.
                scale += 2e-10 * (known["max_isometric_force"] if scale else 100.0)
            # Exponentials of large numbers have a larger relative error.
            close = digits if abs(expected) < 1e6 else 1e-10
            assert value == pytest.approx(expected, rel=close, abs=1e-14 + scale, nan_ok=True), (
                number,
                name,
            )
        assert force == pytest.approx(-known["tension"], rel=1e-15)
        if is_searched and known["fiber_velocity"] != 0.0:
            # The search of osimlite converges to rounding errors.
            borne = (known["active_fiber_force"] + known["passive_fiber_force"]) * known[
                "cos_pennation"
            ]
            assert borne == pytest.approx(
                known["tension"], abs=1e-13 * known["max_isometric_force"]
            )
        assert ready.force_records(float(number), y) == [known["tension"]]
        parts = [row[f"{part}PotentialEnergy"] for part in ("Fiber", "Tendon")]
        stored = 0.0 if "n/a" in parts else sum(map(float, parts))
        # OpenSim's integrals of Millard's curves are spline approximations.
        close = 1e-4 if "millard" in case else 1e-8
        assert ready.compute_energies(float(number), y)[2] == pytest.approx(
            stored, rel=close, abs=0.001 * close
        )


@pytest.mark.parametrize("code", [None, Checked("Python")], ids=["compiled", "Python"])
@pytest.mark.parametrize("case", CASES)
def test_equilibrium(case, code):
    rows = table("equilibrium", case)[:: 1 if code is None else 8]
    ready = system(hung(muscle(case), [float(row["activation"]) for row in rows]), code)
    for number, row in enumerate(rows):
        start = [
            float(row["activation"]) if name == "activation" else 0.1 for name in states(ready)
        ]
        y = [float(row["path_length"]), float(row["path_speed"]), *start]
        if row["error"]:
            with pytest.raises(SimulationError, match=NOWHERE):
                ready.equilibrate_muscles(float(number), y)
            continue
        result = ready.equilibrate_muscles(float(number), y)
        expected = [
            float(row.get(f"eq_{name}") or value)
            for name, value in zip(states(ready), start, strict=True)
        ]
        assert result[:2] == y[:2] and result[2:] == pytest.approx(
            expected, rel=1e-12, abs=1e-14
        ), number


def test_a_motion_may_start_in_equilibrium():
    with Simulation(hung(muscle("thelen_default", default_activation=0.3), [0.5])) as simulation:
        resting, path = {"x": 0.325, "/forceset/mu/activation": 0.4}, "/forceset/mu/fiber_length"
        trajectory = simulation.run(0.01, initial=resting, equilibrate=True)
        assert trajectory.summary["settings"]["equilibrate"]
        assert trajectory.auxiliary["/forceset/mu/activation"][0] == 0.4
        fiber = trajectory.auxiliary[path][0]
        engine, rest = simulation.engine, simulation.initial_state(resting, {}, equilibrate=True)
        assert rest[-1] == fiber and abs(engine.compute_derivative(0.0, rest)[-1]) < 1e-6
        # An initial fiber length that is set stays, and without the option no equilibrium is
        # computed.
        assert (
            simulation.run(0.01, initial={"x": 0.3, path: 0.05}, equilibrate=True).auxiliary[path][
                0
            ]
            == 0.05
        )
        assert simulation.run(0.01, initial={"x": 0.3}).auxiliary[path][0] == 0.1


def test_numbers_of_another_model_of_the_structure():
    ready, other = (
        system(hung(muscle("thelen_default", tendon_slack_length=x))) for x in (0.27, 0.28)
    )
    y = [0.325, 0.1, 0.3, 0.1]
    assert (
        ready.equilibrate_muscles(0.0, y, other.numbers)
        == other.equilibrate_muscles(0.0, y)
        != ready.equilibrate_muscles(0.0, y)
    )


@pytest.mark.parametrize(
    ("case", "name", "value", "words"),
    [
        ("thelen_default", "optimal_fiber_length", 0.0, "is not positive"),
        ("thelen_default", "tendon_slack_length", -1.0, "is not positive"),
        ("thelen_default", "Flen", 1.0, "is not above 1"),
        ("thelen_default", "Flen", 0.0, "is not above 1 / Flen"),
        ("thelen_default", "KshapePassive", 1e308, "is not between"),
        ("thelen_default", "KshapePassive", 1e-320, "is not between"),
        ("thelen_default", "max_isometric_force", math.nan, "is not a finite number"),
        ("millard_damped", "maximum_pennation_angle", math.inf, "is not a finite number"),
        ("rigidtendon", "pennation_angle_at_optimal", math.inf, "is not a finite number"),
        (
            "thelen_default",
            "ignore_tendon_compliance",
            True,
            "is true, which a Thelen2003Muscle does not support",
        ),
        ("thelen_default", "fv_linear_extrap_threshold", 0.7, "is not above 1 / Flen"),
        ("thelen_default", "min_control", 0.0, "is below its minimum_activation, 0.01"),
        ("thelen_default", "maximum_pennation_angle", 2.0, "is not from 0 to pi/2"),
        ("millard_undamped", "minimum_activation", 0.0, "is less than 0.01"),
        ("millard_damped", "tendon_slack_length", 0.0, "is not positive"),
        (
            "millard_damped",
            "tendon_force_length_curve",
            TendonForceLengthCurve(stiffness_at_one_norm_force=20.0),
            "do not define a curve: its stiffness_at_one_norm_force and the optional properties after it "
            "must be either all given or all left",
        ),
        (
            "millard_damped",
            "force_velocity_curve",
            ForceVelocityCurve(isometric_slope=0.5),
            "do not define a curve: its isometric_slope is not above 1",
        ),
        (
            "millard_damped",
            "force_velocity_curve",
            ForceVelocityCurve(eccentric_slope_near_vmax=0.0),
            "do not define a curve: its eccentric_slope_near_vmax is less than 1.49e-08",
        ),
        (
            "millard_damped",
            "active_force_length_curve",
            ActiveForceLengthCurve(max_norm_active_fiber_length=1e308),
            "has a parameter that is not a finite number",
        ),
        (
            "millard_damped",
            "tendon_force_length_curve",
            TendonForceLengthCurve(strain_at_one_norm_force=1e-160),
            "do not define a curve: its strain_at_one_norm_force is not above",
        ),
    ],
)
def test_what_makes_a_muscle_impossible(case, name, value, words):
    with pytest.raises(ModelError, match=f"mu'.*{words}"):
        system(hung(muscle(case, **{name: value})))


def test_no_muscle_is_in_equilibrium_where_there_is_none():
    ready = system(
        hung(PathActuator(name="mu", geometry_path=muscle("thelen_default").geometry_path))
    )
    assert ready.equilibrate_muscles(0.0, [0.3, 0.0]) == [0.3, 0.0]


@pytest.mark.parametrize(
    ("code", "words"),
    [
        (None, "no equilibrium was found for"),
        (Checked("Python"), "cannot be computed: math range error"),
    ],
)
def test_an_equilibrium_beyond_all_numbers_is_none(code, words):
    ready = system(hung(muscle("thelen_default", optimal_fiber_length=1e-160)), code)
    with np.errstate(all="ignore"), pytest.raises(SimulationError, match=words):
        ready.equilibrate_muscles(0.0, [0.3, 0.0, 0.1, 0.1])


def test_activation_times_of_the_first_muscle_count_for_all():
    """In a process of OpenSim, the time constants of the first DeGrooteFregly2016Muscle apply to all others.

    This must also hold when only these constants change.
    """
    from osimlite.simulation.engines.compiled import CompiledEngine

    first, other = muscle("dgf_default", activation_time_constant=0.03), muscle("dgf_default")
    model, other.name = hung(first), "other"
    model.add(other)
    mechanism = build_mechanism(model)

    def rates(engine):
        return dict(
            zip(
                engine.state.paths,
                engine.compute_derivative(0.0, engine.state.pack_defaults())[2:],
                strict=True,
            )
        )

    def made(**more):
        return CompiledEngine(mechanism, force_elements(model, mechanism, **more))

    before, path = made(), "/forceset/other/activation"
    assert (
        rates(made(own_activation_times=True))[path]
        != rates(before)[path]
        == rates(before)["/forceset/mu/activation"]
    )
    renewal = before.make_updater(model, Path())
    first.deactivation_time_constant = 0.02
    assert rates(renewal.update([first]).make_engine()) == rates(made()) != rates(before)


@pytest.mark.parametrize("length", [0.2, 0.6])
def test_a_tendon_force_that_is_nowhere(length):
    """OpenSim searches the tendon force between 0 and 5 times the maximum isometric force."""
    words = f"whose path of {length} m is .* than the sum of its tendon_slack_length and optimal_fiber_length; start"
    with pytest.raises(SimulationError, match=f"'/forceset/mu', {words}"):
        system(hung(muscle("dgf_default"))).equilibrate_muscles(0.0, [length, 0.0, 0.3, 0.5])
