"""Tests of paths around one surface against OpenSim, as Python with bounded vectors and as machine code."""

from __future__ import annotations

import gzip
import json
from math import isnan

import numpy as np
import pytest

from osimlite.mechanics.kernels import wrapping
from osimlite.mechanics.kernels.layout import ITEM
from osimlite.mechanics.kernels.wrap_cylinder import smooth_heights
from osimlite.mechanics.multibody.spatial import invert_transform, make_offset, make_transform
from osimlite.simulation.engines.linking import MACHINE_CODE
from tests.conftest import ROOT
from tests.simulation.checked import Checked

SIDES = {
    "all": (0, 0),
    "x": (0, 1),
    "-x": (0, -1),
    "y": (1, 1),
    "-y": (1, -1),
    "z": (2, 1),
    "-z": (2, -1),
}
METHODS = {
    "hybrid": wrapping.ELLIPSOID_METHOD.HYBRID,
    "midpoint": wrapping.ELLIPSOID_METHOD.MIDPOINT,
    "axial": wrapping.ELLIPSOID_METHOD.AXIAL,
}

with gzip.open(ROOT / "fixtures" / "forces" / "wrap_cases.json.gz") as file:
    TABLE = json.load(file)
SETUPS = {setup["name"]: setup for setup in TABLE if len(setup["objects"]) == 1}


def numbers(surface, *, alone):
    """Return the parameters of a surface as its law expects them."""
    axis, side = SIDES[surface["quadrant"]]
    return np.array(
        [axis, side, METHODS[surface["method"]], alone, *surface["dimensions"]], dtype=float
    )


def bent(law, p, first, second):
    """Evaluate the law of a surface for one segment of a path.

    Returns:
        Result code, tangent points (2, 3), and the length on the surface.
    """
    e = np.full(wrapping.WRAP_WORK.END, 7.0)
    e[wrapping.WRAP_WORK.FIRST_END : wrapping.WRAP_WORK.FIRST_TANGENT] = *first, *second
    item, state = np.zeros(ITEM.DETAILS, dtype=np.int64), np.zeros(1)
    says = law(item, p, e, state, state, 0)
    return (
        says,
        e[wrapping.WRAP_WORK.FIRST_TANGENT : wrapping.WRAP_WORK.SURFACE_LENGTH].reshape(2, 3),
        e[wrapping.WRAP_WORK.SURFACE_LENGTH],
    )


@pytest.mark.parametrize("code", [Checked("Python"), MACHINE_CODE], ids=lambda code: code.name)
@pytest.mark.parametrize("name", SETUPS)
def test_surface(name, code):
    (surface,) = SETUPS[name]["objects"]
    law, p = code.get_entry(f"wrap_{surface['kind'].lower()}"), numbers(surface, alone=1.0)
    frame = make_offset(surface["translation"], surface["xyz_body_rotation"])
    for case in SETUPS[name]["cases"]:
        to_surface = invert_transform(make_transform(case["R_W"], case["p_W"]) @ frame)
        ends = [(to_surface @ [*case[end], 1.0])[:3] for end in ("p_A", "p_B")]
        says, points, length = bent(law, p, *ends)
        wraps = says > wrapping.WRAPPING.NONE and not np.isnan(points).any()
        assert wraps == (len(case["points"]) == 4)
        if not wraps:
            assert np.linalg.norm(ends[0] - ends[1]) == pytest.approx(case["length"], abs=1e-15)
            continue
        expected = [point[1:4] for point in case["points"][1:3]]
        assert points @ frame[:3, :3].T + frame[:3, 3] == pytest.approx(
            np.array(expected), abs=1e-14
        )
        whole = length + sum(
            np.linalg.norm(end - point) for end, point in zip(ends, points, strict=True)
        )
        assert (
            isnan(whole)
            if isnan(case["length"])
            else whole == pytest.approx(case["length"], abs=2e-15)
        )


@pytest.mark.parametrize("height", [1e200, np.nan])
def test_a_helix_beyond_all_numbers_stays(height):
    result = smooth_heights(
        (1.0, 1.0, 0.0), (-1.0, 1.0, height), (1.0, 0.0, 0.0), (-1.0, 0.0, height), 3.0, 3.0
    )
    assert result == pytest.approx((0.0, height), nan_ok=True)
