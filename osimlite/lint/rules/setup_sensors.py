"""OSIM848: inertial sensors, in their tables and in the model."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from osimlite.base.text import join_words
from osimlite.lint.registry import ERROR, WARNING, FindingCollector, rule
from osimlite.lint.setup import Setup
from osimlite.lint.table import Table
from osimlite.lint.words import describe_object, find_nearest_name, suggest_names


def _find_orientations(setup: Setup) -> Iterator[tuple[Any, str, str, Table]]:
    """Yield every tool that reads orientations: property, suffix of sensor names, table."""
    for kind, tag, ending in (
        ("IMUInverseKinematicsTool", "orientations_file", ""),
        ("IMUPlacer", "orientation_file_for_calibration", "_imu"),
    ):
        for item, table in setup.iterate_with_tables(setup.find_by_class(kind), tag):
            yield item, tag, ending, table


@rule("OSIM848", "sensor-without-frame", severity=WARNING, about="document")
def report_sensor_without_frame(setup: Setup, report: FindingCollector) -> None:
    """A measured sensor has no frame in the model, or a named sensor was not measured.

    Compares the columns of measured orientations with the frames of the model. Inverse kinematics
    uses columns that have the name of a frame. The IMUPlacer uses columns that have the name of a
    frame with the suffix `_imu`. Also checks whether the table has a column for each sensor that
    the tool names. The table must contain quaternions.

    OpenSim ignores sensors without a frame; its log says only how many sensors it uses. If no
    sensor has a frame, OpenSim rejects the table.

    ```setup
      <IMUPlacer name="placer">
          <model_file>leg.osim</model_file>
    -     <base_imu_label>thigh</base_imu_label>
    +     <base_imu_label>thigh_imu</base_imu_label>
          <base_heading_axis>x</base_heading_axis>
          <orientation_file_for_calibration>leg_imu.sto</orientation_file_for_calibration>
          <output_model_file>calibrated.osim</output_model_file>
      </IMUPlacer>
    ```
    """
    for item, tag, ending, table in _find_orientations(setup):
        file = getattr(item, tag)
        # OpenSim takes any key that has this in it.
        data_types = [entry.value.text for key, entry in table.entries.items() if "DataType" in key]
        if data_types[:1] != ["Quaternion"]:
            report(
                f"'{file}' must have DataType=Quaternion: OpenSim rejects it",
                item,
                tag=tag,
                severity=ERROR,
            )
        base = getattr(item, "base_imu_label", "")
        if base and base not in table.columns:
            report(
                f"'{file}' has no sensor '{base}': OpenSim rejects the setup",
                item,
                tag="base_imu_label",
                severity=ERROR,
                suggestion=find_nearest_name(base, table.columns),
            )
        for weight in getattr(getattr(item, "orientation_weights", None), "objects", ()):
            if weight.name not in table.columns:
                report(
                    f"'{file}' has no sensor '{weight.name}': {describe_object(weight)} has no "
                    "effect",
                    weight,
                    attribute="name",
                    suggestion=find_nearest_name(weight.name, table.columns),
                )
        frames = {name + ending for name in setup.list_names("PhysicalFrame")}
        unknown_columns = [column for column in table.columns if column not in frames]
        if not frames:
            continue
        if len(unknown_columns) == len(table.columns):
            example = f", such as '{min(frames)}'" if ending else ""
            report(
                f"no column of '{file}' has the name of a frame of the model{example}: OpenSim "
                "rejects the table",
                item,
                tag=tag,
                severity=ERROR,
            )
        elif unknown_columns:
            report(
                f"the model has no frame for {join_words(map(repr, unknown_columns))} of '{file}': OpenSim "
                f"ignores such columns{suggest_names(unknown_columns, frames)}",
                item,
                tag=tag,
            )
