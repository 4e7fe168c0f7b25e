"""Tests of CasADi functions of models: values and derivatives are compared with machine code and the kernels."""

from __future__ import annotations

import json
import re
from functools import cache
from importlib import import_module
from importlib.util import find_spec

import casadi
import numpy as np
import pytest

import osimlite
from osimlite.models import BUILT_IN
from osimlite.simulation.run import Simulation
from tests.conftest import ROOT, SHARED
from tests.derivatives.machine import Beside, off, slope

OWN = "furthest-walker", "tree"
CORPUS = {
    "m0115": "2-D walking",
    "m0036": "path actuators",
    "m0093": "ligaments",
    "m0097": "constraints",
}


def corpus_file(number):
    for path in SHARED.glob(f"corpus/models/{number}/*.osim"):
        return path
    pytest.skip("needs the shared reference folder, which is not beside this repository")


def model_named(name):
    if name == "tree":
        return osimlite.read(ROOT / "fixtures/kinematics/mixed_joint_tree.osim")
    if name in BUILT_IN:
        module, _, function = BUILT_IN[name].partition(":")
        return getattr(import_module(module), function)()
    return osimlite.read(corpus_file(name))


@cache
def beside(name):
    return Beside(model_named(name))


def matrix(value):
    return np.array(casadi.DM(value).full())


@pytest.mark.parametrize("name", [*OWN, *CORPUS])
def test_dynamics_are_those_of_machine_code(name):
    both = beside(name)
    for seed in range(12):
        x = both.state(seed)
        assert off(both.xdot(x), both.derivative(x)) < 1e-11


@pytest.mark.parametrize("name", [*OWN, *CORPUS])
def test_derivatives_are_those_of_the_kernels(name):
    both = beside(name)
    for seed in range(2):
        x = both.state(seed, 0.03)
        found = both.errors(both.kept(x) if both.functions.constraint_count else x, seed)
        assert found["value"] < 1e-11 and found["jacobian"] < 1e-8 and found["hessian"] < 1e-6


@pytest.mark.parametrize("name", [*OWN, *CORPUS])
def test_nothing_is_left_of_the_equations_of_a_motion(name):
    both = beside(name)
    f = both.functions
    for seed in range(4):
        x = both.state(seed)
        u, xdot = both.controls(x), both.derivative(x)
        left = matrix(f.residual(both.t, x, xdot, u, f.p, np.zeros(f.constraint_count))).ravel()
        kept = f.constraints(both.t, x, xdot, f.p)
        g = matrix(kept[3])
        scale = 1.0 + np.abs(xdot).max()
        # The residual without multipliers contains exactly the constraint forces.
        rows = slice(both.size, 2 * both.size)
        multipliers = np.linalg.lstsq(g.T, -left[rows], rcond=None)[0] if len(g) else np.zeros(0)
        left = matrix(f.residual(both.t, x, xdot, u, f.p, multipliers)).ravel()
        assert np.abs(left).max() < 1e-11 * scale * (1.0 + np.abs(multipliers).max(initial=0.0))
        assert np.abs(matrix(kept[2])).max(initial=0.0) < 1e-9 * scale


def test_constraints_hold_at_the_first_state_and_have_their_derivatives():
    both = beside("m0097")
    f = both.functions
    assert f.constraint_count > 0
    position, velocity, _, jacobian = f.constraints(0.0, f.x, np.zeros(len(f.x)), f.p)
    assert np.abs(matrix(position)).max() < 1e-9 and np.abs(matrix(velocity)).max() < 1e-9
    by_value = f.constraints.jacobian()(
        0.0, f.x, np.zeros(len(f.x)), f.p, *(casadi.DM(*m.shape) for m in f.constraints.sx_out())
    )
    assert off(matrix(by_value[1])[:, : both.size], matrix(jacobian)) < 1e-12


def test_states_are_named_as_in_files_of_states():
    f = beside("furthest-walker").functions
    n = len(f.coordinates)
    assert f.states[:n] == tuple(f"{path}/value" for path in f.coordinates)
    assert f.states[n : 2 * n] == tuple(f"{path}/speed" for path in f.coordinates)
    assert set(f.states) <= set(Simulation(model_named("furthest-walker")).paths)


