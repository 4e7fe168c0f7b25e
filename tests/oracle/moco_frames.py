"""Run OpenSim's Moco on a study with goals and a path constraint of frames for one iteration.

The script writes the study and the result. It runs in a folder with ``model.osim``, ``places.sto``,
``turns.sto``, ``spins.sto``, ``pulls.sto`` and ``motion.sto``.
"""

from __future__ import annotations

import opensim as osim

from tests.oracle.moco_studies import begun, ended

BODIES = "/bodyset/b0", "/bodyset/b1"

study, problem = begun([-10, 10], [-50, 50], [-100, 100])
problem.addParameter(osim.MocoParameter("mass", "/bodyset/b1", "mass", osim.MocoBounds(0.5, 2.0)))

places = osim.MocoTranslationTrackingGoal("places", 1.5)
places.setTranslationReferenceFile("places.sto")
places.setWeightForFrame("/bodyset/b1", 2.0)
turns = osim.MocoOrientationTrackingGoal("turns", 0.7)
# OpenSim cannot read the orientation files that it writes, therefore the goal gets a table instead
# of a file name.
quaternions = osim.TimeSeriesTableQuaternion("turns.sto")
turns.setRotationReference(osim.OpenSenseUtilities.convertQuaternionsToRotations(quaternions))
moved = osim.MocoOrientationTrackingGoal("moved", 1.3)
moved.setStatesReference(osim.TableProcessor("motion.sto"))
moved.setWeightForFrame("/bodyset/b0", 0.4)
shifted = osim.MocoTranslationTrackingGoal("shifted", 0.9)
spun = osim.MocoAngularVelocityTrackingGoal("spun", 0.02)
for goal in (shifted, spun):
    goal.setStatesReference(osim.TableProcessor("motion.sto"))
spins = osim.MocoAngularVelocityTrackingGoal("spins", 0.01)
spins.setAngularVelocityReferenceFile("spins.sto")
pulls = osim.MocoAccelerationTrackingGoal("pulls", 1e-4)
pulls.setAccelerationReferenceFile("pulls.sto")
felt = osim.MocoAccelerationTrackingGoal("felt", 1e-4)
felt.setAccelerationReferenceFile("pulls.sto")
felt.setGravityOffset(True)
felt.setExpressAccelerationsInTrackingFrames(True)
for goal in (places, turns, moved, shifted, spun, spins, pulls, felt):
    osim_paths = osim.StdVectorString()
    for path in BODIES:
        osim_paths.append(path)
    goal.setFramePaths(osim_paths)
    problem.addGoal(goal)

lengths = osim.MocoStepLengthAsymmetryGoal("lengths", 0.3)
lengths.setLeftFootFrame(BODIES[0])
lengths.setRightFootFrame(BODIES[1])
lengths.setStrideLength(0.8)
lengths.setTargetAsymmetry(0.1)
lengths.setWalkingDirection("negative-y")
lengths.setAsymmetrySmoothing(0.05)
problem.addGoal(lengths)

times = osim.MocoStepTimeAsymmetryGoal("times", 0.2)
for side, number in (("Left", 0), ("Right", 1)):
    paths = osim.StdVectorString()
    paths.append(f"/contact{number}")
    getattr(times, f"set{side}ContactGroup")(paths, f"/contact{number}")
times.setWalkingDirection("positive-x")
times.setContactForceThreshold(3.0)
times.setTargetAsymmetry(-0.1)
problem.addGoal(times)

heavy = osim.MocoExpressionBasedParameterGoal("heavy", 0.6, "square(m - 0.7) + 1/m")
heavy.addParameter(
    osim.MocoParameter("mass", "/bodyset/b1", "mass", osim.MocoBounds(0.5, 2.0)), "m"
)
problem.addGoal(heavy)

apart = osim.MocoFrameDistanceConstraint()
apart.setName("apart")
apart.addFramePair(osim.MocoFrameDistanceConstraintPair("/ground", "/bodyset/b1", 0.2, 1.9))
apart.setProjection("plane")
apart.setProjectionVector(osim.Vec3(1.0, 0.2, 0.0))
problem.addPathConstraint(apart)

solver = study.initCasADiSolver()
solver.set_num_mesh_intervals(2)
solver.set_transcription_scheme("trapezoidal")
# OpenSim builds the system anew for each value of a parameter, which is slow. Forward differences
# need the fewest evaluations, and the test compares only the costs at the final point.
solver.set_optim_finite_difference_scheme("forward")
solver.set_optim_max_iterations(1)
ended(study)
