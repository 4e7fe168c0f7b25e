"""Tests of runs of a sweep: each equals, bit for bit, the simulation of the model with these numbers."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from osimlite import Body, Coordinate, Model, PinJoint, SliderJoint
from osimlite.errors import DoubtfulWarning, OsimliteError, SettingError
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.schema.actuators import CoordinateActuator
from osimlite.schema.controller_types import PrescribedController
from osimlite.schema.functions import Constant
from osimlite.simulation import Simulation
from osimlite.studies.sweep.plan import Plan, Stop, plan
from osimlite.studies.sweep.runner import Runner
from osimlite.studies.sweep.variants import Variants

NUMBERS = {
    "RHip_rz": (0.2, 0.9),
    "LKnee_rz/speed": (-1.0, 1.0),
    "platform_rz": (-0.3, 0.0),
    "slope": (-0.1, 0.1),
    "/bodyset/Pelvis/mass": (0.5, 5.0),
    "/bodyset/*Thigh/mass_center/1": (-0.1, 0.1),
    "/bodyset/LeftShank/inertia/2": (0.01, 2.0),
    "/forceset/*Foot*/contact_parameters/stiffness": (1e5, 1e7),
    "/forceset/LKneeForce/contact_parameters/dissipation": (0.0, 3.0),
    "/forceset/RFootForce/transition_velocity": (0.05, 0.3),
    "/forceset/RKneeLimitTorque/upper_limit": (-20.0, 5.0),
    "/contactgeometryset/RFootContact/radius": (0.03, 0.07),
    "/contactgeometryset/PlatformContact/location/1": (0.0, 0.05),
    "/jointset/RightShankToThigh/RKnee_rz/default_value": (-0.7, 0.0),
}
STATES = [
    f"{name}/{what}"
    for name in (
        "Pelvis_rz",
        "Pelvis_tx",
        "Pelvis_ty",
        "RHip_rz",
        "LHip_rz",
        "RKnee_rz",
        "LKnee_rz",
    )
    for what in ("value", "speed")
]


def simulated(model, initial, speeds, to=0.6):
    """Return the final state of a simulation, in the order of STATES."""
    with Simulation(model, "compiled") as simulation:
        trajectory = simulation.run(to, initial=initial, initial_speeds=speeds)
    columns = list(trajectory.coordinates)
    result = []
    for name in STATES:
        coordinate, _, what = name.partition("/")
        table = trajectory.values if what == "value" else trajectory.speeds
        result.append(table[-1, columns.index(coordinate)])
    return result


def changed(chosen, values):
    """Write the values of variables into the walker without the code of sweeps.

    Args:
        chosen: names of the variables.
        values: their values.

    Returns:
        Model, initial coordinates and initial speeds.
    """
    model = dynamic_walker()
    initial, speeds = {}, {}
    at = model.tree().by_path
    for name, value in zip(chosen, values, strict=True):
        if name == "RHip_rz":
            initial[name] = value
        elif name == "LKnee_rz/speed":
            speeds["LKnee_rz"] = value
        elif name == "platform_rz":
            at["/jointset/PlatformToGround/platform_rz"].default_value = value
        elif name == "slope":
            g = 9.80665
            model.gravity = (g * np.sin(value), -g * np.cos(value), 0.0)
        elif name == "/bodyset/Pelvis/mass":
            at["/bodyset/Pelvis"].mass = value
        elif name == "/bodyset/*Thigh/mass_center/1":
            for side in ("Left", "Right"):
                at[f"/bodyset/{side}Thigh"].mass_center = (0.0, value, 0.0)
        elif name == "/bodyset/LeftShank/inertia/2":
            at["/bodyset/LeftShank"].inertia = (1.0, 1.0, value, 0.0, 0.0, 0.0)
        elif name == "/forceset/*Foot*/contact_parameters/stiffness":
            for side in "LR":
                at[f"/forceset/{side}FootForce"].contact_parameters.objects[0].stiffness = value
        elif name == "/forceset/LKneeForce/contact_parameters/dissipation":
            at["/forceset/LKneeForce"].contact_parameters.objects[0].dissipation = value
        elif name == "/forceset/RFootForce/transition_velocity":
            at["/forceset/RFootForce"].transition_velocity = value
        elif name == "/forceset/RKneeLimitTorque/upper_limit":
            at["/forceset/RKneeLimitTorque"].upper_limit = value
        elif name == "/contactgeometryset/RFootContact/radius":
            at["/contactgeometryset/RFootContact"].radius = value
        elif name == "/contactgeometryset/PlatformContact/location/1":
            at["/contactgeometryset/PlatformContact"].location = (0.0, value, 0.0)
        elif name == "/jointset/RightShankToThigh/RKnee_rz/default_value":
            at["/jointset/RightShankToThigh/RKnee_rz"].default_value = value
        else:
            raise AssertionError(name)
    return model, initial, speeds


FORCES = sorted(name for name in NUMBERS if name.startswith("/forceset/"))
BODIES = sorted(name for name in NUMBERS if name.startswith("/bodyset/"))


@settings(max_examples=30, suppress_health_check=[HealthCheck.too_slow])
@given(st.data())
def test_a_run_is_the_simulation_of_the_changed_model(data):
    among = data.draw(
        st.sampled_from([sorted(NUMBERS), [*FORCES, "RHip_rz"], [*BODIES, *FORCES[:1], "slope"]])
    )
    chosen = data.draw(st.lists(st.sampled_from(among), min_size=1, max_size=4, unique=True))
    if "platform_rz" in chosen and "slope" in chosen:
        chosen.remove("slope")
    fractions = st.lists(
        st.sampled_from([0.0, 0.25, 0.5, 0.77, 1.0]), min_size=len(chosen), max_size=len(chosen)
    )
    rows = [
        [
            NUMBERS[name][0] + f * (NUMBERS[name][1] - NUMBERS[name][0])
            for name, f in zip(chosen, row, strict=True)
        ]
        for row in data.draw(st.lists(fractions, min_size=1, max_size=3))
    ]
    made = plan(
        dynamic_walker(), {name: NUMBERS[name] for name in chosen}, measures=tuple(STATES), to=0.6
    )
    block = Runner(made).run(np.array(rows))
    assert block.status == ["done"] * len(rows)
    for number, row in enumerate(rows):
        assert [block.measures[name][number] for name in STATES] == simulated(*changed(chosen, row))


@pytest.mark.parametrize("chosen", [FORCES, BODIES, ["slope"], [*FORCES, *BODIES, "slope"]])
def test_of_forces_masses_and_gravity_only_the_numbers_are_made_afresh(chosen):
    made = plan(
        dynamic_walker(), {name: NUMBERS[name] for name in chosen}, measures=("energy",), to=0.6
    )
    variants = Variants(made)
    for end in (1, 0):
        row = [NUMBERS[name][end] for name in chosen]
        variant = variants.make_variant(row)
        assert variant.simulation is None and variant.structure == variants.base_variant.structure
        model, _, _ = changed(chosen, row)
        with Simulation(model, "compiled") as simulation:
            engine = simulation.engine
            assert np.array_equal(variant.numbers, engine.numbers)
            assert np.array_equal(variant.engine.numbers, engine.numbers)
            energies = simulation.run(0.6).summary["energy_J"]
        energy = Runner(made).run(np.array([row])).measures["energy"][0]
        assert energy == pytest.approx(
            energies["end"]["total"] - energies["start"]["total"], abs=1e-9
        )


def test_controls_are_those_that_a_run_is_given():
    """Controls add to those of the model; only numbers are updated, also those of other controllers."""
    model = dynamic_walker()
    model.add(
        *(CoordinateActuator(name=f"{side}_hip", coordinate=f"{side}Hip_rz") for side in "RL")
    )
    brain = PrescribedController(name="brain", socket_actuators=("/forceset/R_hip",))
    brain.ControlFunctions.objects.append(Constant(value=0.3))
    model.add(brain)
    of_brain = "/controllerset/brain/ControlFunctions/value"
    vary = {
        "R_hip/control": (-3.0, 3.0),
        "RHip_rz": (0.2, 0.6),
        "/forceset/L_hip/control": (-1.0, 1.0),
        of_brain: (0.0, 1.0),
    }
    made = plan(model, vary, measures=tuple(STATES), to=0.3)
    rows = np.array([[2.0, 0.5, -1.0, 0.3], [-1.5, 0.3, 0.25, 0.7]])
    block = Runner(made).run(rows)
    assert Variants(made).make_variant(rows[0].tolist()).simulation is None
    for number, (right, hip, left, own) in enumerate(rows.tolist()):
        brain.ControlFunctions.objects[0].value = own
        with Simulation(model, "compiled") as simulation:
            trajectory = simulation.run(
                0.3, initial={"RHip_rz": hip}, controls={"R_hip": right, "L_hip": left}
            )
        ends = dict(zip(trajectory.coordinates, trajectory.values[-1].tolist(), strict=True))
        rates = dict(zip(trajectory.coordinates, trajectory.speeds[-1].tolist(), strict=True))
        for name in STATES:
            coordinate, _, what = name.partition("/")
            assert block.measures[name][number] == (ends if what == "value" else rates)[coordinate]


def test_parameters_of_a_function():
    def make(parameters):
        return dynamic_walker(**parameters)

    vary = {"thigh_length": (0.3, 0.5), "RHip_rz": (0.2, 0.6), "/bodyset/Pelvis/mass": (1.0, 2.0)}
    made = plan(
        make, vary, parameters={"thigh_length": 0.4, "slope": 10.0}, measures=tuple(STATES), to=0.6
    )
    rows = np.array([[0.35, 0.5, 1.5], [0.45, 0.3, 1.0], [0.35, 0.5, 1.25]])
    block = Runner(made).run(rows)
    for number, (length, hip, mass) in enumerate(rows.tolist()):
        model = dynamic_walker(thigh_length=length)
        model.tree().by_path["/bodyset/Pelvis"].mass = mass
        assert [block.measures[name][number] for name in STATES] == simulated(
            model, {"RHip_rz": hip}, {}
        )


def test_a_number_that_becomes_zero_changes_the_structure():
    """A sphere whose centre moves to the origin of its body needs no offset any more."""
    name = "/jointset/RightThighToPelvis/Pelvis_offset/translation/2"
    made = plan(dynamic_walker(), {name: (0.0, 0.2)}, measures=tuple(STATES), to=0.3)
    block = Runner(made).run(np.array([[0.2], [0.0], [0.1]]))
    assert block.status == ["done"] * 3
    for number, value in enumerate((0.2, 0.0, 0.1)):
        model = dynamic_walker()
        model.tree().by_path["/jointset/RightThighToPelvis/Pelvis_offset"].translation = (
            0.0,
            0.0,
            value,
        )
        assert [block.measures[name][number] for name in STATES] == simulated(model, {}, {}, 0.3)


def test_runs_that_fail_are_told_of_and_harm_no_others(walker):
    path = "/forceset/RFootForce/contact_parameters/stiffness"
    made = plan(walker, {path: (-1e6, 1e6), "RHip_rz": "0rad:1e300rad"}, to=0.5)
    block = Runner(made).run(np.array([[1e6, 0.5], [-1e6, 0.5], [1e6, 1e300], [1e6, 0.5]]))
    assert block.status == ["done", "failed", "failed", "done"]
    assert "RFootForce" in (block.reasons[1] or "") and "cannot be computed beyond" in (
        block.reasons[2] or ""
    )
    distance = block.measures["distance"]
    assert distance[0] == distance[3] and np.isnan(distance[1:3]).all()


def test_a_model_without_mass_is_a_row_with_a_reason(walker):
    made = plan(walker, {"/bodyset/*Shank/mass": (-5.0, 1.0)}, to=0.2)
    block = Runner(made).run(np.array([[-5.0], [1.0]]))
    assert block.status == ["failed", "done"]
    assert block.reasons[0]


def test_stops(walker):
    made = plan(
        walker,
        {"RHip_rz": (0.3, 0.7)},
        to=3.0,
        stops=(Stop("Pelvis_ty", 0.7), Stop("Pelvis_tx", 0.1, False)),
    )
    made = Plan(**{**vars(made), "measures": ("Pelvis_ty/value", "Pelvis_tx/value")})
    block = Runner(made).run(np.array([[0.3], [0.5], [0.7]]))
    assert set(block.status) == {"stopped"}
    for number, reason in enumerate(block.reasons):
        name, level = {
            "Pelvis_ty below 0.7": ("Pelvis_ty", 0.7),
            "Pelvis_tx above 0.1": ("Pelvis_tx", 0.1),
        }[reason]
        assert block.measures[f"{name}/value"][number] == pytest.approx(level, abs=1e-6)


def chain(parameters):
    """Return a chain of pendulums on a cart; the number of links is a parameter."""
    model = Model(name="chain")
    cart = model.add(Body(name="cart", mass=1.0, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)))
    first = SliderJoint(name="rail", coordinates=[Coordinate(name="x", default_speed_value=1.0)])
    links = [model.ground, cart]
    for number in range(int(parameters.get("links", 1.0))):
        link = Body(
            name=f"link{number}",
            mass=1.0,
            mass_center=(0.0, -0.5, 0.0),
            inertia=(0.1, 0.1, 0.1, 0, 0, 0),
        )
        links.append(model.add(link))
        pin = PinJoint(
            name=f"pin{number}", coordinates=[Coordinate(name=f"q{number}", default_value=0.3)]
        )
        model.add(pin.between(links[-2], link))
    model.add(first.between(model.ground, cart))
    return model


@pytest.mark.parametrize("engine", ["compiled", "bullet"])
def test_models_of_another_structure_are_measured_as_they_are(engine):
    if engine == "bullet":
        pytest.importorskip("pybullet", reason="needs pybullet (extra 'bullet')")
    vary = {"links": (1.0, 3.0), "q0": (0.1, 0.5), "x/speed": (0.0, 2.0)}
    measures = ("distance", "q0/value", "x/speed", "energy")
    made = plan(chain, vary, parameters={"links": 1.0}, measures=measures, engine=engine, to=0.4)
    rows = np.array([[1.0, 0.2, 0.5], [2.0, 0.2, 0.5], [3.0, 0.4, 1.0], [1.0, 0.4, 1.0]])
    block = Runner(made).run(rows)
    assert block.status == ["done"] * 4
    for number, (links, swing, speed) in enumerate(rows):
        with Simulation(chain({"links": links}), engine) as simulation:
            result = simulation.run(0.4, initial={"q0": swing}, initial_speeds={"x": speed})
        x, q = (result.coordinates.index(name) for name in ("x", "q0"))
        assert block.measures["distance"][number] == result.values[-1, x]
        assert block.measures["q0/value"][number] == result.values[-1, q]
        assert block.measures["x/speed"][number] == result.speeds[-1, x]
        assert abs(block.measures["energy"][number]) < 0.01


def test_what_another_structure_lacks_is_a_reason():
    vary = {"links": (1.0, 2.0)}
    made = plan(chain, vary, parameters={"links": 2.0}, measures=("x/value",), to=0.2)
    below = plan(
        lambda given: chain({"links": 2.0, **given}),
        vary,
        parameters={"links": 2.0},
        below={"q1": -1.0},
        to=0.2,
    )
    lacking = plan(
        lambda given: chain({"links": 2.0, **given}),
        vary,
        parameters={"links": 2.0},
        measures=("q1/value",),
        to=0.2,
    )
    rows = np.array([[2.0], [1.0]])
    assert Runner(made).run(rows).status == ["done", "done"]
    for wrong in (below, lacking):
        block = Runner(wrong).run(rows)
        assert block.status == ["done", "failed"] and "q1" in str(block.reasons[1])


def test_stops_may_carry_a_unit(walker):
    made = plan(
        walker, {"RHip_rz": (0.3, 0.7)}, below={"Pelvis_ty": "50cm"}, above={"LHip_rz": "30deg"}
    )
    assert made.stops == (Stop("Pelvis_ty", 0.5), Stop("LHip_rz", np.radians(30), False))
    for choices, words in (
        ({"below": {"Pelvis_ty": "70deg"}}, "give '70deg' in m, cm or mm"),
        ({"above": {"LHip_rz": float("nan")}}, "must be a number"),
        ({"above": {"LHip": 1.0}}, "did you mean 'LHip_rz'"),
        ({"stops": (Stop("platform_rz", 1.0),)}, "'platform_rz' is locked"),
    ):
        with pytest.raises(SettingError, match=words):
            plan(walker, {"RHip_rz": (0.3, 0.7)}, **choices)
    with pytest.warns(DoubtfulWarning, match="LHip_rz = 60 is in rad"):
        plan(walker, {"RHip_rz": (0.3, 0.7)}, above={"LHip_rz": 60})


def test_degrees_taken_for_radians_are_warned_of(walker):
    with pytest.warns(DoubtfulWarning, match="did you mean 20deg") as told:
        plan(walker, {"RHip_rz": (20, 40)})
    assert [each.filename for each in told] == [__file__]


def test_what_is_wrong_is_said_before_anything_runs(walker):
    with pytest.raises(SettingError, match="'to' must be a positive number"):
        plan(walker, {"RHip_rz": (0.0, 1.0)}, to=-1.0)
    with pytest.raises(SettingError, match="'accuracy' must be less than 1, not 2"):
        plan(walker, {"RHip_rz": (0.0, 1.0)}, accuracy=2.0)
    with pytest.raises(SettingError, match="did you mean 'distance'"):
        Runner(plan(walker, {"RHip_rz": (0.0, 1.0)}, measures=("distanz",)))
    with pytest.raises(OsimliteError, match="no engine"):
        Runner(plan(walker, {"RHip_rz": (0.0, 1.0)}, engine="compild"))


def test_bullet_gives_the_same_rows(walker):
    pytest.importorskip("pybullet", reason="needs pybullet (extra 'bullet')")
    vary = {"RHip_rz": (0.3, 0.7), "/bodyset/Pelvis/mass": (1.0, 2.0)}
    measures = ("distance", "largest_force", "energy", "RKnee_rz/speed")
    rows = np.array([[0.35, 1.0], [0.6, 1.5]])
    both = [
        Runner(plan(walker, vary, measures=measures, to=1.0, accuracy=1e-9, engine=engine)).run(
            rows
        )
        for engine in ("compiled", "bullet")
    ]
    for name in measures:
        # The largest force is taken at ends of steps, and steps may differ.
        close = 1e-3 if name == "largest_force" else 1e-5
        assert both[0].measures[name] == pytest.approx(both[1].measures[name], rel=close), name
    assert both[0].status == both[1].status == ["done", "done"]


@pytest.mark.parametrize("engine", ["bullet", "compiled"])
def test_without_machine_code_runs_are_slow_and_said_to_be(engine, fixtures):
    if engine == "bullet":
        pytest.importorskip("pybullet", reason="needs pybullet (extra 'bullet')")
    code = """
