"""Tables of the tools that can be run and of the analyses that can be computed, by OpenSim's class names."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

TOOLS: dict[str, str] = {
    "AnalyzeTool": "osimlite.tools.analyze_tool.run_analyze_tool",
    "CMCTool": "osimlite.tools.tracking_tools.run_cmc_tool",
    "ForwardTool": "osimlite.tools.forward_tool.run_forward_tool",
    "IMUInverseKinematicsTool": "osimlite.tools.fitting_tools.run_imu_inverse_kinematics_tool",
    "IMUPlacer": "osimlite.tools.fitting_tools.run_imu_placer",
    "InverseDynamicsTool": "osimlite.tools.inverse_dynamics_tool.run_inverse_dynamics_tool",
    "InverseKinematicsTool": "osimlite.tools.fitting_tools.run_inverse_kinematics_tool",
    "MocoInverse": "osimlite.tools.moco_tools.run_moco_inverse",
    "MocoStudy": "osimlite.tools.moco_tools.run_moco_study",
    "MocoTrack": "osimlite.tools.moco_tools.run_moco_track",
    "RRATool": "osimlite.tools.tracking_tools.run_rra_tool",
    "ScaleTool": "osimlite.tools.fitting_tools.run_scale_tool",
}
"""Functions `run_...(job, outcome)` that carry out a setup, by its class; imported when they are needed."""

ANALYSES: dict[str, str] = {
    "Actuation": "osimlite.tools.analyses.forces.write_actuation",
    "BodyKinematics": "osimlite.tools.analyses.kinematics.write_body_kinematics",
    "ForceReporter": "osimlite.tools.analyses.reporters.write_forces",
    "JointReaction": "osimlite.tools.analyses.forces.write_joint_reactions",
    "Kinematics": "osimlite.tools.analyses.kinematics.write_kinematics",
    "MuscleAnalysis": "osimlite.tools.analyses.muscles.write_muscle_analysis",
    "OutputReporter": "osimlite.tools.analyses.reporters.write_outputs",
    "PointKinematics": "osimlite.tools.analyses.kinematics.write_point_kinematics",
    "ProbeReporter": "osimlite.tools.analyses.reporters.write_probes",
    "StatesReporter": "osimlite.tools.analyses.reporters.write_states",
    "StaticOptimization": "osimlite.tools.analyses.muscles.write_static_optimization",
}
"""Functions `write_...(analysis, motion, tables)` that compute an analysis, by its class."""


def import_function(path: str) -> Callable[..., Any]:
    """Return a function, and import its module if necessary.

    Args:
        path: module and name of the function, joined by a dot, as in :data:`TOOLS`.
    """
    module, _, name = path.rpartition(".")
    function: Callable[..., Any] = getattr(import_module(module), name)
    return function
