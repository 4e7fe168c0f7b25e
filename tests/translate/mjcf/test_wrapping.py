"""Tests of osimlite's implementation of MuJoCo's wrapping against MuJoCo."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest

from osimlite.translate.mjcf.wrapping import bend_tendon

RADIUS = 0.5

# Script that prints the version, and the lengths of the tendon for pairs of end points.
READER = """
import json, sys, mujoco
text, ends = json.load(sys.stdin)
model = mujoco.MjModel.from_xml_string(text)
data = mujoco.MjData(model)
lengths = []
for pair in ends:
    data.mocap_pos[:] = pair
    mujoco.mj_fwdPosition(model, data)
    lengths.append(data.ten_length[0])
print(json.dumps([mujoco.__version__, lengths]))
"""


def text(kind, side):
    """Return an MJCF of a tendon between two movable bodies, around a geom at the origin.

    Args:
        kind: type of the geom.
        side: position of the side site; None for none.
    """
    where = (
        "" if side is None else f'<site name="side" pos="{" ".join(map(repr, side.tolist()))}"/>'
    )
    return f"""<mujoco><worldbody>{where}
        <geom name="geom" type="{kind}" size="{RADIUS} {1 if kind == "cylinder" else ""}" contype="0" conaffinity="0"/>
        <body mocap="true"><site name="a"/></body><body mocap="true"><site name="b"/></body></worldbody>
        <tendon><spatial><site site="a"/><geom geom="geom" {"" if side is None else 'sidesite="side"'}/><site site="b"/>
        </spatial></tendon></mujoco>"""


@pytest.mark.parametrize("distance", [None, 0.1, 0.45, 1.0])
@pytest.mark.parametrize("kind", ["sphere", "cylinder"])
@pytest.mark.parametrize("which", ["installed", pytest.param("older", marks=pytest.mark.full)])
def test_as_mujoco(which, kind, distance, request):
    python = sys.executable if which == "installed" else request.getfixturevalue("older")
    random = np.random.default_rng(3)
    ends, direction = random.normal(size=(2, 400, 3)), random.normal(size=3)
    side = None if distance is None else distance * direction / np.linalg.norm(direction)
    given = json.dumps([text(kind, side), ends.swapaxes(0, 1).tolist()])
    made = subprocess.run(
        [python, "-c", READER], input=given, capture_output=True, text=True, check=True
    )
    version, lengths = json.loads(made.stdout)

    first, second = ends
    sites = None if side is None else side[None, None]
    one = np.array([0])
    result = bend_tendon(
        kind,
        np.array([[RADIUS]]),
        first[None],
        second[None],
        sites,
        one,
        int(version.partition(".")[0]),
    )
    touches, leaves, returns, length = (
        way[result.choice[0], 0, np.arange(len(first))] for way in result[:4]
    )
    around = (
        np.linalg.norm(leaves - first, axis=1) + length + np.linalg.norm(second - returns, axis=1)
    )
    whole = np.where(touches, around, np.linalg.norm(second - first, axis=1))
    assert 0.05 < touches.mean() < 0.95
    np.testing.assert_allclose(whole, lengths, rtol=0.0, atol=1e-11)
