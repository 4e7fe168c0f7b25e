"""Solve a study with goals and path constraints with OpenSim's Moco.

The script writes the study and its solution. It runs in a folder with ``model.osim``,
``markers.trc``, ``controls.sto`` and ``guess.sto``.
"""

from __future__ import annotations

import opensim as osim

from tests.oracle.moco_studies import begun, ended

study, problem = begun([-10, 10], [-50, 50], [-100, 100])
controls = osim.MocoControlTrackingGoal("controls", 1.5)
controls.setReference(osim.TableProcessor("controls.sto"))
controls.setWeightForControl("/tau1", 0.7)
controls.addScaleFactor("of_tau1", "/tau1", osim.MocoBounds(0.2, 1.5))
problem.addGoal(controls)
markers = osim.MocoMarkerTrackingGoal("markers", 2.0)
reference = osim.MarkersReference()
reference.set_marker_file("markers.trc")
reference.set_default_weight(3.0)
weights = osim.SetMarkerWeights()
weights.cloneAndAppend(osim.MarkerWeight("tip", 3.0))
reference.setMarkerWeightSet(weights)
markers.setMarkersReference(reference)
markers.addScaleFactor("of_tip", "tip", 1, osim.MocoBounds(0.4, 1.2))
problem.addGoal(markers)
end = osim.MocoMarkerFinalGoal("end", 0.5)
end.setPointName("/markerset/tip")
end.setReferenceLocation(osim.Vec3(0.3, 0.2, 0.1))
problem.addGoal(end)
bound = osim.MocoControlBoundConstraint()
bound.setName("controls_between")
bound.addControlPath("/tau0")
bound.setLowerBound(osim.Sine(0.2, 3, 0, -1.0))
bound.setUpperBound(osim.LinearFunction(0.5, 0.2))
problem.addPathConstraint(bound)
below = osim.MocoStateBoundConstraint()
below.setName("knee_below")
below.addStatePath("/jointset/j1/q1/value")
below.setUpperBound(osim.Constant(0.25))
problem.addPathConstraint(below)
solver = study.initCasADiSolver()
solver.set_num_mesh_intervals(15)
solver.set_parameters_require_initsystem(False)
solver.set_optim_convergence_tolerance(1e-6)
solver.set_optim_constraint_tolerance(1e-6)
solver.setGuessFile("guess.sto")
ended(study)
