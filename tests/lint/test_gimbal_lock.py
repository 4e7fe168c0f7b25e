"""Check gimbal lock: the three axes of a joint lie in one plane, in any orientation."""

from __future__ import annotations

import numpy as np
import pytest

import osimlite
from osimlite.lint import validate
from tests.simple_models import make_single_body

# Number of random joints.
SIZE = 12


def turned_by(first: np.ndarray, second: np.ndarray, third: np.ndarray) -> osimlite.Model:
    """Return a body on a joint with three rotation axes, at zero angles."""
    names = ("a", "b", "c")
    axes = {
        f"rotation{number}": osimlite.TransformAxis(
            name=f"rotation{number}",
            axis=tuple(map(float, axis)),
            function=osimlite.LinearFunction(coefficients=(1.0, 0.0)),
            coordinates=(name,),
        )
        for number, (name, axis) in enumerate(zip(names, (first, second, third), strict=True), 1)
    }
    joint = osimlite.CustomJoint(
        name="joint",
        coordinates=[osimlite.Coordinate(name=name) for name in names],
        spatial_transform=osimlite.SpatialTransform(**axes),
    )
    return make_single_body(joint)


@pytest.mark.parametrize("seed", range(SIZE))
def test_axes_in_a_plane_are_in_gimbal_lock_and_no_others(seed: int) -> None:
    rng = np.random.default_rng(seed)
    first, second, across = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    angle, lift = rng.uniform(0.3, 1.2, 2)
    inside = np.cos(angle) * first + np.sin(angle) * second
    codes = set(validate(turned_by(first, second, inside), select="OSIM416").codes)
    assert codes == {"OSIM416"}
    beside = np.cos(lift) * inside + np.sin(lift) * across
    assert not validate(turned_by(first, second, beside), select="OSIM416").findings
