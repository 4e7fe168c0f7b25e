"""Tests of muscle curves as tables of other libraries and in notebooks; `tests/oracle/` checks the numbers."""

from __future__ import annotations

import numpy as np
import pytest

import osimlite
from osimlite.errors import DeprecatedWarning, SettingError
from osimlite.simulation.muscle_curves import MuscleCurves
from tests.simulation.elements.muscle_rows import hung, muscle

CURVES = MuscleCurves(
    ("/forceset/<b>", "/forceset/c"),
    {"knee": (0.0, 0.5), "hip": (0.1, 0.2, 0.3)},
    {
        "length": np.arange(12.0).reshape(6, 2),
        "tendon_force": np.array([[np.nan, k] for k in range(6)]),
    },
)


def test_all_combinations_are_poses_the_last_coordinate_first():
    assert CURVES.poses.tolist() == [[a, b] for a in (0.0, 0.5) for b in (0.1, 0.2, 0.3)]
    assert MuscleCurves((), {}, {}).poses.shape == (1, 0)


def test_the_deprecated_selection_of_muscles_warns():
    chosen = CURVES.select_muscles([1])
    assert chosen.muscles == ("/forceset/c",) and chosen.columns["length"].shape == (6, 1)
    with pytest.warns(DeprecatedWarning, match="use select_muscles"):
        assert CURVES.of([1]).muscles == chosen.muscles


def test_tables_have_a_row_for_each_muscle_in_each_pose():
    for package in ("pandas", "pyarrow", "xarray"):
        pytest.importorskip(package, reason=f"needs {package} (extra 'frame')")
    frame, table, data = CURVES.to_frame(), CURVES.to_arrow(), CURVES.to_xarray()
    assert frame["length"]["/forceset/c", 0.5, 0.2] == 9.0
    assert table.column_names == ["muscle", "knee", "hip", "length", "tendon_force"]
    assert table.slice(9, 1).to_pylist() == [
        {"muscle": "/forceset/c", "knee": 0.5, "hip": 0.2, "length": 9.0, "tendon_force": 4.0}
    ]
    assert float(data.length.sel(muscle="/forceset/c", knee=0.5, hip=0.2)) == 9.0
    alone = MuscleCurves(("/forceset/c",), {}, {"length": np.array([[0.3]])})
    assert alone.to_frame()["length"]["/forceset/c"] == 0.3 and alone.to_xarray().length.shape == (
        1,
    )


def test_notebooks_show_what_is_least_and_greatest():
    html = CURVES._repr_html_()
    assert "2 muscles in 6 poses over knee and hip" in html and "<b>" not in html
    assert ">length (m)</th>" in html and ">tendon_force (N)</th>" in html
    assert ">1 to 11<" in html and ">-<" in html and ">0 to 5<" in html


@pytest.mark.parametrize(
    ("values", "muscles", "said"),
    [
        (
            {"x": [0.3], "/jointset/slide/x": [0.3]},
            (),
            "x and /jointset/slide/x are names of the same coordinate",
        ),
        ({"x": [0.3]}, ("/forceset/mo",), "did you mean '/forceset/mu'"),
    ],
)
def test_what_is_asked_for_must_be_there_and_once(values, muscles, said):
    with pytest.raises(SettingError, match=said):
        osimlite.muscle_curves(hung(muscle("thelen_default")), values, muscles)
