"""Run OpenSim's Moco on a study with goals of joint reactions and other loads for one iteration.

The script writes the study and the result. It runs in a folder with ``model.osim``,
``moments.sto``, ``loads.xml`` and ``loads.sto``.
"""

from __future__ import annotations

from pathlib import Path

import opensim as osim

from tests.oracle.moco_studies import begun, ended

model = Path("model.osim").read_text()
is_given = "<PositionMotion" in model
study, problem = begun([-1, 1.2], [-5, 7], [-10, 12], "/tau.*")
problem.setControlInfoPattern("/forceset/.*", [0.1, 0.7])
problem.setStateInfoPattern("/forceset/.*/activation", [0.1, 0.9])
problem.setStateInfoPattern("/forceset/.*/normalized_tendon_force", [0.2, 0.8])

for number, (joint, side, frame, measures) in enumerate(
    [
        ("/jointset/j0", "parent", "", []),
        ("/jointset/j1", "child", "/ground", ["moment-x", "force-y"]),
        ("/jointset/j1", "parent", "/bodyset/b0", ["force-x", "moment-z"]),
        ("/jointset/weld", "child", "", []),
        ("/jointset/hinge", "parent", "", []),
    ]
):
    if f'"{joint.rpartition("/")[2]}"' not in model:
        continue
    goal = osim.MocoJointReactionGoal(f"joint{number}", 1.0)
    goal.setJointPath(joint)
    goal.setLoadsFrame(side)
    if frame:
        goal.setExpressedInFramePath(frame)
    if measures:
        names = osim.StdVectorString()
        for measure in measures:
            names.append(measure)
        goal.setReactionMeasures(names)
        goal.setReactionWeight(measures[0], 0.3)
    problem.addGoal(goal)

for number, (paths, normalize) in enumerate(
    [([], False), (["/forceset/.*"], True), ([".*"], False)]
):
    goal = osim.MocoGeneralizedForceTrackingGoal(f"force{number}", 1.0)
    goal.setReference(osim.TableProcessor("moments.sto"))
    names = osim.StdVectorString()
    for path in paths:
        names.append(path)
    goal.setForcePaths(names)
    goal.setWeightForGeneralizedForcePattern("q.*", 0.7)
    goal.setWeightForGeneralizedForce("q0_moment", 0.4)
    goal.setNormalizeTrackingError(normalize)
    problem.addGoal(goal)

impulse = osim.MocoContactImpulseTrackingGoal("impulse", 1.0)
impulse.setExternalLoadsFile("loads.xml")
paths = osim.StdVectorString()
for number in range(2):
    paths.append(f"/contact{number}")
group = osim.MocoContactImpulseTrackingGoalGroup(paths, "foot")
impulse.addContactGroup(group)
impulse.setImpulseAxis(1)
if not is_given:
    problem.addGoal(impulse)

# With explicit tendon dynamics this goal requests a quantity that OpenSim has not computed yet, and
# fails.
if "explicit</tendon" not in model:
    balance = osim.MocoInitialVelocityEquilibriumDGFGoal("balance")
    balance.setMode("cost")
    problem.addGoal(balance)

solver = study.initCasADiSolver()
solver.set_num_mesh_intervals(3)
if is_given:
    solver.set_multibody_dynamics_mode("implicit")
solver.set_optim_max_iterations(1)
ended(study)
