"""Cases that the quick suite takes of expensive tests with many cases; `pytest --full` takes all.

A key is a test function, the value the ids of the cases that stay in the quick suite. A single expensive test has
``@pytest.mark.full`` instead.
"""

from __future__ import annotations

QUICK_CASES: dict[str, tuple[str, ...]] = {
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
        "/ground-PinJoint-BallJoint-True", "/bodyset/b1-PinJoint-PinJoint-False", "/bodyset/b1-PinJoint-BallJoint-True",
        "/bodyset/b1-BallJoint-GimbalJoint-False", "/bodyset/b1-SliderJoint-SliderJoint-True",
        "/bodyset/b1-FreeJoint-PinJoint-False", "/bodyset/b1-CustomJoint-PinJoint-False",
        "/bodyset/b1-PinJoint-WeldJoint-False", "/bodyset/b1-WeldJoint-PinJoint-True",
        "/bodyset/b1-BallJoint-WeldJoint-False", "/bodyset/b1-PinJoint-FreeJoint-False",
        "/bodyset/b1-BallJoint-FreeJoint-True",
    ),
    "tests/oracle/test_joint_reaction.py::test_forces_of_constraints": ("couplers",),
    "tests/oracle/test_lab_pipelines.py::test_a_motion_off_the_constraints_is_tracked": ("rra.xml",),
    "tests/oracle/test_lab_pipelines.py::test_closed_loops_are_tracked": ("as it is",),
    "tests/oracle/test_moco.py::test_loads": ("explicit",),
    "tests/oracle/test_moco.py::test_states_that_are_moved_onto_constraints": ("trapezoidal-explicit",),
    "tests/optimal/check_studies.py::test_exact_hessian_finds_it_too": ("pendulum-50",),
    "tests/optimal/check_studies.py::test_scaled_variables_find_it_too": ("pendulum-50-limited-memory",),
    "tests/oracle/test_joint_reaction.py::test_joint_reactions": ("jumper", "gait10", "gait2392"),
}  # fmt: skip