@pytest.mark.parametrize("name", ["m0036", "tree", "m0115"])
def test_outputs_are_those_of_the_simulation(name):
    both = beside(name)
    f, mechanism = both.functions, both.engine.mechanism
    x = both.state(3)
    y = np.zeros(len(x))
    y[both.places] = x
    found = dict(
        zip(f.outputs.name_out(), f.outputs(both.t, x, both.controls(x), f.p), strict=True)
    )
    q, u = both.engine.state.values(y), both.engine.state.speeds(y)
    places = mechanism.station_positions(q)
    assert off(matrix(found["stations"]).ravel(), np.array([*places.values()]).ravel()) < 1e-12
    assert f.output_names["stations"] == tuple(
        f"{path}|{axis}" for path in places for axis in "xyz"
    )
    for k, (body, point) in enumerate(mechanism.stations.values()):
        wanted = mechanism.at(q, u).point_velocity(body, point)
        assert off(matrix(found["station_velocities"])[3 * k : 3 * k + 3, 0], wanted) < 1e-11
    bodies = mechanism.at(q, u)
    masses = np.array([body.mass_properties.mass for body in mechanism.bodies])
    centers = np.array(
        [bodies.point(k, body.mass_properties.center) for k, body in enumerate(mechanism.bodies)]
    )
    assert off(matrix(found["mass_center"]).ravel(), masses @ centers / masses.sum()) < 1e-12
    both.engine.compute_applied_forces(both.t, y.tolist())
    for label, value in zip(f.output_names["forces"], matrix(found["forces"]).ravel(), strict=True):
        path, _, what = label.partition("|")
        assert value == pytest.approx(
            both.engine.read_record(path, both.engine.get_force_type(path).record_offsets[what]),
            rel=1e-11,
            abs=1e-11,
        )


def test_contact_forces_are_those_of_the_simulation():
    both = beside("furthest-walker")
    f, x = both.functions, both.state(5, 0.0)
    height = next(k for k, path in enumerate(f.coordinates) if path.endswith("_ty"))
    y = np.zeros(len(x))
    while not any(_bits(both)):
        x[height] -= 0.005
        y[both.places] = x
        both.engine.compute_applied_forces(both.t, y.tolist())
    force = matrix(f.outputs(both.t, x, [], f.p)[f.outputs.index_out("contact_forces")]).reshape(
        -1, 2, 3
    )
    wanted = [
        load if touches else np.zeros(3)
        for load, touches in zip(both.engine.loads, _bits(both), strict=False)
    ]
    assert off(force[:, 0], np.array(wanted)) < 1e-10
    labels = f.output_names["contact_forces"]
    assert (
        len(labels) == force.size
        and labels[0].endswith("|force_x")
        and labels[5].endswith("|point_z")
    )


def _bits(both):
    return [bool(both.engine.loads[-1] >> k & 1) for k in range(len(both.engine.contacts))]


@pytest.mark.parametrize("name", ["m0036", "m0115"])
def test_paths_are_those_of_the_model(name):
    both = beside(name)
    f = both.functions
    paths = osimlite.paths(model_named(name))
    x = both.state(2)
    y = np.zeros(len(x))
    y[both.places] = x
    q = both.engine.state.values(y)
    lengths, _, arms = (matrix(part) for part in f.paths(0.0, x, f.p))
    every = paths.lengths(q)
    assert off(lengths.ravel(), np.array([every[name] for name in f.path_names])) < 1e-12
    pose = dict(zip(both.engine.mechanism.coordinate_names, q, strict=True))
    assert pose
    row = paths.moment_arms(q)
    for k, owner in enumerate(f.path_names):
        for j, coordinate in enumerate(f.coordinates):
            name_of = coordinate.rpartition("/")[2]
            if name_of in row[owner]:
                assert arms[k, j] == pytest.approx(row[owner][name_of], abs=1e-11)


