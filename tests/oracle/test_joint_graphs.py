"""Compare random graphs of bodies and joints with OpenSim: verdicts and accelerations.

Models that OpenSim rejects must have an error, and duplicate joints must be treated as in OpenSim.
The quick suite has 30 graphs, the full one 120. ``OSIMLITE_EDITS=2000 OSIMLITE_SEED=7`` sets their
number and the seed.
"""

from __future__ import annotations

import json
import os
import random
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import osimlite
from osimlite.errors import UnsupportedError
from osimlite.lint import validate
from osimlite.mechanics.multibody.build import build_mechanism
from tests.oracle.support import claims_refusal
from tests.scripts import run_script
from tests.suite import choose

pytestmark = pytest.mark.oracle

WANTED = int(os.environ.get("OSIMLITE_EDITS", choose("30", "120")))
# Number of coordinates of each class of joints.
COORDINATES = {
    "WeldJoint": 0,
    "PinJoint": 1,
    "SliderJoint": 1,
    "UniversalJoint": 2,
    "BallJoint": 3,
    "GimbalJoint": 3,
    "PlanarJoint": 3,
    "FreeJoint": 6,
    "CustomJoint": 1,
}
TURN = """<SpatialTransform><TransformAxis name="rotation1"><coordinates>{}_0</coordinates><axis>0 0 1</axis>
    <LinearFunction name="function"><coefficients>1 0</coefficients></LinearFunction></TransformAxis>
    <TransformAxis name="rotation2"><axis>0 1 0</axis></TransformAxis>
    <TransformAxis name="rotation3"><axis>1 0 0</axis></TransformAxis></SpatialTransform>"""
OFFSET = '<PhysicalOffsetFrame name="{}"><socket_parent>{}</socket_parent></PhysicalOffsetFrame>'
# Class of a joint, its parent and its child.
Joint = tuple[str, str, str]


def text(bodies: list[str], joints: list[Joint], offsets: list[bool]) -> str:
    """Return the text of a model.

    Args:
        bodies: XML elements of the bodies.
        joints: class, parent and child of each joint.
        offsets: for each joint, whether it uses offset frames.
    """
    written = []
    for number, ((cls, parent, child), is_offset) in enumerate(zip(joints, offsets, strict=True)):
        coordinates = "".join(
            f'<Coordinate name="j{number}_{k}" />' for k in range(COORDINATES[cls])
        )
        frames = (
            f"<frames>{OFFSET.format('p', parent)}{OFFSET.format('c', child)}</frames>"
            if is_offset
            else ""
        )
        written.append(
            f'<{cls} name="j{number}"><socket_parent_frame>{"p" if is_offset else parent}</socket_parent_frame>'
            f"<socket_child_frame>{'c' if is_offset else child}</socket_child_frame>{frames}"
            f"<coordinates>{coordinates}</coordinates>{TURN.format(f'j{number}') * (cls == 'CustomJoint')}</{cls}>"
        )
    return (
        f'<OpenSimDocument Version="40600"><Model name="m"><BodySet><objects>{"".join(bodies)}</objects></BodySet>'
        f"<JointSet><objects>{''.join(written)}</objects></JointSet></Model></OpenSimDocument>"
    )


def body(name: str, mass: float = 1.0, more: str = "", center: str = "0 0 0") -> str:
    return (
        f'<Body name="{name}">{more}<mass>{mass}</mass><mass_center>{center}</mass_center>'
        f"<inertia>{mass / 4} {mass / 4} {mass / 4} {mass / 100} {mass / 50} {mass / 40}</inertia></Body>"
    )