import sys
from osimlite.simulation.engines import kernel_library, machine_code, numba_laws
# A pure wheel on a machine without a C++ compiler, and without numba.
kernel_library.load_library = machine_code.find_compiler = lambda: None
numba_laws.has_numba = lambda: False
import numpy as np
import osimlite
from osimlite.studies.sweep.plan import plan
from osimlite.studies.sweep.runner import Runner
model = osimlite.read(sys.argv[1])
made = plan(model, {"RHip_rz": (0.3, 0.5)}, to=0.005, engine=sys.argv[2])
assert Runner(made).run(np.array([[0.4]])).status == ["done"]
"""
    walker = fixtures / "walker" / "DynamicWalkerModel.osim"
    done = subprocess.run(
        [sys.executable, "-c", code, walker, engine], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert (
        "numba is not installed" in done.stderr and "about a thousand times slower" in done.stderr
    )


def test_what_only_the_compiled_engine_watches(walker):
    pytest.importorskip("pybullet", reason="needs pybullet (extra 'bullet')")
    for choices in ({"measures": ("steps",)}, {"stops": (Stop("Pelvis_ty", 0.5),)}):
        with pytest.raises(SettingError, match="the compiled engine"):
            Runner(plan(walker, {"RHip_rz": (0.0, 1.0)}, engine="bullet", **choices))
