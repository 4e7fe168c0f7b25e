"""OSIM841 to OSIM843: what a setup looks for in the columns of the tables that it names."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from osimlite.lint.engine import ERROR, INFO, WARNING, Found, rule
from osimlite.lint.setup import Setup, is_of
from osimlite.lint.table import Table
from osimlite.lint.words import called, nearest_name
from osimlite.text import listed


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


@rule("OSIM842", "missing-column", severity=WARNING, about="document")
def missing_column(setup: Setup, found: Found) -> None:
    """A table of coordinates lacks coordinates of the model, or has none of them.

    ## What it does
    Compares the columns of a table of coordinates with the coordinates of the model: inverse dynamics takes plain names
    alone, analyses take paths too. A task whose value is to come from a file needs its column there.

    ## Why is this bad
    OpenSim gives a coordinate without a column its default value, without a word or with a line in the log: the motion
    is another one.

    ## Example
    ```setup
    <OpenSimDocument Version="40600">
        <InverseDynamicsTool name="id">
            <model_file>leg.osim</model_file>
            <coordinates_file>leg_no_knee.mot</coordinates_file>
        </InverseDynamicsTool>
    </OpenSimDocument>
    ```

    ## Use instead
    ```setup
    <OpenSimDocument Version="40600">
        <InverseDynamicsTool name="id">
            <model_file>leg.osim</model_file>
            <coordinates_file>leg.mot</coordinates_file>
        </InverseDynamicsTool>
    </OpenSimDocument>
    ```
    """
    for item, tag, table in motions(setup):
        names = setup.names_of("Coordinate")
        if not names:
            continue
        plain = is_of(item, "InverseDynamicsTool")
        columns = {
            column if plain or "/" not in column else (parts[-2] if (parts := column.split("/"))[-1] == "value" else "")
            for column in table.columns
        }
        lacking = sorted(name for name in names - columns if not _is_bound(setup, name))
        if not names & columns:
            paths = any(column.startswith("/") for column in table.columns)
            why = "; its columns are called by paths, which inverse dynamics does not understand" if paths else ""
            found(
                f"'{getattr(item, tag)}' has no column of a coordinate of the model{why}", item, tag=tag, severity=ERROR
            )
        elif lacking:
            near = [
                f"'{near}' for '{name}'" for name in lacking if (near := nearest_name(name, sorted(columns - names)))
            ]
            hint = f"; is it {listed(near)}?" if near else ""
            found(
                f"'{getattr(item, tag)}' has no column {listed([repr(name) for name in lacking])}: OpenSim takes the "
                f"default value{hint}",
                item, tag=tag,
            )  # fmt: skip
    for item in setup.named("AbstractTool"):
        states = setup.table(getattr(item, "states_file", ""))
        unknown = [column for column in states.columns if not _is_state(setup, column)] if states is not None else []
        if unknown and setup.tree is not None:
            found(
                f"the model has no state {listed([repr(column) for column in unknown])} of '{item.states_file}': "
                "OpenSim leaves the column out",
                item, tag="states_file",
            )  # fmt: skip
    for user in setup.having("ik_task_set"):
        for task in user.ik_task_set.objects:
            if is_of(task, "IKCoordinateTask") and task.apply and task.value_type == "from_file":
                values = setup.table(user.coordinate_file)
                if not user.coordinate_file.strip() or user.coordinate_file == "Unassigned":
                    found(
                        f"no coordinate_file is there for '{task.name}': OpenSim refuses it",
                        task,
                        tag="value_type",
                        severity=ERROR,
                    )
                elif values is not None and values.labels and task.name not in values.columns:
                    found(
                        f"'{user.coordinate_file}' has no column '{task.name}': OpenSim refuses it",
                        task, attribute="name", severity=ERROR, suggestion=nearest_name(task.name, values.columns),
                    )  # fmt: skip


def _is_state(setup: Setup, column: str) -> bool:
    """Whether a label may be that of a state: of a component by its path, or in the old way by its name."""
    if setup.tree is None:
        return True
    if column.startswith("/"):
        path = column.rpartition("/")[0]
        return (
            setup.tree.walk(path, "", "Component").target is not None or path.rpartition("/")[2] in setup.tree.by_name
        )
    return column.partition(".")[0].removesuffix("_u") in setup.tree.by_name


def _is_bound(setup: Setup, name: str) -> bool:
    """Whether a coordinate is locked or follows from others."""
    assert setup.tree is not None
    bound = {
        str(item.dependent_coordinate_name) for item in setup.tree.of_class("CoordinateCouplerConstraint").values()
    }
    item = setup.tree.of_class("Coordinate").get(name)
    return name in bound or (item is not None and bool(getattr(item, "locked", False)))


def motions(setup: Setup) -> Iterator[tuple[Any, str, Table]]:
    """Every tool that is given a motion as coordinates, with the property and the table."""
    for tag in ("coordinates_file", "desired_kinematics_file"):
        for item in setup.having(tag):
            table = setup.table(getattr(item, tag))
            if table is not None and table.labels and not table.is_markers:
                yield item, tag, table


@rule("OSIM843", "load-columns", severity=ERROR, mends="both", about="document")
def load_columns(setup: Setup, found: Found) -> None:
    """The columns of a measured force are not in the data.

    ## What it does
    Looks for the columns whose labels begin with the identifiers of an external force: there must be three of each.
    Points out a force without a point (it acts at the origin of the body), columns that are not in the order x, y, z
    (OpenSim takes them in the order of the file), and forces without an identifier.

    ## Why is this bad
    OpenSim refuses loads of which it does not find three columns, and swaps the axes of those in another order without
    a word.

    ## Example
    ```setup
    <OpenSimDocument Version="40600">
        <ExternalLoads name="loads">
            <objects>
                <ExternalForce name="right">
                    <applied_to_body>shank</applied_to_body>
                    <force_identifier>ground_force_v</force_identifier>
                    <point_identifier>ground_force_q</point_identifier>
                </ExternalForce>
            </objects>
            <datafile>leg_grf.mot</datafile>
        </ExternalLoads>
    </OpenSimDocument>
    ```

    ## Use instead
    ```setup
    <OpenSimDocument Version="40600">
        <ExternalLoads name="loads">
            <objects>
                <ExternalForce name="right">
                    <applied_to_body>shank</applied_to_body>
                    <force_identifier>ground_force_v</force_identifier>
                    <point_identifier>ground_force_p</point_identifier>
                </ExternalForce>
            </objects>
            <datafile>leg_grf.mot</datafile>
        </ExternalLoads>
    </OpenSimDocument>
    ```
    """
    for loads in setup.named("ExternalLoads"):
        table = setup.table(loads.datafile)
        if table is None or not table.labels:
            continue
        columns = table.columns
        prefixes = sorted({column[:-1] for column in columns if column[-1:] in "xyzXYZ"})
        names = [force.name for force in loads.objects]
        for place, force in enumerate(loads.objects):
            if force.name in names[:place]:
                found(f"a force is called '{force.name}' already", force, attribute="name", severity=WARNING)
            if not str(force.applied_to_body):
                found(f"{called(force)} acts on no body: OpenSim refuses it", force, tag="applied_to_body")
            if not force.appliesForce:
                found(f"{called(force)} does not act", force, tag="appliesForce", severity=INFO)
                continue
            if not force.force_identifier and (force.point_identifier or not force.torque_identifier):
                found(f"{called(force)} names no columns of a force: OpenSim refuses it", force, tag="force_identifier")
            elif force.force_identifier and not force.point_identifier:
                found(
                    f"{called(force)} has no point: OpenSim lets it act at the origin of {force.applied_to_body}",
                    force, tag="point_identifier", severity=WARNING,
                )  # fmt: skip
            for tag in ("force_identifier", "point_identifier", "torque_identifier"):
                prefix = getattr(force, tag)
                if not prefix:
                    continue
                own = [column for column in columns if column.startswith(prefix)]
                if len(own) != 3 or len(set(own)) != 3:
                    what = listed(own) if own else "none"
                    found(
                        f"'{loads.datafile}' must have three columns that begin with '{prefix}' ({tag} of "
                        f"{called(force)}), it has {what}: OpenSim refuses the loads",
                        force, tag=tag, suggestion=None if len(own) > 3 else nearest_name(prefix, prefixes),
                    )  # fmt: skip
                elif [column[-1:].lower() for column in own] != ["x", "y", "z"] and {
                    column[-1:].lower() for column in own
                } == {"x", "y", "z"}:
                    found(
                        f"'{loads.datafile}' has {listed(own)} in this order: OpenSim takes the first for x",
                        force, tag=tag, severity=WARNING,
                    )  # fmt: skip
