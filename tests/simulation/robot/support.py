"""Models for the tests of robots."""

from __future__ import annotations

import numpy as np

from osimlite.mechanics.multibody.joints import Mobilizer
from osimlite.mechanics.multibody.mechanism import (
    CoordinateInfo,
    MassProperties,
    Mechanism,
    MobileBody,
)
from osimlite.mechanics.multibody.spatial import make_offset


def one_body(motions, count, *, child_frame=None, names=None, locked=()) -> Mechanism:
    """Return a mechanism of ground and a body B on a joint with `count` coordinates."""
    names = names or [f"q{k}" for k in range(count)]
    infos = tuple(
        CoordinateInfo(
            name,
            f"/jointset/j/{name}",
            "/jointset/j",
            "coupled",
            default_value=0.4,
            range=(-1.0, 2.0),
            locked=k in locked,
        )
        for k, name in enumerate(names)
    )
    mobilizer = Mobilizer(
        "/jointset/j",
        "CustomJoint",
        motions,
        tuple(range(count)),
        make_offset((0.1, 0.2, 0.3), (0.3, -0.2, 0.5)),
        np.eye(4) if child_frame is None else child_frame,
    )
    body = MobileBody("B", "/bodyset/B", -1, MassProperties(2.0), mobilizer)
    return Mechanism("one", (body,), infos)
