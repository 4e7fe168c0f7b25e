"""Solve a study of a constrained model with OpenSim's Moco and the method of Bordalba 2023.

The script writes the study and its solution. It runs in a folder with ``model.osim``. Its arguments
are the transcription scheme and the mode of the multibody dynamics.
"""

from __future__ import annotations

import sys

import opensim as osim

from tests.oracle.moco_studies import begun, ended

study, problem = begun([-3, 3], [-20, 20], [-100, 100])
problem.setStateInfo("/jointset/j0/q0/value", [-3, 3], 0.2, 0.6)
problem.setStateInfo("/jointset/j0/q0/speed", [-20, 20], 0, 0)
problem.addGoal(osim.MocoControlGoal("effort"))
solver = study.initCasADiSolver()
solver.set_num_mesh_intervals(3)
solver.set_transcription_scheme(sys.argv[1])
solver.set_multibody_dynamics_mode(sys.argv[2])
solver.set_kinematic_constraint_method("Bordalba2023")
solver.set_projection_slack_variable_bounds(osim.MocoBounds(-0.1, 0.1))
solver.set_state_projection_distance_weight(1e-2)
solver.set_optim_convergence_tolerance(1e-4)
solver.set_optim_constraint_tolerance(1e-4)
ended(study)
