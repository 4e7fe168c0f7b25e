"""Compare a human walking by reflexes with OpenSim under the same excitations."""

from __future__ import annotations

import pytest

from osimlite.models.walking import write_scenario
from osimlite.studies.reflexes.scenario import Scenario

opensim = pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle


def test_the_walk_is_opensim_s(tmp_path) -> None:
    """Compare all states after each of twenty control steps."""
    scenario = Scenario(write_scenario(tmp_path))
    steps = 20
    walked = scenario.walk(scenario.best(), duration=steps * scenario.step)
    opensim.Logger.setLevelString("error")
    model = opensim.Model(str(tmp_path / "human.osim"))
    state = model.initSystem()
    names = [
        str(name) for name in (model.getStateVariableNames().get(k) for k in range(state.getNY()))
    ]

    def put(row: int) -> None:
        for name in names:
            model.setStateVariableValue(state, name, float(walked.states[name][row]))

    def off(row: int) -> float:
        return max(
            abs(model.getStateVariableValue(state, name) - walked.states[name][row])
            for name in names
        )

    brain = opensim.PrescribedController()
    model.addController(brain)
    for label in walked.excitations.columns:
        brain.addActuator(model.getMuscles().get(label))
        function = opensim.PiecewiseConstantFunction()
        for row, value in enumerate(walked.excitations[label][:steps].tolist()):
            # As in SCONE, the derivative at the start of a control step still uses the previous
            # excitation.
            function.addPoint(row * scenario.step + 1e-12, value)
        brain.prescribeControlForActuator(label, function)
    state = model.initSystem()
    put(0)
    manager = opensim.Manager(model)
    manager.setIntegratorMethod(opensim.Manager.IntegratorMethod_SemiExplicitEuler2)
    manager.setIntegratorAccuracy(1e-3)
    manager.initialize(state)
    worst = []
    for row in range(1, steps + 1):
        state = manager.integrate(row * scenario.step)
        worst.append(off(row))

    # OpenSim iterates fiber velocities up to an error of 1e-10.
    assert max(worst) < 3e-9
