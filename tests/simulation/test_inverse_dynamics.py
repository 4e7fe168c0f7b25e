"""Tests of `kinematics` and `inverse_dynamics`: motions and measured loads in all forms."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import osimlite
from osimlite.errors import DocumentError, SettingError
from osimlite.io.tables.c3d import read_c3d_forces
from osimlite.io.tables.storage import StoTable, write_sto
from osimlite.io.tables.writers import write_trc

TRIALS = Path(__file__).parents[2] / "fixtures" / "trials"
TIMES = np.linspace(0.0, 1.0, 51)


def box(mass: float = 2.0) -> osimlite.Model:
    """Return a free body with three markers."""
    model = osimlite.Model(name="box")
    body = model.add(osimlite.Body(name="box", mass=mass, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)))
    joint = osimlite.FreeJoint(name="j", socket_parent_frame=model.ground, socket_child_frame=body)
    for coordinate, name in zip(joint.coordinates, ("rx", "ry", "rz", "x", "y", "z"), strict=True):
        coordinate.name = name
    model.add(joint)
    for number, place in enumerate(((0.1, 0.0, 0.0), (0.0, 0.2, 0.0), (0.0, 0.0, 0.3))):
        model.add(osimlite.Marker(name=f"m{number}", socket_parent_frame=body, location=place))
    return model


def test_motions_in_every_form_are_the_same(tmp_path: Path) -> None:
    """A motion may be a file, arrays, a fitted motion, or a motion that has been read already."""
    model, up = box(), 0.5 * TIMES**2
    write_sto(tmp_path / "up.mot", "up", TIMES, ("y",), up[:, None].tolist())
    table = osimlite.inverse_dynamics(model, tmp_path / "up.mot")
    assert table["y_force"] == pytest.approx(np.full(51, 2.0 * (1.0 + 9.80665)), abs=1e-8)
    followed = osimlite.kinematics(model, tmp_path / "up.mot")
    places = followed.markers()
    assert places["m1_Y"] == pytest.approx(0.2 + up, abs=1e-12)
    labels = [f"m{number}" for number in range(3)]
    write_trc(tmp_path / "up.trc", TIMES.tolist(), labels, places.rows.tolist())
    fitted = osimlite.inverse_kinematics(model, tmp_path / "up.trc")
    for form, times in (
        ({"y": up}, TIMES),
        ({"/jointset/j/y": up}, TIMES),
        (followed, None),
        (fitted, None),
    ):
        same = osimlite.inverse_dynamics(model, form, times=times)
        assert same.columns == table.columns and same.rows == pytest.approx(table.rows, abs=1e-5)
    assert (
        osimlite.inverse_dynamics(model, {"y": up}, times=TIMES).rows.tolist()
        == table.rows.tolist()
    )
    with pytest.raises(SettingError, match="arrays of coordinates need `times`"):
        osimlite.inverse_dynamics(model, {"y": up})
    with pytest.raises(SettingError, match="'y' has 50 values for 51 times"):
        osimlite.kinematics(model, {"y": up[1:]}, times=TIMES)
    with pytest.raises(DocumentError, match="no column is a coordinate of 'box'"):
        osimlite.kinematics(model, {"knee": up}, times=TIMES)
    with pytest.raises(DocumentError, match="no rows"):
        osimlite.kinematics(model, {"y": []}, times=[])


def test_results_are_tables_of_other_libraries() -> None:
    """Results convert to pandas and xarray; duplicate labels remain separate."""
    model = box()
    table = osimlite.inverse_dynamics(model, {"y": TIMES}, times=TIMES)
    frame, data = table.to_frame(), table.to_xarray()
    assert frame.index.name == "time" and frame["y_force"].iloc[3] == table["y_force"][3]
    assert [*frame.columns] == [*table.columns] and data["y_force"].sel(time=1.0) == table[
        "y_force"
    ][-1]
    assert table.motion is not None and table.motion.values[:, 4].tolist() == TIMES.tolist()
    # A free joint has three angles and three positions.
    assert {table.units[name] for name in table.columns if name.endswith("_moment")} == {"N·m"}
    assert table.units["y_force"] == frame.attrs["units"]["y_force"] == "N"
    followed: Any = osimlite.kinematics(model, {"y": TIMES}, times=TIMES)
    assert followed.to_frame()["y"].tolist() == TIMES.tolist()
    assert followed.to_xarray()["value"].sel(coordinate="y").values.tolist() == TIMES.tolist()
    assert followed.bodies().to_frame().shape == (51, 9)
    twice = StoTable("twice", TIMES[:2], ("a", "a"), np.array(((1.0, 2.0), (3.0, 4.0)))).to_frame()
    assert twice["a"].tolist() == [1.0, 3.0] and twice["a.1"].tolist() == [2.0, 4.0]


def test_only_a_part_of_the_motion() -> None:
    """Derivatives within a part are those of the complete motion."""
    model, up = box(), np.sin(TIMES)
    whole = osimlite.inverse_dynamics(model, {"y": up}, times=TIMES)
    part = osimlite.inverse_dynamics(model, {"y": up}, times=TIMES, start=0.2, end=0.5)
    assert part.times == pytest.approx(TIMES[10:26])
    assert part.rows == pytest.approx(whole.rows[10:26], abs=1e-9)
    for what in (osimlite.kinematics, osimlite.inverse_dynamics):
        with pytest.raises(
            SettingError, match="the motion has no row between 3 and 4 s; its rows go from 0 to 1 s"
        ):
            what(model, {"y": up}, times=TIMES, start=3.0, end=4.0)


def test_loads_without_a_document(tmp_path: Path) -> None:
    """Arguments that name columns of a .mot or .c3d file have the effect of an ExternalLoads document."""
    pytest.importorskip("ezc3d")
    model, plate = box(), TRIALS / "force_plate.c3d"
    measured = read_c3d_forces(plate)
    write_sto(
        tmp_path / "plate.mot", "plate", measured.times, measured.columns, measured.rows.tolist()
    )
    (tmp_path / "loads.xml").write_text(
        f"""<OpenSimDocument Version="40600"><ExternalLoads name="loads"><objects><ExternalForce name="push">
