"""OSIM841, OSIM848 and OSIM855: the markers of a tool, beside those that were measured."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from osimlite.lint.engine import ERROR, WARNING, Found, rule
from osimlite.lint.setup import Setup, is_of
from osimlite.lint.table import Table
from osimlite.lint.words import nearest_name


def _marker_users(setup: Setup) -> Iterator[tuple[Any, Table]]:
    """Every part of a tool that fits markers, with its data."""
    for item in setup.having("ik_task_set", "marker_file"):
        table = setup.table(item.marker_file)
        if table is not None and table.labels:
            yield item, table


@rule("OSIM841", "marker-not-measured", severity=WARNING, about="document")
def marker_not_measured(setup: Setup, found: Found) -> None:
    """A marker that is to be fitted is not in the data.

    ## What it does
    Looks up each marker of the tasks, and of pairs that measure lengths, among the labels of the data. If none is in
    both model and data, it is an error.

    ## Why is this bad
    OpenSim leaves the marker out without a word; with no marker at all in common it crashes. A measurement one of whose
    markers is missing does not count: its bodies keep their size.

    ## Example
    ```setup
    <OpenSimDocument Version="40600">
        <InverseKinematicsTool name="ik">
            <model_file>leg.osim</model_file>
            <marker_file>leg.trc</marker_file>
            <output_motion_file>ik.mot</output_motion_file>
            <IKTaskSet>
                <objects>
                    <IKMarkerTask name="asis"> <weight>1</weight> </IKMarkerTask>
                    <IKMarkerTask name="hip_marker"> <weight>1</weight> </IKMarkerTask>
                </objects>
            </IKTaskSet>
        </InverseKinematicsTool>
    </OpenSimDocument>
    ```

    ## Use instead
    ```setup
    <OpenSimDocument Version="40600">
        <InverseKinematicsTool name="ik">
            <model_file>leg.osim</model_file>
            <marker_file>leg.trc</marker_file>
            <output_motion_file>ik.mot</output_motion_file>
            <IKTaskSet>
                <objects> <IKMarkerTask name="asis"> <weight>1</weight> </IKMarkerTask> </objects>
            </IKTaskSet>
        </InverseKinematicsTool>
    </OpenSimDocument>
    ```
    """
    for user, table in _marker_users(setup):
        labels = table.columns
        tasks = [task for task in user.ik_task_set.objects if is_of(task, "IKMarkerTask") and task.apply and task.name]
        model = setup.names_of("Marker")
        both = [task for task in tasks if task.name in labels and task.name in model]
        if tasks and model and not both:
            found(
                f"no marker of the tasks is in both the model and '{user.marker_file}': OpenSim crashes",
                user, tag="marker_file", severity=ERROR,
            )  # fmt: skip
        for task in tasks:
            if task.name not in labels:
                found(
                    f"'{user.marker_file}' has no marker '{task.name}': OpenSim leaves the task out",
                    task, attribute="name", suggestion=nearest_name(task.name, labels),
                )  # fmt: skip
    for scaler in setup.named("ModelScaler"):
        static = setup.table(scaler.marker_file)
        if static is None or not static.labels:
            continue
        for measurement in scaler.measurement_set.objects if scaler.apply else ():
            for pair in measurement.marker_pair_set.objects if measurement.apply else ():
                for name in pair.markers:
                    if name not in static.columns:
                        found(
                            f"'{scaler.marker_file}' has no marker '{name}': OpenSim leaves the whole measurement "
                            f"'{measurement.name}' out",
                            pair, tag="markers", word=str(name), suggestion=nearest_name(str(name), static.columns),
                        )  # fmt: skip
