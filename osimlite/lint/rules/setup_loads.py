"""OSIM843 and OSIM849: measured loads, their columns and where they act."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from osimlite.base.text import join_words
from osimlite.lint.placement import Pose, on_base
from osimlite.lint.posture import model_subject, poses_in
from osimlite.lint.registry import ERROR, INFO, WARNING, FindingSink, rule
from osimlite.lint.setup import Setup, members, motion_of
from osimlite.lint.subject import once
from osimlite.lint.table import Table
from osimlite.lint.words import called, nearest_name
from osimlite.mechanics.laws.vectors import Vector, dot
from osimlite.schema.tree import is_a

_TIMES = 16
"""How many times of a motion are looked at."""
_NEAR = 0.4
"""How far from all that is known of its body, m, a measured force may act. In the projects of
docs/public-projects.md that measure gaits none is farther than 0.275 from the origin."""


@rule("OSIM843", "load-columns", severity=ERROR, mends="both", about="document")
def load_columns(setup: Setup, report: FindingSink) -> None:
    """The columns of a measured force are not in the data.

    Looks for the columns whose labels begin with the identifiers of an external force: there must
    be three of each. Points out a force without a point (it acts at the origin of the body),
    columns that are not in the order x, y, z (OpenSim takes them in the order of the file), and
    forces without an identifier.

    OpenSim refuses loads of which it does not find three columns, and swaps the axes of those in
    another order without a word.

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
    for loads, table in setup.with_tables(setup.named("ExternalLoads"), "datafile"):
        columns = table.columns
        prefixes = sorted({column[:-1] for column in columns if column[-1:] in "xyzXYZ"})
        forces = members(loads, "ExternalForce")
        names = [force.name for force in forces]
        for index, force in enumerate(forces):
            if force.name in names[:index]:
                report(
                    f"a force is called '{force.name}' already",
                    force,
                    attribute="name",
                    severity=WARNING,
                )
            if not str(force.applied_to_body):
                report(
                    f"{called(force)} acts on no body: OpenSim refuses it",
                    force,
                    tag="applied_to_body",
                )
            if not force.appliesForce:
                report(f"{called(force)} does not act", force, tag="appliesForce", severity=INFO)
                continue
            if not force.force_identifier and (
                force.point_identifier or not force.torque_identifier
            ):
                report(
                    f"{called(force)} names no columns of a force: OpenSim refuses it",
                    force,
                    tag="force_identifier",
                )
            elif force.force_identifier and not force.point_identifier:
                report(
                    f"{called(force)} has no point: OpenSim lets it act at the origin of {force.applied_to_body}",
                    force,
                    tag="point_identifier",
                    severity=WARNING,
                )
            for tag in ("force_identifier", "point_identifier", "torque_identifier"):
                prefix = getattr(force, tag)
                if not prefix:
                    continue
                own = [column for column in columns if column.startswith(prefix)]
                if len(own) != 3 or len(set(own)) != 3:
                    what = join_words(own) if own else "none"
                    report(
                        f"'{loads.datafile}' must have three columns that begin with '{prefix}' ({tag} of "
                        f"{called(force)}), it has {what}: OpenSim refuses the loads",
                        force,
                        tag=tag,
                        suggestion=None if len(own) > 3 else nearest_name(prefix, prefixes),
                    )
                elif [column[-1:].lower() for column in own] != ["x", "y", "z"] and {
                    column[-1:].lower() for column in own
                } == {"x", "y", "z"}:
                    report(
                        f"'{loads.datafile}' has {join_words(own)} in this order: OpenSim takes the first for x",
                        force,
                        tag=tag,
                        severity=WARNING,
                    )


