"""Compare accelerations of exported CasADi functions with OpenSim's.

CasADi runs in another process, because it cannot be loaded together with OpenSim.
"""

from __future__ import annotations

import json
from importlib.util import find_spec

import numpy as np
import pytest

from tests.scripts import CASADI, run_script

opensim = pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = [
    pytest.mark.oracle,
    pytest.mark.skipif(
        find_spec("casadi") is None, reason="needs the casadi package (extra 'casadi')"
    ),
]

SCRIPT = """
import json, sys
import numpy as np
import osimlite

functions = osimlite.casadi(osimlite.read(sys.argv[1]))
rng, rows = np.random.default_rng(0), []
size = len(functions.coordinates)
for _ in range(6):
    x = functions.x.copy()
    x[:size] += 0.1 * rng.normal(size=size)
    x[size : 2 * size] += rng.normal(size=size)
    x[2 * size :] *= rng.uniform(0.9, 1.1, len(x) - 2 * size)
    u = rng.uniform(0.1, 0.9, len(functions.controls))
    xdot = functions.dynamics(0.0, x, u, functions.p).full().ravel()
    rows.append([x.tolist(), u.tolist(), xdot.tolist()])
print(json.dumps([functions.states, functions.controls, rows]))
"""


@pytest.mark.parametrize("number", ["m0014", "m0036", "m0066", "m0115"])
def test_accelerations_are_those_of_opensim(number, shared):
    (path,) = (shared / "corpus/models" / number).glob("*.osim")
    done = run_script(SCRIPT, path, modules=CASADI)
    states, controls, rows = json.loads(done.stdout)
    opensim.Logger.setLevelString("error")
    model = opensim.Model(str(path))
    # The test sets the controls itself.
    for controller in model.getControllerSet():
        controller.set_enabled(False)
    state = model.initSystem()
    for x, u, xdot in rows:
        for name, value in zip(states, x, strict=True):
            model.setStateVariableValue(state, name, value)
        model.realizeVelocity(state)
        vector = opensim.Vector(len(controls), 0.0)
        for name, value in zip(controls, u, strict=True):
            single = opensim.Vector(1, value)
            opensim.ScalarActuator.safeDownCast(model.getComponent(name)).addInControls(
                single, vector
            )
        model.setControls(state, vector)
        model.realizeAcceleration(state)
        wanted = np.array([model.getStateVariableDerivativeValue(state, name) for name in states])
        assert (
            np.max(np.abs(np.array(xdot) - wanted) / np.maximum(1.0, np.abs(wanted).max())) < 1e-9
        )
