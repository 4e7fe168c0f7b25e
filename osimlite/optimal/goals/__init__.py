"""Goals of Moco studies: the table of all supported goal classes and the functions that formulate them.

A new goal is a function ``build_..._goal(goal, problem)`` in the module of its subject and a line in
:data:`GOAL_BUILDERS`. It receives the goal as the schema has it and the
:class:`~osimlite.optimal.problem.Problem`, and returns the
:class:`~osimlite.optimal.point.GoalTerms`. Weights, modes, bounds and divisions (by displacement,
duration, mass) are applied to all goals alike by :class:`~osimlite.optimal.program.Program`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from osimlite.optimal.goals.asymmetry import (
    build_step_length_asymmetry_goal,
    build_step_time_asymmetry_goal,
)
from osimlite.optimal.goals.contact_tracking import (
    build_contact_impulse_tracking_goal,
    build_contact_tracking_goal,
)
from osimlite.optimal.goals.effort import (
    build_control_goal,
    build_joint_reaction_goal,
    build_sum_squared_state_goal,
)
from osimlite.optimal.goals.endpoints import (
    build_average_speed_goal,
    build_expression_based_parameter_goal,
    build_final_time_goal,
    build_initial_activation_goal,
    build_initial_force_equilibrium_goal,
    build_initial_velocity_equilibrium_goal,
    build_marker_final_goal,
    build_periodicity_goal,
)
from osimlite.optimal.goals.frame_tracking import (
    build_acceleration_tracking_goal,
    build_angular_velocity_tracking_goal,
    build_orientation_tracking_goal,
    build_translation_tracking_goal,
)
from osimlite.optimal.goals.outputs import (
    build_final_output_goal,
    build_initial_output_goal,
    build_output_goal,
)
from osimlite.optimal.goals.tracking import (
    build_control_tracking_goal,
    build_generalized_force_tracking_goal,
    build_marker_tracking_goal,
    build_state_tracking_goal,
)
from osimlite.schema.moco.goals import (
    MocoAverageSpeedGoal,
    MocoControlGoal,
    MocoExpressionBasedParameterGoal,
    MocoFinalOutputGoal,
    MocoFinalTimeGoal,
    MocoGoal,
    MocoInitialActivationGoal,
    MocoInitialForceEquilibriumDGFGoal,
    MocoInitialOutputGoal,
    MocoInitialVelocityEquilibriumDGFGoal,
    MocoJointReactionGoal,
    MocoMarkerFinalGoal,
    MocoOutputGoal,
    MocoPeriodicityGoal,
    MocoStepLengthAsymmetryGoal,
    MocoStepTimeAsymmetryGoal,
    MocoSumSquaredStateGoal,
)
from osimlite.schema.moco.tracking import (
    MocoAccelerationTrackingGoal,
    MocoAngularVelocityTrackingGoal,
    MocoContactImpulseTrackingGoal,
    MocoContactTrackingGoal,
    MocoControlTrackingGoal,
    MocoGeneralizedForceTrackingGoal,
    MocoMarkerTrackingGoal,
    MocoOrientationTrackingGoal,
    MocoStateTrackingGoal,
    MocoTranslationTrackingGoal,
)

if TYPE_CHECKING:
    from osimlite.optimal.point import GoalTerms
    from osimlite.optimal.problem import Problem

GOAL_BUILDERS: dict[type[MocoGoal], Callable[[Any, Problem], GoalTerms]] = {
    MocoAccelerationTrackingGoal: build_acceleration_tracking_goal,
    MocoAngularVelocityTrackingGoal: build_angular_velocity_tracking_goal,
    MocoAverageSpeedGoal: build_average_speed_goal,
    MocoContactImpulseTrackingGoal: build_contact_impulse_tracking_goal,
    MocoContactTrackingGoal: build_contact_tracking_goal,
    MocoControlGoal: build_control_goal,
    MocoControlTrackingGoal: build_control_tracking_goal,
    MocoExpressionBasedParameterGoal: build_expression_based_parameter_goal,
    MocoFinalOutputGoal: build_final_output_goal,
    MocoFinalTimeGoal: build_final_time_goal,
    MocoGeneralizedForceTrackingGoal: build_generalized_force_tracking_goal,
    MocoInitialActivationGoal: build_initial_activation_goal,
    MocoInitialForceEquilibriumDGFGoal: build_initial_force_equilibrium_goal,
    MocoInitialOutputGoal: build_initial_output_goal,
    MocoInitialVelocityEquilibriumDGFGoal: build_initial_velocity_equilibrium_goal,
    MocoJointReactionGoal: build_joint_reaction_goal,
    MocoMarkerFinalGoal: build_marker_final_goal,
    MocoMarkerTrackingGoal: build_marker_tracking_goal,
    MocoOrientationTrackingGoal: build_orientation_tracking_goal,
    MocoOutputGoal: build_output_goal,
    MocoPeriodicityGoal: build_periodicity_goal,
    MocoStateTrackingGoal: build_state_tracking_goal,
    MocoStepLengthAsymmetryGoal: build_step_length_asymmetry_goal,
    MocoStepTimeAsymmetryGoal: build_step_time_asymmetry_goal,
    MocoSumSquaredStateGoal: build_sum_squared_state_goal,
    MocoTranslationTrackingGoal: build_translation_tracking_goal,
}
"""Function that formulates each supported class of goals."""
