"""Our own form of MuJoCo's wrapping against MuJoCo itself."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from osimlite.translate.mjcf.wrapping import bend

RADIUS = 0.5


def lengths(kind, ends, side):
    """Lengths (P,) of a tendon from `ends` (2, P, 3) around a geom at the origin, as the installed MuJoCo has them."""
    where = "" if side is None else f'<site name="side" pos="{" ".join(map(repr, side.tolist()))}"/>'
    model = mujoco.MjModel.from_xml_string(f"""<mujoco><worldbody>{where}
        <geom name="geom" type="{kind}" size="{RADIUS} {1 if kind == "cylinder" else ""}" contype="0" conaffinity="0"/>
        <body mocap="true"><site name="a"/></body><body mocap="true"><site name="b"/></body></worldbody>
        <tendon><spatial><site site="a"/><geom geom="geom" {"" if side is None else 'sidesite="side"'}/><site site="b"/>
        </spatial></tendon></mujoco>""")
    data = mujoco.MjData(model)
    found = []
    for pair in ends.swapaxes(0, 1):
        data.mocap_pos[:] = pair
        mujoco.mj_fwdPosition(model, data)
        found.append(data.ten_length[0])
    return np.array(found)


@pytest.mark.parametrize("distance", [None, 0.1, 0.45, 1.0])
@pytest.mark.parametrize("kind", ["sphere", "cylinder"])
def test_as_mujoco(kind, distance):
    random = np.random.default_rng(3)
    ends, direction = random.normal(size=(2, 400, 3)), random.normal(size=3)
    side = None if distance is None else distance * direction / np.linalg.norm(direction)
    first, second = ends
    version = int(mujoco.__version__.partition(".")[0])
    found = bend(kind, RADIUS, first, second, None if side is None else np.broadcast_to(side, first.shape), version)
    around = np.linalg.norm(found.first - first, axis=1) + found.length + np.linalg.norm(second - found.second, axis=1)
    whole = np.where(found.touches, around, np.linalg.norm(second - first, axis=1))
    assert 0.05 < found.touches.mean() < 0.95
    np.testing.assert_allclose(whole, lengths(kind, ends, side), rtol=0.0, atol=1e-11)
