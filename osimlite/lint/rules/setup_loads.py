"""OSIM843 and OSIM849: measured loads, their columns and points of application."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from typing import Any

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.text import join_words
from osimlite.lint.placement import FramePose, locate_frame
from osimlite.lint.posture import compute_poses_of_motion, make_model_subject
from osimlite.lint.registry import ERROR, INFO, WARNING, FindingCollector, rule
from osimlite.lint.setup import Setup, find_motion_file, select_members
from osimlite.lint.subject import cache_per_subject
from osimlite.lint.table import Table
from osimlite.lint.words import describe_object, find_nearest_name
from osimlite.mechanics.laws.vectors import Vector, dot
from osimlite.schema.tree import is_a

_SAMPLE_COUNT = 16
"""Number of times of a motion that are examined."""
_MAX_DISTANCE_M = 0.4
"""Largest distance of a measured force from all known points of its body, m. In the projects of
docs/public-projects.md that measure gaits, the largest distance from the origin is 0.275 m."""


@rule("OSIM843", "load-columns", severity=ERROR, fixes="both", about="document")
def report_load_columns(setup: Setup, report: FindingCollector) -> None:
    """The columns of a measured force are not in the data.

    Searches the data for the columns of each external force. For each identifier, the data must
    have exactly three columns whose labels begin with it. Also reports a force without a point (it
    acts at the origin of the body), and a force without an identifier. Also reports columns that
    are not in the order x, y, z, because OpenSim reads them in the order of the file.

    If there are not three matching columns, OpenSim rejects the loads. If the columns are in
    another order, it swaps the axes without a message.

    ```setup
      <ExternalLoads name="loads">
          <objects>
              <ExternalForce name="right">
                  <applied_to_body>shank</applied_to_body>
                  <force_identifier>ground_force_v</force_identifier>
    -             <point_identifier>ground_force_q</point_identifier>
    +             <point_identifier>ground_force_p</point_identifier>
              </ExternalForce>
          </objects>
          <datafile>leg_grf.mot</datafile>
      </ExternalLoads>
    ```
    """
    for loads, table in setup.iterate_with_tables(setup.find_by_class("ExternalLoads"), "datafile"):
        columns = table.columns
        prefix_counts = Counter(column[:-1] for column in columns if column[-1:] in "xyzXYZ")
        # Prefixes of three columns, which would be correct identifiers.
        complete_prefixes = sorted(prefix for prefix, count in prefix_counts.items() if count == 3)
        forces = select_members(loads, "ExternalForce")
        names = [force.name for force in forces]
        for index, force in enumerate(forces):
            if force.name in names[:index]:
                report(
                    f"the name '{force.name}' is already used by another force",
                    force,
                    attribute="name",
                    severity=WARNING,
                )
            if not str(force.applied_to_body):
                report(
                    f"{describe_object(force)} acts on no body: OpenSim rejects it",
                    force,
                    tag="applied_to_body",
                )
            if not force.appliesForce:
                report(
                    f"{describe_object(force)} is disabled (appliesForce is false)",
                    force,
                    tag="appliesForce",
                    severity=INFO,
                )
                continue
            # A pure torque needs no force, unless it has a point.
            if not force.force_identifier and (
                force.point_identifier or not force.torque_identifier
            ):
                report(
                    f"{describe_object(force)} has no force_identifier: OpenSim rejects it",
                    force,
                    tag="force_identifier",
                )
            elif force.force_identifier and not force.point_identifier:
                report(
                    f"{describe_object(force)} has no point: OpenSim applies it at the origin of "
                    f"{force.applied_to_body}",
                    force,
                    tag="point_identifier",
                    severity=WARNING,
                )
            for tag in ("force_identifier", "point_identifier", "torque_identifier"):
                prefix = getattr(force, tag)
                # An empty identifier turns this part of the load off.
                if not prefix:
                    continue
                # OpenSim compares the beginnings of labels, so that "ground_force_v" matches
                # "ground_force_vx" and others.
                matching_columns = [column for column in columns if column.startswith(prefix)]
                if len(matching_columns) != 3 or len(set(matching_columns)) != 3:
                    column_text = join_words(matching_columns) if matching_columns else "none"
                    report(
                        f"expected three columns of '{loads.datafile}' that begin with '{prefix}' "
                        f"({tag} of {describe_object(force)}), found {column_text}: OpenSim rejects the "
                        "loads",
                        force,
                        tag=tag,
                        # If some columns match, the identifier is too short, or a label of the table
                        # is wrong: another spelling does not help.
                        suggestion=None
                        if matching_columns
                        else find_nearest_name(prefix, complete_prefixes),
                    )
                elif [column[-1:].lower() for column in matching_columns] != ["x", "y", "z"] and {
                    column[-1:].lower() for column in matching_columns
                } == {"x", "y", "z"}:
                    report(
                        f"'{loads.datafile}' has {join_words(matching_columns)} in this order: OpenSim uses the "
                        "first of them as x",
                        force,
                        tag=tag,
                        severity=WARNING,
                    )


@rule("OSIM849", "load-place", severity=WARNING, about="document")
def report_load_place(setup: Setup, report: FindingCollector) -> None:
    """A measured force acts far away from its body, or is expressed in the wrong frame.

    Poses the model along the motion of the tool. Reports measured forces that act more than 40 cm
    from all of these points of their body: its origin, mass centre, joints, markers and contact
    surfaces. No point of a foot or a hand is so far away, even if foot and shank are one body. For
    a force that is expressed in a body, the rule also reads its numbers as components in ground. If
    the force then points more upwards, it is reported. A torque is reported if it is larger than
    the moment of the force at a distance of 40 cm. The sum of all forces must point up if it is at
    least half the weight of the model.

    OpenSim applies the force where the setup says, without a message. If the place is wrong, joint
    moments are wrong by the force times the distance. Typical causes are swapped feet, points in
    millimetres, torques in newton millimetres, and laboratory axes instead of model axes. Others
    are forces on the ground instead of on the foot, and loads of another trial.

    ```setup
      <ExternalLoads name="loads">
          <objects>
              <ExternalForce name="right">
    -             <applied_to_body>pelvis</applied_to_body>
    +             <applied_to_body>shank</applied_to_body>
                  <force_identifier>ground_force_v</force_identifier>
                  <point_identifier>ground_force_p</point_identifier>
              </ExternalForce>
          </objects>
          <datafile>leg_grf.mot</datafile>
      </ExternalLoads>
    ```
    """
    # Tools that read the document are searched in other folders, so this comes first.
    all_loads = [*setup.find_by_class("ExternalLoads")]
    if not all_loads or setup.tree is None:
        return
    # Of several tools that read the same loads, some have no motion yet.
    # A load may be read by several tools: inverse dynamics, RRA and so on.
    motions = (setup.read_tool_table(find_motion_file(*reader)) for reader in setup.find_readers())
    motion = next((table for table in motions if table is not None and not table.is_markers), None)
    model: Any = setup.tree.model
    # Without gravity there is no upward direction.
    weight = math.hypot(*model.gravity)
    if motion is None or not weight:
        return
    up = tuple(-component / weight for component in model.gravity)
    mass = sum(body.mass for body in setup.tree.list_members("/bodyset", "Body").values())
    for loads in all_loads:
        table = setup.read_table(loads.datafile)
        mean_force = [0.0, 0.0, 0.0]
        for force in select_members(loads, "ExternalForce") if table is not None else ():
            # The signs of axes show in the mean of all loads.
            acting = _sample_load(setup, force, table, motion)
            for sample in acting:
                mean_force = [
                    total + sample.size * component / _SAMPLE_COUNT
                    for total, component in zip(mean_force, sample.direction, strict=True)
                ]
            far_distances = [sample.away for sample in acting if sample.away > _MAX_DISTANCE_M]
            # At a few times the measured centre of pressure may be far off, when the foot touches
            # the ground.
            if len(far_distances) > max(2, len(acting) // 4):
                report(
                    f"at {len(far_distances)} of {len(acting)} checked times {describe_object(force)} acts "
                    f"more than {_MAX_DISTANCE_M:g} m from {force.applied_to_body}; the largest distance is "
                    f"{max(far_distances):.3g} m: does it belong to another body, or are its points in "
                    "another frame or unit?",
                    force,
                    tag="applied_to_body",
                )
            elif sum(sample.twist > _MAX_DISTANCE_M for sample in acting) > max(
                2, len(acting) // 4
            ):
                report(
                    f"the torque of {describe_object(force)} is as large as the moment of its force at a "
                    f"distance of {max(sample.twist for sample in acting):.3g} m: is it in newton "
                    "millimetres, or about another point?",
                    force,
                    tag="torque_identifier",
                )
            lifted = [
                # The rule compares the numbers as they are written with those rotated to ground.
                dot(sample.written, up) - dot(sample.direction, up)
                for sample in acting
                if sample.written != sample.direction
            ]
            # The numbers point up more than the rotated vector at all times: they are given in
            # ground.
            if len(lifted) > 2 and max(lifted) > 0.03 and min(lifted) > -0.02:
                report(
                    f"{describe_object(force)} is expressed in {force.force_expressed_in_body}, "
                    "but its components point up when they are read in ground: is it expressed in ground?",
                    force,
                    tag="force_expressed_in_body",
                )
        lift = sum(
            component * up_component for component, up_component in zip(mean_force, up, strict=True)
        )
        # The sum of the reactions of a gait points up, apart from some braking.
        if math.hypot(*mean_force) > max(0.5 * mass * weight, 2.0 * lift):
            report(
                f"the mean sum of these forces, ({', '.join(f'{n:.0f}' for n in mean_force)}) N, does not "
                f"point up: the gravity of the model is ({', '.join(f'{n:g}' for n in model.gravity)}) "
                "m/s^2; check the axes and signs of the forces, and the gravity",
                loads,
                tag="datafile",
            )


class _LoadSample(NamedTuple):
    """Distance and size of an external force at one time.

    Attributes:
        away: distance of the force from the origin of its body, m.
        twist: distance that its torque adds, m.
        size: size of the force, N.
        written: direction as it is written.
        direction: direction in ground.
    """

    away: float
    twist: float
    size: float
    written: Vector
    direction: Vector


def _sample_load(setup: Setup, force: Any, table: Table | None, motion: Table) -> list[_LoadSample]:
    """Sample a measured force at times at which it is large.

    Returns:
        The samples; none if the force is incomplete or does not act during the motion.
    """
    if setup.tree is None or table is None or table.span is None or motion.span is None:
        return []
    bodies = setup.tree.list_members("/bodyset", "Body")
    column_indices = [
        [
            index
            for index, label in enumerate(table.columns, 1)
            if prefix and label.startswith(prefix)
        ]
        for prefix in (force.force_identifier, force.point_identifier, force.torque_identifier)
    ]
    first, last = max(table.span[0], motion.span[0]), min(table.span[1], motion.span[1])
    if (
        [len(indices) for indices in column_indices[:2]] != [3, 3]
        or not first < last
        or not force.appliesForce
    ):
        return []
    # Moments in the middle of equal parts of the time.
    rows = [
        table.read_row(first + (last - first) * (k + 0.5) / _SAMPLE_COUNT)
        for k in range(_SAMPLE_COUNT)
    ]
    # Missing data make a row useless.
    rows = [row for row in rows if len(row) == len(table.labels) and not any(map(math.isnan, row))]
    sizes = [math.hypot(*(row[index] for index in column_indices[0])) for row in rows]
    result = []
    for row, size in zip(rows, sizes, strict=True):
        # Small forces have an undefined centre of pressure.
        if size > max(20.0, 0.2 * max(sizes)):
            poses = compute_poses_of_motion(setup, motion, row[0])
            (x, y, z), (px, py, pz), torque = (
                [row[index] for index in indices] for indices in column_indices
            )
            frames = (
                force.applied_to_body,
                force.force_expressed_in_body,
                force.point_expressed_in_body,
            )
            names = [str(frame).rpartition("/")[2] for frame in frames]
            frame_poses = [
                FramePose() if name == "ground" else poses.get(id(bodies.get(name)))
                for name in names
            ]
            body, of_force, of_point = frame_poses
            # Frames on joints of unknown motion have no pose.
            if body is not None and of_force is not None and of_point is not None:
                direction = (x / size, y / size, z / size)
                point = of_point.transform_point((px, py, pz))
                body_points = _list_body_points(setup).get(names[0], [])
                away = min(
                    math.dist(body.transform_point(index), point)
                    for index in [(0.0, 0.0, 0.0), *body_points]
                )
                result.append(
                    _LoadSample(
                        away,
                        math.hypot(*torque) / size,
                        size,
                        direction,
                        of_force.rotate(direction),
                    )
                )
    return result


@cache_per_subject
def _list_body_points(setup: Setup) -> dict[str, list[Vector]]:
    """Return known points on each body by its name (m): mass centre, joint frames, markers and contacts."""
    subject = make_model_subject(setup)
    result: dict[str, list[Vector]] = {}

    def add(frame: Any, location: Sequence[float]) -> None:
        base = locate_frame(subject, frame)
        if base is not None and len(location) == 3 and not any(map(math.isnan, location)):
            x, y, z = location
            result.setdefault(str(base[0].name), []).append(base[1].transform_point((x, y, z)))

    for body in subject.find_by_class("Body"):
        add(body, body.mass_center)
    for joint in subject.find_by_class("Joint"):
        for tag in ("socket_parent_frame", "socket_child_frame"):
            add(subject.target_of(joint, tag), (0.0, 0.0, 0.0))
    for station in subject.find_by_class("Marker"):
        add(subject.target_of(station, "socket_parent_frame"), station.location)
    for surface in subject.find_by_class("ContactGeometry"):
        # The location of a half-space is not a place on the body.
        if not is_a(surface, "ContactHalfSpace"):
            add(subject.target_of(surface, "socket_frame"), surface.location)
    return result
