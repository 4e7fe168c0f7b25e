"""Compare external loads with a live OpenSim 4.6: within a model, and in its InverseDynamicsTool."""

from __future__ import annotations

import gzip

import numpy as np
import pytest

import osimlite
from osimlite.io.document.reader import read_text
from osimlite.io.tables.storage import write_sto
from osimlite.mechanics.multibody import build_mechanism
from osimlite.schema.prescribed import ExternalForce, ExternalLoads
from osimlite.simulation.elements import force_elements
from osimlite.simulation.recorded_motion import RecordedMotion, exclude_forces

opensim = pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytest.importorskip("pybullet", reason="needs pybullet (extra 'bullet')")
pytestmark = pytest.mark.oracle

from tests.oracle.force_carrier import JOINTS, carrier  # noqa: E402
from tests.oracle.opensim_runs import inverse_dynamics, put  # noqa: E402

# Columns of the loads: two forces with point and torque.
LABELS = [
    f"{side}{what}{axis}" for side in ("", "1_") for what in ("f_v", "f_p", "m_") for axis in "xyz"
]


def write_data(path, rows, start=0.0, end=1.0):
    times = np.linspace(start, end, rows)
    columns = [np.sin((1.0 + 0.4 * k) * times + k) * (3.0 + k) for k in range(len(LABELS))]
    write_sto(path, "data", times.tolist(), LABELS, np.column_stack(columns).tolist())


def loads(names):
    """Return external forces with every combination of options, on several bodies and frames."""
    first, second, third, framed = names
    ids = {"force_identifier": "f_v", "point_identifier": "f_p", "torque_identifier": "m_"}
    forces = [
        ExternalForce(name="all", applied_to_body=first, **ids),
        ExternalForce(
            name="elsewhere",
            applied_to_body=second,
            force_expressed_in_body=third,
            point_expressed_in_body=first,
            **{what: f"1_{start}" for what, start in ids.items()},
        ),
        ExternalForce(name="at_the_origin", applied_to_body=third, force_identifier="1_f_v"),
        ExternalForce(
            name="turning",
            applied_to_body=third,
            force_expressed_in_body=second,
            torque_identifier="m_",
        ),
        ExternalForce(name="framed", applied_to_body=framed, force_expressed_in_body=framed, **ids),
        ExternalForce(
            name="off", applied_to_body=first, appliesForce=False, force_identifier="f_v"
        ),
    ]
    forces[-2].point_expressed_in_body = framed
    return ExternalLoads(name="loads", objects=forces, datafile="data.mot")


def write_loads(path, names):
    text = "".join(
        f'<ExternalForce name="{force.name}"><appliesForce>{str(force.appliesForce).lower()}</appliesForce>'
        + "".join(
            f"<{tag}>{getattr(force, tag)}</{tag}>"
            for tag in (
                "applied_to_body",
                "force_expressed_in_body",
                "point_expressed_in_body",
                "force_identifier",
                "point_identifier",
                "torque_identifier",
            )
            if getattr(force, tag) is not None
        )
        + "</ExternalForce>"
        for force in loads(names).objects
    )
    path.write_text(
        f'<?xml version="1.0"?><OpenSimDocument Version="40600"><ExternalLoads name="loads"><objects>{text}</objects>'
        "<groups/><datafile>data.mot</datafile></ExternalLoads></OpenSimDocument>"
    )


@pytest.mark.parametrize("rows", [1, 2, 3, 4, 5, 300])
@pytest.mark.parametrize("within", [False, True], ids=["beside the model", "in the model"])
@pytest.mark.parametrize("kinds", list(JOINTS.values()), ids=list(JOINTS))
def test_accelerations_and_records(kinds, within, rows, tmp_path, monkeypatch):
    from osimlite.simulation.engines.bullet.engine import BulletEngine

    monkeypatch.chdir(tmp_path)
    opensim.Logger.setLevelString("off")
    model = carrier(kinds)
    places = ("b2", "b0", "b1", "/bodyset/b1/f1")
    if within:
        model.subcomponents.append(loads(places))
    osimlite.write(model, "model.osim")
    write_data("data.mot", rows)
    write_loads(tmp_path / "loads.xml", places)
    theirs = opensim.Model("model.osim")
    if within:
        # OpenSim gives a set within a model a name of its own.
        added = opensim.ExternalLoads.safeDownCast(theirs.getComponent("/externalloads"))
    else:
        added = opensim.ExternalLoads("loads.xml", True)
        theirs.addModelComponent(added)
    state = theirs.initSystem()
    mechanism = build_mechanism(model)
    names = mechanism.coordinate_names
    rng = np.random.default_rng(rows)
    forces = force_elements(model, mechanism, external_loads=None if within else "loads.xml")
    with BulletEngine(mechanism, forces) as engine:
        # Times within the data, before them and after them.
        for time in (0.0, 0.37, 0.93, -0.2, 1.3):
            q, u = rng.uniform(-0.9, 0.9, len(names)), rng.uniform(-2.0, 2.0, len(names))
            put(map(theirs.getCoordinateSet().get, names), state, q, u)
            state.setTime(time)
            theirs.realizeAcceleration(state)
            expected = [
                theirs.getCoordinateSet().get(name).getAccelerationValue(state) for name in names
            ]
            ours = engine.compute_accelerations(time, q.tolist(), u.tolist())
            assert np.abs(np.subtract(ours, expected)).max() <= 1e-9 * max(
                1.0, np.abs(expected).max()
            )
            labels, values = [], []
            for number in range(added.getSize()):
                force = added.get(number)
                if force.get_appliesForce():
                    result, row = force.getRecordLabels(), force.getRecordValues(state)
                    labels += [result.get(index) for index in range(result.getSize())]
                    values += [row.get(index) for index in range(result.getSize())]
            assert list(engine.columns) == labels
            recorded = engine.force_records(time, engine.state.pack(q, u))
            assert recorded == pytest.approx(values, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("name", ["m0005", "m0013"])
def test_inverse_dynamics(corpus, name, tmp_path, monkeypatch, capfd):
    converted = next(model.converted for model in corpus if model.id == name)
    text = gzip.decompress(converted.read_bytes()).decode()
    monkeypatch.chdir(tmp_path)
    (tmp_path / "model.osim").write_text(text)
    model = read_text(text)
    mechanism = build_mechanism(model, opensim_derivatives=True)
    times = np.linspace(0.0, 1.0, 120)
    values = np.array(
        [0.2 * np.sin(3.0 * times + index) for index in range(len(mechanism.coordinates))]
    ).T
    values += mechanism.values({})
    write_sto("motion.mot", "motion", times, mechanism.coordinate_names, values.tolist())
    write_data("data.mot", 700, -0.05, 1.02)
    bodies = [body.name for body in mechanism.bodies]
    write_loads(
        tmp_path / "loads.xml",
        (bodies[-1], bodies[0], bodies[len(bodies) // 2], f"/bodyset/{bodies[-2]}"),
    )
    theirs = inverse_dynamics("model.osim", "motion.mot", "loads.xml")
    capfd.readouterr()
    motion = RecordedMotion.read(mechanism, "motion.mot")
    exclude_forces(model, ["All"])
    ours = motion.inverse_dynamics(force_elements(model, mechanism, external_loads="loads.xml"))
    assert ours.columns == theirs.columns
    # The tool writes eight digits after the decimal point.
    assert np.abs(ours.rows - theirs.rows).max() < 1e-8 * np.abs(theirs.rows).max() + 1e-8
    without = motion.inverse_dynamics()
    assert np.abs(ours.rows - without.rows).max() > 1.0
