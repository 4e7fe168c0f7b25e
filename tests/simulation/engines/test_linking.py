"""Tests that simulations have the same results with all sources of kernels."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest

import osimlite
from osimlite.base.require import find_missing_packages
from osimlite.derivatives import tangents
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.simulation.engines import linking
from osimlite.simulation.engines.machine_code import has_machine_code
from tests.simulation.elements.muscle_rows import hung, muscle

WALK = """
import osimlite
from osimlite.models.dynamic_walker import dynamic_walker
walk = osimlite.simulate(dynamic_walker(), 0.05, engine="compiled", accuracy=1e-4)
print(walk.summary["versions"]["engine"], walk.values[-1].tobytes().hex(), sep="\\n")
"""


def run_by(source):
    """Run the walk with one source of machine code in a separate process.

    Returns:
        Name of the source, and the final state.
    """
    environment = {**os.environ, "OSIMLITE_KERNELS": source}
    done = subprocess.run(
        [sys.executable, "-c", WALK], capture_output=True, text=True, env=environment, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.split("\n")[:2]


@pytest.mark.full
@pytest.mark.timeout(900)
@pytest.mark.parametrize("source", ["compiler", "numba"])
def test_a_motion_is_the_same_to_the_last_bit_by_every_source(source):
    if source == "numba" and find_missing_packages("numba"):
        pytest.skip("needs numba (extra 'jit')")
    python, library, other = run_by("python"), run_by(""), run_by(source)
    assert python[0].startswith("Python") and other[0].startswith(
        {"compiler": "C++", "numba": "numba"}[source]
    )
    assert python[1] == library[1] == other[1]


@pytest.mark.skipif(not has_machine_code(), reason="there is no machine code to compare with")
@pytest.mark.parametrize(
    "make", [dynamic_walker, lambda: hung(muscle("thelen_default"))], ids=["walker", "muscle"]
)
def test_derivatives_in_python_are_those_of_machine_code(make, monkeypatch):
    def linearize():
        model = osimlite.tangents(make())
        return model.linear(0.0, model.x, model.u)

    machine = linearize()
    monkeypatch.setattr(
        tangents, "load_tangent_code", lambda: linking.PythonTangents(tangents.DIRECTIONS)
    )
    for one, other in zip(machine, linearize(), strict=True):
        np.testing.assert_allclose(
            other, one, rtol=1e-12, atol=1e-12 * np.abs(one).max(initial=1.0)
        )
