"""Check that results print a short table as their representation."""

from __future__ import annotations

import numpy as np
import pytest

import osimlite
from osimlite.io.tables.storage import StoTable
from osimlite.models.dynamic_walker import dynamic_walker


def make_table(count=12):
    times = np.linspace(0.0, 1.0, 5)
    columns = tuple(f"c{k}" for k in range(count))
    return StoTable("walk", times, columns, np.add.outer(times, np.arange(float(count))))


def test_a_table_lists_its_first_columns():
    assert repr(make_table()).splitlines() == [
        "StoTable 'walk': 5 times from 0 to 1 s, 12 columns",
        "    smallest  largest",
        "c0         0        1",
        "c1         1        2",
        "c2         2        3",
        "c3         3        4",
        "c4         4        5",
        "c5         5        6",
        "c6         6        7",
        "c7         7        8",
        "... and 4 more columns",
    ]
    html = make_table(40)._repr_html_()
    assert html.count("<tr>") == 31 and "and 10 more columns" in html


def test_tables_without_rows_or_numbers_have_a_text():
    empty = StoTable("a<b", np.zeros(0), ("x",), np.zeros((0, 1)))
    assert repr(empty).startswith("StoTable 'a<b': no times, 1 column")
    assert "a&lt;b" in empty._repr_html_()
    gone = StoTable("nan", np.zeros(2), ("x" * 60,), np.full((2, 1), np.nan))
    assert max(map(len, repr(gone).splitlines())) < 80


@pytest.mark.parametrize(
    "make",
    [
        lambda: osimlite.simulate(dynamic_walker(), to=0.02),
        lambda: osimlite.mechanism(dynamic_walker()),
        lambda: osimlite.validate(dynamic_walker()),
        lambda: osimlite.paths(dynamic_walker()),
        lambda: osimlite.to_urdf(dynamic_walker()),
        lambda: osimlite.to_mjcf(dynamic_walker()),
        lambda: osimlite.kinematics(dynamic_walker(), **make_motion()),
        lambda: osimlite.kinematics(dynamic_walker(), **make_motion()).bodies(),
        lambda: osimlite.inverse_dynamics(dynamic_walker(), **make_motion()),
    ],
)
def test_results_have_short_texts(make):
    lines = repr(make()).splitlines()
    assert len(lines) <= 12 and max(map(len, lines)) <= 160


def make_motion():
    """Return the arguments `motion` and `times` of a motion along the platform."""
    times = np.linspace(0.0, 0.2, 11)
    return {"motion": {"Pelvis_tx": times}, "times": times}


def test_frames_have_units_and_paths_by_option():
    pytest.importorskip("pandas", reason="needs pandas (extra 'frame')")
    trajectory = osimlite.simulate(dynamic_walker(), to=0.02)
    frame = trajectory.to_frame()
    assert frame.attrs["units"]["RHip_rz/speed"] == "rad/s"
    assert frame.attrs["units"]["Pelvis_tx"] == "m"
    frame = trajectory.to_frame(paths=True)
    (path,) = [name for name in frame if name.endswith("/RHip_rz/value")]
    assert frame.attrs["units"][path] == "rad" and path in trajectory.paths