def test_parameters_stay_symbols():
    model = model_named("furthest-walker")
    body = [*model.components(osimlite.Body)][1]
    limit = next(item for item in model.components(osimlite.CoordinateLimitForce))
    names = [f"{body.path}/mass", f"{body.path}/mass_center/1", f"{limit.path}/lower_stiffness"]
    both = Beside(model, parameters=names)
    f = both.functions
    assert f.parameters == tuple(names) and f.p[0] == body.mass
    changed = model.copy_deep()
    twin = next(item for item in changed.components(osimlite.Body) if item.path == body.path)
    twin.mass *= 1.3
    twin.mass_center = (twin.mass_center[0], twin.mass_center[1] + 0.02, twin.mass_center[2])
    next(item for item in changed.components(osimlite.CoordinateLimitForce)).lower_stiffness *= 1.7
    second = Beside(changed)
    x = both.state(5, 0.0)
    p = f.p * [1.3, 1.0, 1.7] + [0.0, 0.02, 0.0]
    assert off(np.array(f.dynamics(both.t, x, [], p)).ravel(), second.derivative(x)) < 1e-11
    assert off(np.array(f.dynamics(both.t, x, [], f.p)).ravel(), both.derivative(x)) < 1e-11


def test_constraints_of_welded_bodies_do_not_depend_on_what_is_a_parameter():
    """With parameters, welded bodies remain separate links; here one of them follows a body on a hinge."""
    model = osimlite.Model(name="welded")
    inertia = (0.1, 0.2, 0.3, 0.0, 0.0, 0.0)
    joints = [
        ("arm", "/ground", osimlite.PinJoint),
        ("side", "arm", osimlite.PinJoint),
        ("load", "arm", osimlite.WeldJoint),
    ]
    for name, parent, kind in joints:
        body = osimlite.Body(name=name, mass=1.0, mass_center=(0.1, 0.0, 0.0), inertia=inertia)
        model.add(body)
        frame = parent if parent == "/ground" else f"/bodyset/{parent}"
        model.add(kind(name=f"{name}_joint", socket_parent_frame=frame, socket_child_frame=body))
    model.add(
        osimlite.ConstantDistanceConstraint(
            name="held",
            socket_body_1="/ground",
            socket_body_2="/bodyset/load",
            location_body_1=(0.0, 1.0, 0.0),
            location_body_2=(1.0, 0.0, 0.0),
            constant_distance=2.0**0.5,
        )
    )
    plain, apart = osimlite.casadi(model), osimlite.casadi(model, ["/bodyset/arm/mass"])
    x = plain.x
    for one, other in zip(
        plain.constraints(0, x, x, []), apart.constraints(0, x, x, apart.p), strict=True
    ):
        np.testing.assert_allclose(matrix(one), matrix(other), rtol=0, atol=1e-14)
    assert matrix(apart.constraints(0, x, x, apart.p)[3])[0, 0] == pytest.approx(-(0.5**0.5))


def test_a_number_that_is_no_parameter_is_refused():
    model = model_named("furthest-walker")
    with pytest.raises(osimlite.OsimliteError, match="no number '/bodyset/nobody/mass'"):
        osimlite.casadi(model, ["/bodyset/nobody/mass"])
    with pytest.raises(
        osimlite.OsimliteError,
        match=r"stiffness' cannot be a symbol: .* do not depend on it linearly",
    ):
        osimlite.casadi(model, ["/forceset/RHipForce/contact_parameters/stiffness"])


def test_what_has_no_formula_is_refused_by_name():
    model = osimlite.read_text(osimlite.to_text(model_named("furthest-walker")))
    foot = next(item for item in model.contact_geometry_set.objects if item.name == "RFootContact")
    egg = osimlite.ContactEllipsoid(name=foot.name, radii=(0.04, 0.05, 0.06))
    egg.socket_frame, egg.location = foot.socket_frame, foot.location
    model.contact_geometry_set.objects[model.contact_geometry_set.objects.index(foot)] = egg
    with pytest.raises(
        osimlite.OsimliteError, match=r"'/forceset/RFootForce' has no formula .* use spheres"
    ):
        osimlite.casadi(model)


