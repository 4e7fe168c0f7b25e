"""nimblephysics as a reference, in a separate environment because it needs NumPy 1.

The variable OSIMLITE_NIMBLE names the Python of that environment: ``python3.11 -m venv nimble``,
then ``nimble/bin/pip install nimblephysics 'numpy<2'``.
"""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

VARIABLE = "OSIMLITE_NIMBLE"

# Script that calls one of its functions with arguments from standard input, and prints the result
# as JSON.
SCRIPT = """
import json, os, sys
import numpy as np
import nimblephysics as nimble

def poses(path, states):
    skeleton = nimble.biomechanics.OpenSimParser.parseOsim(path, "", True).skeleton
    names = [skeleton.getDofByIndex(index).getName() for index in range(skeleton.getNumDofs())]
    result = []
    for state in states:
        skeleton.setPositions(np.array(state))
        bodies = [skeleton.getBodyNode(index) for index in range(skeleton.getNumBodyNodes())]
        result.append({body.getName(): body.getWorldTransform().matrix().tolist() for body in bodies})
    return {"names": names, "poses": result}

def moments(path, positions, velocities, accelerations, gravity):
    skeleton = nimble.biomechanics.OpenSimParser.parseOsim(path, "", True).skeleton
    skeleton.setGravity(np.array(gravity))
    result = []
    for position, velocity, acceleration in zip(positions, velocities, accelerations):
        skeleton.setPositions(np.array(position))
        skeleton.setVelocities(np.array(velocity))
        result.append(skeleton.getInverseDynamics(np.array(acceleration)).tolist())
    return result

def subject(path):
    file = nimble.biomechanics.SubjectOnDisk(path)
    trials = []
    for trial in range(file.getNumTrials()):
        frames = file.readFrames(trial, 0, file.getTrialLength(trial), True, True)
        trials.append({
            "name": file.getTrialName(trial),
            "step": file.getTrialTimestep(trial),
            "missing": [reason.name for reason in file.getMissingGRF(trial)],
            "markers": [{name: list(p) for name, p in frame.markerObservations} for frame in frames],
            "plates": [[list(f) for f in frame.rawForcePlateForces] for frame in frames],
            "plate_points": [[list(f) for f in frame.rawForcePlateCenterOfPressures] for frame in frames],
            "plate_torques": [[list(f) for f in frame.rawForcePlateTorques] for frame in frames],
            "passes": [
                [
                    {
                        "positions": list(each.pos), "velocities": list(each.vel), "accelerations": list(each.acc),
                        "moments": list(each.tau), "contact_wrenches": list(each.groundContactWrenches),
                        "contact_points": list(each.groundContactCenterOfPressure),
                        "contact_torques": list(each.groundContactTorque),
                        "contact_forces": list(each.groundContactForce), "mass_center": list(each.comPos),
                        "mass_center_velocity": list(each.comVel), "mass_center_acceleration": list(each.comAcc),
                    }
                    for each in frame.processingPasses
                ]
                for frame in frames
            ],
        })
    header = {
        "mass": file.getMassKg(), "height": file.getHeightM(), "sex": file.getBiologicalSex(),
        "age": file.getAgeYears(), "bodies": list(file.getGroundForceBodies()), "notes": file.getNotes(),
        "tags": list(file.getSubjectTags()), "dofs": file.getNumDofs(),
    }
    return {"header": header, "trials": trials}

question = json.load(sys.stdin)
answer = {"poses": poses, "moments": moments, "subject": subject}[question[0]](*question[1:])
os.write(1, b"\\nANSWER" + json.dumps(answer).encode() + b"\\n")
"""


def ask_nimble(*question: Any) -> Any:
    """Run a function of SCRIPT in Nimble's environment and return its result; skip the test without Nimble."""
    python = os.environ.get(VARIABLE)
    if not python:
        pytest.skip(f"needs nimblephysics: {VARIABLE} names no Python that has it (with numpy<2)")
    done = subprocess.run(
        [python, "-c", SCRIPT],
        input=json.dumps(question),
        capture_output=True,
        text=True,
        errors="replace",
        check=False,
        timeout=240,
        env={name: value for name, value in os.environ.items() if name != "PYTHONPATH"},
    )
    for line in done.stdout.splitlines():
        if line.startswith("ANSWER"):
            return json.loads(line.removeprefix("ANSWER"))
    raise AssertionError(f"Nimble ended with {done.returncode}: {done.stderr[-500:]}")


def find_nimble_poses(path: Path, states: Sequence[Sequence[float]]) -> tuple[list[str], list[Any]]:
    """Compute poses of bodies in Nimble.

    Args:
        path: model file.
        states: positions of all degrees of freedom, one list per state.

    Returns:
        Names of Nimble's degrees of freedom, and the poses of its bodies in ground at each state.
    """
    answer = ask_nimble("poses", str(path.resolve()), [list(map(float, state)) for state in states])
    return answer["names"], answer["poses"]