def graph(draw: random.Random) -> str:
    """Return a model of random bodies and joints.

    Some bodies have no mass, some have a frame, and the joints close up to two loops.
    """
    names = [f"b{number}" for number in range(draw.randint(1, 5))]
    light, frame = draw.choice((0.0, 0.2)), f"<components>{OFFSET.format('f', '..')}</components>"
    bodies = [
        body(name, float(draw.random() >= light), frame * (draw.random() < 0.25)) for name in names
    ]
    group = {name: name for name in [*names, "ground"]}
    joints: list[Joint] = []
    for _ in range(draw.randint(0, len(names) + 1)):
        one, two = draw.sample([*group], 2)
        if group[one] != group[two]:
            group = {
                name: group[one] if held == group[two] else held for name, held in group.items()
            }
            parent, child = (
                "/ground" if end == "ground" else f"/bodyset/{end}" for end in (one, two)
            )
            joints.append((draw.choice([*COORDINATES]), parent, child))
    for _ in range(draw.randint(0, 2) if joints else 0):
        cls, one, two = draw.choice(joints)
        parent, child = draw.sample([one, two], 2)
        joints.insert(
            draw.randint(0, len(joints)), (draw.choice([cls, *COORDINATES]), parent, child)
        )
    return text(bodies, joints, [draw.random() < 0.4 for _ in joints])


@pytest.mark.timeout(7200)
def test_what_opensim_says_of_random_joints(
    opensim_says: Callable[[Path], str | None], tmp_path: Path
) -> None:
    draw, path = random.Random(int(os.environ.get("OSIMLITE_SEED", "1"))), tmp_path / "m.osim"
    refused = 0
    for _ in range(WANTED):
        path.write_text(graph(draw))
        said, errors = opensim_says(path), validate(path).errors
        refused += said is not None
        assert said is None or errors, f"{said}\n{path.read_text()}"
        claims = [finding for finding in errors if claims_refusal(finding)]
        assert said is not None or not claims, f"{claims}\n{path.read_text()}"
    assert refused > WANTED / 10


ASK = """
import json, sys, opensim
opensim.Logger.setLevelString("Off")
model = opensim.Model(sys.argv[1])
state = model.initSystem()
model.realizeAcceleration(state)
print(json.dumps([c.getAccelerationValue(state) for c in model.getCoordinateSet()]))
"""


@pytest.mark.parametrize("reverse", [False, True])
@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("PinJoint", "PinJoint"),
        ("PinJoint", "BallJoint"),
        ("BallJoint", "GimbalJoint"),
        ("SliderJoint", "SliderJoint"),
        ("FreeJoint", "PinJoint"),
        ("CustomJoint", "PinJoint"),
        ("PinJoint", "WeldJoint"),
        ("WeldJoint", "PinJoint"),
        ("BallJoint", "WeldJoint"),
        ("PinJoint", "FreeJoint"),
        ("BallJoint", "FreeJoint"),
    ],
)
@pytest.mark.parametrize("parent", ["/ground", "/bodyset/b1"])
def test_a_joint_that_stands_twice_moves_as_in_opensim(
    tmp_path: Path, parent: str, first: str, second: str, reverse: bool
) -> None:
    path, ends = tmp_path / "m.osim", (parent, "/bodyset/b0")
    bodies = [body("b0", 2.0, center="0.1 0.02 0.03"), body("b1", 3.0, center="0.05 0.2 -0.1")]
    other = ("PinJoint", "/ground", "/bodyset/b1")
    joints = [other, (first, *ends), (second, *(ends[::-1] if reverse else ends))]
    path.write_text(text(bodies, joints, [False] * 3))
    done = run_script(ASK, path, check=False)
    (finding,) = (finding for finding in validate(path, select="OSIM404"))
    assert ("rejects" in finding.message.replace("it rejects the model", "")) == (
        done.returncode != 0
    )
    if done.returncode != 0:
        return
    if second == "FreeJoint":
        with pytest.raises(UnsupportedError, match="closes a loop"):
            build_mechanism(osimlite.read(path))
        return
    theirs = json.loads(done.stdout)
    mechanism = build_mechanism(osimlite.read(path), opensim_derivatives=True)
    ours = mechanism.acceleration(*mechanism.default_state())
    assert np.abs(ours - theirs).max() < 1e-9
    # Without `opensim_derivatives` the body has its own mass and inertia.
    right = build_mechanism(osimlite.read(path))
    assert right.total_mass == pytest.approx(5.0)
