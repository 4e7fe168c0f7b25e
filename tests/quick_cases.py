"""Cases that the quick suite takes of expensive tests with many cases; `pytest --full` takes all.

A key is a test function, the value the ids of the cases that stay in the quick suite. A single
expensive test has ``@pytest.mark.full`` instead.
"""

from __future__ import annotations

QUICK_CASES: dict[str, tuple[str, ...]] = {
    "tests/fitting/test_person.py::test_somebody_is_found_again": ("0",),
    "tests/view/test_panels.py::test_titles_are_where_matplotlib_puts_them": ("3.0",),
    "tests/oracle/test_run_tools.py::test_coordinates_that_a_motion_lacks_or_names_in_old_ways": ("prescribed",),
    "tests/translate/mjcf_import/test_tendons.py::test_geodesics_are_nearer_than_wrap_objects": ("y",),
    "tests/oracle/test_casadi.py::test_accelerations_are_those_of_opensim": ("m0115",),
    "tests/oracle/test_contact_motions.py::test_published_models": ("m0466",),
    "tests/oracle/test_contact_motions.py::test_walkers": ("mesh feet",),
    "tests/oracle/test_fitting.py::test_minima_are_those_of_opensim": ("clamped", "coupled"),
    "tests/oracle/test_fitting.py::test_real_models_are_scaled_alike": ("False-m0036", "True-m0139"),
    "tests/oracle/test_imu.py::test_minima_of_angles_are_those_of_opensim": ("coupled-False", "clamped-True"),
    "tests/oracle/test_imu.py::test_sensors_are_placed_alike": ("m0097-z", "m0163-"),
    "tests/oracle/test_imu.py::test_the_tool_writes_opensims_files": ("here-away/it-true", "-here/it.sto-false"),
    "tests/oracle/test_integrator.py::test_the_walkers_steps_are_opensims": (
        "None-expected0-machine code", "1e-05-expected1-machine code", "None-expected0-Python",
    ),
    "tests/oracle/test_joint_graphs.py::test_a_joint_that_stands_twice_moves_as_in_opensim": (
        "/bodyset/b1-BallJoint-GimbalJoint-False", "/bodyset/b1-SliderJoint-SliderJoint-True",
        "/bodyset/b1-CustomJoint-PinJoint-False", "/bodyset/b1-WeldJoint-PinJoint-True",
    ),
    "tests/oracle/test_joint_reaction.py::test_forces_of_constraints": ("couplers",),
    "tests/oracle/test_modifying.py::test_the_model_is_that_of_opensim": (
        "m0001-muscles", "m0001-stiff", "m0001-reserves", "m0001-residuals", "m0001-actuators", "m0013-muscles",
        "m0013-welds",
    ),
    "tests/oracle/test_lab_pipelines.py::test_a_motion_off_the_constraints_is_tracked": ("rra.xml",),
    "tests/oracle/test_moco.py::test_loads": ("explicit",),
    "tests/optimal/check_studies.py::test_exact_hessian_finds_it_too": ("pendulum-50",),
    "tests/optimal/check_studies.py::test_scaled_variables_find_it_too": ("pendulum-50-limited-memory",),
    "tests/oracle/test_joint_reaction.py::test_joint_reactions": ("jumper", "gait10", "gait2392"),
    "tests/cli/test_simulate.py::test_a_long_run_tells_how_far_it_is_and_keeps_what_it_has_after_ctrl_c": (
        "choice0-bullet", "choice1-compiled",
    ),
    "tests/hostile/test_inputs.py::test_damaged_c3d_files_end_no_process": ("0", "4", "7", "8"),
    "tests/oracle/test_lab_pipelines.py::test_tasks_of_coordinates_that_are_held": ("two locks",),
    "tests/oracle/test_lint_setups.py::test_opensim_computes_something_else": (
        "feet swapped", "forces of ground", "56",
    ),
    "tests/studies/sweep/test_run.py::test_a_command_that_is_ended_goes_on": ("2",),
    "tests/optimal/check_faults.py::test_a_fault_is_told": ("placed",),
    "tests/oracle/test_random_faults.py::test_what_opensim_refuses_is_found": ("pendulum",),
    "tests/translate/mjcf_import/test_mutations.py::test_a_damaged_file_gives_a_clear_error": ("0",),
    "tests/oracle/test_simulation.py::test_motion_forces_and_labels": (
        "mass-matrix-tumbling-start1-0.6", "articulated-body-dynamic_walker-start0-1.0",
    ),
}  # fmt: skip

QUICK_STRIDES: dict[str, int] = {
    "tests/cli/test_simulate.py::test_results_do_not_depend_on_pybullet": 2,
    "tests/fitting/test_turning.py::test_who_turns_around_goes_on_at_the_other_end": 3,
    "tests/derivatives/check_classes.py::test_trees_of_joints": 4,
    "tests/io/document/test_damage.py::test_a_damaged_file_is_read_or_refused": 3,
    "tests/optimal/check_derivatives.py::test_models_with_constraints": 3,
    "tests/optimal/check_derivatives.py::test_schemes_and_dynamics": 3,
    "tests/oracle/test_moco.py::test_what_moco_takes_without_a_word": 5,
    "tests/simulation/engines/test_imports.py::test_neither_numba_nor_scipy_is_imported": 3,
    "tests/studies/sweep/test_optimize.py::test_an_interrupted_search_goes_on": 3,
    "tests/cli/test_doctor.py::test_what_is_needed_is_enough_and_is_needed": 3,
    "tests/io/document/test_imports.py::test_what_a_short_command_leaves_out": 3,
    "tests/lint/test_adoption.py::test_the_action_checks_every_path": 3,
    "tests/lint/test_damage.py::test_a_damaged_file_has_findings_in_places_that_exist": 2,
    "tests/lint/test_fixes.py::test_no_mend_makes_a_model_worse": 3,
    "tests/lint/test_robust.py::test_an_object_of_another_class_anywhere_has_a_finding": 4,
    "tests/lint/test_setup_faults.py::test_what_is_harmless_is_not_found": 3,
    "tests/oracle/test_controls.py::test_control_sets": 3,
    "tests/oracle/test_controls.py::test_controls_from_a_file": 3,
    "tests/oracle/test_lint_custom_joints.py::test_there_is_an_error_where_opensim_fails": 3,
    "tests/oracle/test_lint_old_formats.py::test_the_verdict_on_an_old_document_is_that_of_opensim": 4,
    "tests/oracle/test_lint_references.py::test_the_verdict_on_broken_references_is_that_of_opensim": 2,
    "tests/oracle/test_path_wraps_and_starts.py::test_models_whose_ranges_leave_their_paths": 5,
    "tests/oracle/test_path_wraps_and_starts.py::test_ranges_of_wraps": 9,
    "tests/test_readme.py::test_every_command_explains_itself": 4,
    "tests/tools/test_lab_pipelines.py::test_parts_of_unknown_classes_are_named": 3,
    "tests/tools/test_lab_pipelines.py::test_results_put_elsewhere_are_found": 3,
}
"""For a test with many cases of the same cost: the quick suite takes every n-th case."""