<applied_to_body>box</applied_to_body><force_identifier>f1_</force_identifier><point_identifier>p1_</point_identifier>
<torque_identifier>m1_</torque_identifier></ExternalForce></objects><datafile>{tmp_path / "plate.mot"}</datafile>
</ExternalLoads></OpenSimDocument>"""
    )
    times = np.linspace(measured.times[0], measured.times[-1], 20)
    motion = {"y": 0.1 * times, "rx": 0.2 + 0.0 * times}
    plain = osimlite.inverse_dynamics(model, motion, times=times)
    wanted = osimlite.inverse_dynamics(model, motion, tmp_path / "loads.xml", times=times)
    assert np.abs(wanted.rows - plain.rows).max() > 1.0
    columns = {"box": [("f1_", "p1_", "m1_")]}
    for file in (tmp_path / "plate.mot", plate):
        result = osimlite.inverse_dynamics(model, motion, file, times=times, applied_to=columns)
        assert result.rows == pytest.approx(wanted.rows, rel=1e-12, abs=1e-12)
    one = osimlite.inverse_dynamics(
        model, motion, plate, times=times, applied_to={"/bodyset/box": [("f1_",)]}
    )
    two = osimlite.inverse_dynamics(
        model, motion, plate, times=times, applied_to={"box": [("f1_",), ("f1_",)]}
    )
    assert two.rows - plain.rows == pytest.approx(2.0 * (one.rows - plain.rows), abs=1e-9)
    wrong: list[Any] = [
        (plate, None, "this table does not name the bodies on which its forces act"),
        (tmp_path / "loads.xml", columns, "is not a table of forces"),
        (None, columns, "pass the table as `external_loads`"),
        (plate, {"bok": [("f1_",)]}, "did you mean 'box'"),
        (plate, {"box": [("g1_",)]}, "the force_identifier of 'box' is 'g1_'"),
        (plate, {"box": [()]}, "expected one to three prefixes of column labels"),
        (
            plate,
            {"box": [("f1_", "p1_", "m1_", "q1_")]},
            "expected one to three prefixes of column labels",
        ),
    ]
    for file, applied, said in wrong:
        with pytest.raises((DocumentError, SettingError), match=said):
            osimlite.inverse_dynamics(model, motion, file, times=times, applied_to=applied)


def test_the_model_stays_as_it_is() -> None:
    """Excluded forces are left out of a copy of the model."""
    model = box()
    spring = model.add(osimlite.SpringGeneralizedForce(name="s", coordinate="y", stiffness=100.0))
    up = {"y": 1.0 + 0.0 * TIMES}
    with_spring = osimlite.inverse_dynamics(model, up, times=TIMES)
    without = osimlite.inverse_dynamics(model, up, times=TIMES, exclude=["s"])
    assert with_spring["y_force"] - without["y_force"] == pytest.approx(
        np.full(51, 100.0), abs=1e-7
    )
    assert spring.appliesForce