def test_functions_are_written(tmp_path):
    f = beside("furthest-walker").functions
    files = f.save(tmp_path / "walker", ["dynamics", "outputs"])
    assert [file.name for file in files] == [
        "dynamics.casadi",
        "outputs.casadi",
        "model.c",
        "model.h",
        "model.json",
    ]
    again = casadi.Function.load(str(files[0]))
    assert np.array_equal(matrix(again(0.0, f.x, f.u, f.p)), matrix(f.dynamics(0.0, f.x, f.u, f.p)))
    assert "int dynamics(const casadi_real** arg" in files[2].read_text()
    facts = json.loads(files[-1].read_text())
    assert facts["states"] == list(f.states) and facts["functions"]["dynamics"].startswith(
        "dynamics:(t,x["
    )
    with pytest.raises(
        osimlite.OsimliteError, match="no function 'motion'; there are dynamics, residual"
    ):
        f.save(tmp_path, ["motion"])


def test_the_pages_examples_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    scope: dict = {}
    for block in re.findall(
        r"```python\n(.*?)```", (ROOT / "docs/casadi.md").read_text(), re.DOTALL
    ):
        if "import jax" in block and find_spec("jax") is None:
            continue
        exec(compile(block, "casadi.md", "exec"), scope)
    assert scope["near"].A.shape == (14, 14) and (tmp_path / "walker/model.c").exists()


def test_a_linearization_is_that_of_the_functions():
    f = beside("m0036").functions
    state = {f.coordinates[0] + "/value": 0.1}
    control = {f.controls[0]: 0.3}
    near = osimlite.linearize(f, state, control)
    assert near.x[0] == 0.1 and near.u[0] == 0.3 and near.A.shape == (len(f.states), len(f.states))
    change = np.zeros(len(f.states))
    change[0] = 1.0

    def along(h):
        return np.array(f.dynamics(0.0, near.x + h * change, near.u, f.p)).ravel()

    assert np.abs(slope(along, 1e-3) - near.A[:, 0]).max() < 1e-8 * np.abs(near.A[:, 0]).max()
    # The control acts through the activation of a muscle or directly.
    assert near.B[:, 0].any() and near.B.shape[1] == len(f.controls)
    with pytest.raises(osimlite.OsimliteError, match="has no control 'knee'"):
        osimlite.linearize(f, None, {"knee": 1.0})
    with pytest.raises(
        osimlite.OsimliteError, match="values, one for each state of the model; got 1"
    ):
        osimlite.linearize(f, [1.0])


def test_outputs_are_linearized_by_their_names():
    f = beside("m0036").functions
    force = next(name for name in f.output_names["forces"] if name.endswith("|tension"))
    x, u = beside("m0036").state(3), np.full(len(f.controls), 0.4)
    near = osimlite.linearize(f, x, u, outputs=[f"forces:{force}", "mass_center_velocity"])
    assert near.outputs == (f"forces:{force}", *(f"mass_center_velocity:{axis}" for axis in "xyz"))

    def observed(x, u):
        found = f.outputs.call({"t": 0.0, "x": x, "u": u, "p": f.p})
        tension = matrix(found["forces"])[f.output_names["forces"].index(force)]
        return np.concatenate((tension, matrix(found["mass_center_velocity"]).ravel()))

    assert near.y == pytest.approx(observed(x, u), rel=1e-12)
    for of, wanted in ((x, near.C), (u, near.D)):
        for k, column in enumerate(wanted.T):
            change = np.eye(len(of))[k]

            def along(h, of=of, change=change):
                return observed(x + h * change, u) if of is x else observed(x, u + h * change)

            assert np.abs(slope(along, 1e-3) - column).max() < 1e-8 * max(1.0, np.abs(wanted).max())
    assert near.C.any() and near.D[0].any() and not near.D[1:].any()
    with pytest.raises(
        osimlite.OsimliteError, match="no output 'mass_centre'; did you mean 'mass_center'"
    ):
        osimlite.linearize(f, outputs=["mass_centre"])
    none = osimlite.linearize(f)
    assert none.C.shape == (0, len(x)) and none.D.shape == (0, len(u)) and none.outputs == ()
