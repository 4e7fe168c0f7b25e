"""Check the computation of the valid inertia that is nearest to an invalid one."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from osimlite.io.document.source import Source
from osimlite.lint import validate
from osimlite.lint.fixes import apply_fixes
from osimlite.lint.inertia import compute_principal_axes, find_possible_inertia

numbers = st.floats(-10, 10, allow_subnormal=False).map(lambda number: round(number, 6))


def matrix(inertia):
    xx, yy, zz, xy, xz, yz = inertia
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


@given(st.tuples(*[numbers] * 6))
def test_axes_are_those_of_the_matrix(inertia):
    moments, axes = compute_principal_axes(inertia)
    v = np.array(axes)
    assert np.allclose(v @ v.T, np.eye(3), atol=1e-12)
    assert np.allclose(v @ np.diag(moments) @ v.T, matrix(inertia), atol=1e-10)


@given(st.tuples(*[numbers] * 6), st.integers(0, 2**32 - 1))
def test_no_possible_inertia_is_nearer(inertia, seed):
    nearest = matrix(find_possible_inertia(inertia))
    low, middle, high = np.linalg.eigvalsh(nearest)
    assert high <= low + middle + 1e-9
    distance = np.linalg.norm(nearest - matrix(inertia))
    draw = np.random.default_rng(seed)
    for scale in (1e-3, 0.1, 1.0):
        # The inertia of point masses near the result is valid. None may be nearer to the invalid
        # inertia.
        half = np.eye(3) * np.trace(nearest) / 2 - nearest
        root = np.linalg.cholesky(half + 1e-9 * np.eye(3)) + scale * draw.normal(size=(3, 3))
        other = np.eye(3) * np.trace(root @ root.T) - root @ root.T
        assert distance <= np.linalg.norm(other - matrix(inertia)) + 1e-7


@given(st.tuples(*[st.floats(0.01, 10)] * 3))
def test_a_possible_inertia_stays(masses):
    one, two, three = masses
    inertia = (two + three, one + three, one + two, 0.0, 0.0, 0.0)
    assert find_possible_inertia(inertia) == pytest.approx(inertia)


def test_the_mend_is_unsafe_and_leaves_nothing_to_find():
    text = (
        '<OpenSimDocument Version="40600"><Model name="m"><BodySet><objects><Body name="b"><mass>1</mass>'
        "<inertia>1 1 5 0.1 0 0</inertia></Body></objects></BodySet></Model></OpenSimDocument>"
    )
    source = Source(text.encode())
    report = validate(source, select="OSIM502")
    assert report.codes == {"OSIM502": 1} and not report.findings[0].fixable
    data, count = apply_fixes(source, report, unsafe=True)
    assert count == 1 and not validate(Source(data), select="OSIM50").findings
