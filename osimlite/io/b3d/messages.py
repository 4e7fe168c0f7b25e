"""Messages of .b3d files, version 4.

The numbers are those of ``dart/proto/SubjectOnDisk.proto`` of nimblephysics since 2023-09-29. Fields
were only added since then.
"""

from __future__ import annotations

from osimlite.io.b3d.wire import Field, Schema

VERSION = 4
"""Version of the format that is read."""

PASS_HEADER: Schema = {
    1: Field("type", "int"),
    2: Field("positions_observed", "bool", True),
    3: Field("velocities_differenced", "bool", True),
    4: Field("accelerations_differenced", "bool", True),
    5: Field("marker_rms", "float", True),
    6: Field("marker_max", "float", True),
    7: Field("linear_residual", "float", True),
    8: Field("angular_residual", "float", True),
    9: Field("max_velocity", "float", True),
    10: Field("lowpass_cutoff", "float"),
    11: Field("lowpass_order", "int"),
    12: Field("force_plate_cutoffs", "float", True),
    13: Field("regularization_weight", "float"),
    14: Field("force_regularization_weight", "float"),
}
"""Results of a processing pass for a trial."""

TRIAL_HEADER: Schema = {
    1: Field("name", "text"),
    2: Field("missing_forces", "int", True),
    3: Field("frame_count", "int"),
    4: Field("time_step", "double"),
    5: Field("passes", PASS_HEADER, True),
    6: Field("tags", "text", True),
    7: Field("plate_count", "int"),
    8: Field("plate_corners", "double", True),
    9: Field("marker_names_guessed", "bool"),
    10: Field("original_name", "text"),
    11: Field("split_index", "int"),
    12: Field("original_start_frame", "int"),
    13: Field("original_end_frame", "int"),
    14: Field("original_start_time", "float"),
    15: Field("original_end_time", "float"),
    16: Field("missing_forces_reviewed", "bool", True),
    17: Field("type", "int"),
    18: Field("features", "int", True),
}
"""A trial, or a piece of one."""

PASS: Schema = {1: Field("type", "int"), 2: Field("model_text", "text")}
"""A processing pass with its model."""

HEADER: Schema = {
    1: Field("dof_count", "int"),
    2: Field("trial_count", "int"),
    3: Field("sensor_frame_size", "int"),
    4: Field("pass_frame_size", "int"),
    5: Field("passes", PASS, True),
    6: Field("contact_bodies", "text", True),
    7: Field("custom_names", "text", True),
    8: Field("custom_sizes", "int", True),
    9: Field("trials", TRIAL_HEADER, True),
    10: Field("version", "int"),
    11: Field("href", "text"),
    12: Field("notes", "text"),
    13: Field("sex", "text"),
    14: Field("height", "double"),
    15: Field("mass", "double"),
    16: Field("age", "int"),
    17: Field("marker_names", "text", True),
    18: Field("accelerometer_names", "text", True),
    19: Field("gyroscope_names", "text", True),
    20: Field("emg_names", "text", True),
    21: Field("emg_samples", "int"),
    22: Field("exo_dofs", "int", True),
    23: Field("tags", "text", True),
    24: Field("joint_count", "int"),
    25: Field("quality", "int"),
}
"""The subject."""

SENSOR_FIELDS = {
    1: "custom",
    2: "markers",
    3: "accelerometers",
    4: "gyroscopes",
    5: "emg",
    6: "exo",
    7: "plate_points",
    8: "plate_torques",
    9: "plate_forces",
}
"""Names of the arrays of a frame of measurements, by their numbers."""

PASS_FIELDS = {
    1: "positions",
    # Numbers that are missing here are fields that nimblephysics has removed.
    2: "velocities",
    3: "accelerations",
    4: "moments",
    5: "contact_wrenches",
    6: "contact_points",
    7: "contact_torques",
    8: "contact_forces",
    9: "mass_center",
    10: "mass_center_velocity",
    11: "mass_center_acceleration",
    12: "root_residual",
    14: "root_contact_wrenches",
    15: "root_joint_centers",
    16: "joint_centers",
    17: "root_mass_center_acceleration",
    18: "root_contact_points",
    19: "root_contact_torques",
    20: "root_contact_forces",
    21: "root_velocity",
    22: "root_acceleration",
    23: "root_position_history",
    24: "root_angle_history",
}
"""Names of the arrays of a frame of a processing pass, by their numbers; 13 is unused."""

PASS_TYPES = ("kinematics", "dynamics", "lowpass-filter", "acceleration-minimizing-filter")
"""Types of processing passes, by their numbers."""

TRIAL_TYPES = ("treadmill", "overground", "static", "other")
"""Types of trials, by their numbers."""

TRIAL_FEATURES = ("walking", "running", "uneven terrain", "flat terrain")
"""Detected features of trials, by their numbers."""

DATA_QUALITIES = ("pilot", "experimental", "internet")
"""Qualities of the data by the user who uploaded it, by their numbers."""

MISSING_FORCE_REASONS = (
    "not missing",
    "measured force is zero while the body accelerates",
    "external force that was not measured",
    "torque discrepancy",
    "force discrepancy",
    "not over a force plate",
    "missing impact",
    "missing blip",
    "shifted force",
    "interpolated clipped force",
    "manual review",
    "foot contact without force",
    "marker error too high",
    "input outliers",
    "no force plates",
    "velocities too high after filtering",
    "centre of pressure outside of the foot",
    "frame without force",
    "extended to the nearest peak of the force",
)
"""Reasons why ground forces of a frame are not to be trusted, by their numbers; 0 is none."""