@rule("OSIM849", "load-place", severity=WARNING, about="document")
def load_place(setup: Setup, report: FindingSink) -> None:
    """A measured force acts far away from its body, or is expressed in another frame than its setup says.

    Puts the model into poses of the motion that the tool is given, and looks where measured forces
    act: at more than 40 cm from the origin, the mass centre, the joints, the markers and the
    contact surfaces of their body nothing of a foot or a hand is, also where foot and shank are one
    body. Where a force is expressed in a body, it looks whether the numbers, as they are, point up
    more than they do when they are turned with that body. Torques are compared with what the force
    would do 40 cm farther away, and the sum of all forces, if it is as large as half the weight of
    the model, must point up.

    OpenSim applies the force wherever it is told to: joint moments are wrong by the force times
    that distance, without a word. Feet that were taken for one another, points in millimetres,
    torques in newton millimetres, axes of the laboratory that are not those of the model, forces on
    the ground for those on the foot, and loads of another trial are found so.

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
    if setup.tree is None:
        return
    # Of several tools that read the same loads, some have no motion yet.
    motions = (setup.table_of_tool(motion_of(*reader)) for reader in setup.readers())
    motion = next((table for table in motions if table is not None and not table.is_markers), None)
    model: Any = setup.tree.model
    weight = math.hypot(*model.gravity)
    if motion is None or not weight:
        return
    up = tuple(-part / weight for part in model.gravity)
    mass = sum(body.mass for body in setup.tree.members("/bodyset", "Body").values())
    for loads in setup.named("ExternalLoads"):
        table = setup.table(loads.datafile)
        whole = [0.0, 0.0, 0.0]
        for force in members(loads, "ExternalForce") if table is not None else ():
            acting = _acting(setup, force, table, motion)
            for push in acting:
                whole = [
                    total + push.size * part / _TIMES
                    for total, part in zip(whole, push.direction, strict=True)
                ]
            far = [push.away for push in acting if push.away > _NEAR]
            if len(far) > max(2, len(acting) // 4):
                report(
                    f"at {len(far)} of {len(acting)} times {called(force)} acts more than {_NEAR:g} m from "
                    f"{force.applied_to_body}, by up to {max(far):.3g} m: is it another body's, or are its points in "
                    "another frame or other units?",
                    force,
                    tag="applied_to_body",
                )
            elif sum(push.twist > _NEAR for push in acting) > max(2, len(acting) // 4):
                report(
                    f"the torque of {called(force)} is that of its force {max(push.twist for push in acting):.3g} m "
                    "farther: is it in newton millimetres, or about another point?",
                    force,
                    tag="torque_identifier",
                )
            lifted = [
                dot(push.written, up) - dot(push.direction, up)
                for push in acting
                if push.written != push.direction
            ]
            if len(lifted) > 2 and max(lifted) > 0.03 and min(lifted) > -0.02:
                report(
                    f"{called(force)} is expressed in {force.force_expressed_in_body}, and its numbers look like those "
                    "of ground: they point up as they are",
                    force,
                    tag="force_expressed_in_body",
                )
        lift = sum(part * share for part, share in zip(whole, up, strict=True))
        if math.hypot(*whole) > max(0.5 * mass * weight, 2.0 * lift):
            report(
                f"together these forces push with {math.hypot(*whole):.0f} N ({', '.join(f'{n:.0f}' for n in whole)}) "
                "on the average, and that is not up: are their axes or signs other ones?",
                loads,
                tag="datafile",
            )


class _Push(NamedTuple):
    """What a force does at a time: how far from the origin of its body, m, and what its torque adds
    to that, m; its size, N, and its direction, as it is written and in ground.
    """

    away: float
    twist: float
    size: float
    written: Vector
    direction: Vector


def _acting(setup: Setup, force: Any, table: Table | None, motion: Table) -> list[_Push]:
    """What a force does at those of some times at which it is large."""
    if setup.tree is None or table is None or table.span is None or motion.span is None:
        return []
    bodies = setup.tree.members("/bodyset", "Body")
    places = [
        [
            place
            for place, label in enumerate(table.columns, 1)
            if prefix and label.startswith(prefix)
        ]
        for prefix in (force.force_identifier, force.point_identifier, force.torque_identifier)
    ]
    first, last = max(table.span[0], motion.span[0]), min(table.span[1], motion.span[1])
    if [len(part) for part in places[:2]] != [3, 3] or not first < last or not force.appliesForce:
        return []
    rows = [table.row_at(first + (last - first) * (k + 0.5) / _TIMES) for k in range(_TIMES)]
    rows = [row for row in rows if len(row) == len(table.labels) and not any(map(math.isnan, row))]
    sizes = [math.hypot(*(row[place] for place in places[0])) for row in rows]
    result = []
    for row, size in zip(rows, sizes, strict=True):
        if size > max(20.0, 0.2 * max(sizes)):
            poses = poses_in(setup, motion, row[0])
            (x, y, z), (px, py, pz), torque = ([row[place] for place in part] for part in places)
            frames = (
                force.applied_to_body,
                force.force_expressed_in_body,
                force.point_expressed_in_body,
            )
            names = [str(frame).rpartition("/")[2] for frame in frames]
            within = [
                Pose() if name == "ground" else poses.get(id(bodies.get(name))) for name in names
            ]
            body, of_force, of_point = within
            if body is not None and of_force is not None and of_point is not None:
                direction = (x / size, y / size, z / size)
                point = of_point.of((px, py, pz))
                known = _points_of(setup).get(names[0], [])
                away = min(math.dist(body.of(place), point) for place in [(0.0, 0.0, 0.0), *known])
                result.append(
                    _Push(
                        away,
                        math.hypot(*torque) / size,
                        size,
                        direction,
                        of_force.turned(direction),
                    )
                )
    return result


@once
def _points_of(setup: Setup) -> dict[str, list[Vector]]:
    """Return known points on each body by its name (m): mass centre, joint frames, markers and contacts."""
    subject = model_subject(setup)
    result: dict[str, list[Vector]] = {}

    def add(frame: Any, location: Sequence[float]) -> None:
        base = on_base(subject, frame)
        if base is not None and len(location) == 3 and not any(map(math.isnan, location)):
            x, y, z = location
            result.setdefault(str(base[0].name), []).append(base[1].of((x, y, z)))

    for body in subject.named("Body"):
        add(body, body.mass_center)
    for joint in subject.named("Joint"):
        for tag in ("socket_parent_frame", "socket_child_frame"):
            add(subject.target_of(joint, tag), (0.0, 0.0, 0.0))
    for station in subject.named("Marker"):
        add(subject.target_of(station, "socket_parent_frame"), station.location)
    for surface in subject.named("ContactGeometry"):
        if not is_a(surface, "ContactHalfSpace"):
            add(subject.target_of(surface, "socket_frame"), surface.location)
    return result
