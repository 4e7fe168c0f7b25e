"""OSIM857 to OSIM859: units of markers and loads, and ground reactions that act twice."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import islice
from typing import Any

from osimlite.base.text import join_words
from osimlite.io.tables.headers import METRES_PER_UNIT
from osimlite.lint.placement import locate_frame
from osimlite.lint.posture import locate_markers, make_model_subject
from osimlite.lint.registry import WARNING, FindingCollector, rule
from osimlite.lint.rules.setup_markers import iterate_rows_between, list_marker_cells
from osimlite.lint.setup import Setup, select_members
from osimlite.lint.table import Table
from osimlite.schema.frames import Ground
from osimlite.schema.tree import is_a

_SIZE_RATIOS = 0.3, 3.0
"""Smallest and largest plausible ratio of the measured size of a body to that in the model."""
_MAX_ROWS = 50
"""Number of rows of markers that are examined."""
_MIN_MARKERS = 3
"""Smallest number of markers that data and model must share."""
_MAX_SLIGHT_FRACTION = 0.02
"""Ratio of the largest load to the model's weight below which loads are doubtful."""
_WEIGHT_RANGE = 0.2, 10.0
"""Plausible ratios of the largest load of a trial, in newtons, to the model's weight."""


@rule("OSIM857", "marker-size", severity=WARNING, about="document")
def report_marker_size(setup: Setup, report: FindingCollector) -> None:
    """The measured markers have a different spread from those of the model.

    Compares the size of the box around the markers of a frame with that of the same markers of the
    model in its default pose. The data are read in the units that the file declares. If the sizes
    differ by more than a factor of three, but would agree in other units, the rule suggests those
    units.

    OpenSim uses the declared units without a message. If centimetres are declared as millimetres,
    inverse kinematics ends with errors of decimetres, and a scaled model has a tenth of the size.

    ```setup
      <InverseKinematicsTool name="ik">
          <model_file>sides.osim</model_file>
    -     <marker_file>sides_centimetres.trc</marker_file>
    +     <marker_file>sides.trc</marker_file>
          <time_range>0 0.02</time_range>
          <output_motion_file>ik.mot</output_motion_file>
      </InverseKinematicsTool>
    ```
    """
    users = setup.find_having("marker_file", "time_range")
    for user, table in setup.iterate_with_tables(users, "marker_file"):
        units = table.entries.get("Units")
        unit = METRES_PER_UNIT.get(units.value.text) if units is not None else None
        if setup.tree is None or not table.is_markers or unit is None or units is None:
            continue
        # A task that is not applied reads no markers.
        if not getattr(user, "apply", True):
            continue
        positions = locate_markers(setup)
        columns = dict(list_marker_cells(table))
        names = [name for name in columns if name in positions]
        sizes = []
        # A few frames tell the size; some markers may be hidden in each.
        for row in islice(iterate_rows_between(table, user.time_range), _MAX_ROWS):
            cells_by_name = {name: row[columns[name]] for name in names}
            # A marker exactly at the origin is a missing one in some files.
            cells_by_name = {
                name: cells
                for name, cells in cells_by_name.items()
                if not any(map(math.isnan, cells)) and any(cells)
            }
            if len(cells_by_name) >= _MIN_MARKERS and (
                # Markers at one place have no size to compare.
                model_size := _measure_size([positions[name] for name in cells_by_name])
            ):
                sizes.append(_measure_size([*cells_by_name.values()]) / model_size)
        if not sizes:
            continue
        # The median is not moved by frames with swapped markers.
        ratio = sorted(sizes)[len(sizes) // 2]
        low, high = _SIZE_RATIOS
        # Larger units are tried first.
        better = [
            name for name in ("m", "cm", "mm") if low <= ratio * METRES_PER_UNIT[name] <= high
        ]
        if better and not low <= ratio * unit <= high:
            report(
                f"in the units of '{user.marker_file}', '{units.value.text}', its markers are "
                f"{float(f'{ratio * unit:.3g}'):g} times as far apart as in the model: are the "
                f"numbers in {better[0]}?",
                user,
                tag="marker_file",
            )


def _measure_size(points: Sequence[Sequence[float]]) -> float:
    """Return the diagonal of the box around points."""
    return math.hypot(*(max(axis) - min(axis) for axis in zip(*points, strict=True)))


@rule("OSIM858", "load-units", severity=WARNING, about="document")
def report_load_units(setup: Setup, report: FindingCollector) -> None:
    """Measured loads are too small for the model, as if they were in kilonewtons.

    Adds up the sizes of all measured forces in each row, and compares the largest sum with the
    weight of the model. Reports the loads if the sum is less than 2 % of the weight, and a thousand
    times the sum would be plausible for ground reactions.

    OpenSim reads all forces in newtons, whatever the header of the file says: the residual forces
    of inverse dynamics then equal the whole weight.

    ```setup
      <ExternalLoads name="loads">
          <objects>
              <ExternalForce name="right">
                  <applied_to_body>shank</applied_to_body>
                  <force_identifier>ground_force_v</force_identifier>
                  <point_identifier>ground_force_p</point_identifier>
              </ExternalForce>
          </objects>
    -     <datafile>kilonewtons.mot</datafile>
    +     <datafile>leg_grf.mot</datafile>
      </ExternalLoads>
    ```
    """
    if setup.tree is None:
        return
    model: Any = setup.tree.model
    mass = sum(body.mass for body in setup.tree.list_members("/bodyset", "Body").values())
    weight = mass * math.hypot(*model.gravity)
    for loads, table in setup.iterate_with_tables(setup.find_by_class("ExternalLoads"), "datafile"):
        largest = _find_largest_load(
            [force for force in select_members(loads, "ExternalForce") if force.appliesForce], table
        )
        low, high = _WEIGHT_RANGE
        # Unloaded plates of a short trial are small in any unit, hence the second test.
        if (
            0.0 < largest < _MAX_SLIGHT_FRACTION * weight
            and low <= 1000.0 * largest / weight <= high
        ):
            report(
                f"the sum of the forces of '{loads.datafile}' is never larger than {largest:.3g} N, "
                f"but the model weighs {weight:.0f} N: are they in kilonewtons?",
                loads,
                tag="datafile",
            )


def _find_largest_load(forces: Sequence[Any], table: Table) -> float:
    """Return the largest sum, N, of the sizes of some forces in a row of their table."""
    prefixes = [str(force.force_identifier) for force in forces if force.force_identifier]
    triples = [
        [index for index, label in enumerate(table.columns, 1) if label.startswith(prefix)]
        for prefix in prefixes
    ]
    triples = [indices for indices in triples if len(indices) == 3]
    sums = (
        sum(math.hypot(*(row[index] for index in indices)) for indices in triples)
        # Incomplete rows are left out.
        for row in table.rows.samples
        if len(row) == len(table.labels)
    )
    return max((size for size in sums if math.isfinite(size)), default=0.0)


@rule("OSIM859", "ground-twice", severity=WARNING, about="document")
def report_ground_twice(setup: Setup, report: FindingCollector) -> None:
    """A contact force of the model and a measured load act on the same body.

    Reports a body on which both a measured force and a contact force of the model act. The contact
    force counts if it is between a surface of the body and a surface that is fixed to ground.
    Contact forces that the tool excludes do not count.

    OpenSim applies both: the ground reaction counts twice, and the residual forces are as large as
    the weight. Exclude the contact forces with `forces_to_exclude`, or disable them in the model.

    ```setup
      <InverseDynamicsTool name="id">
          <model_file>foot_contact.osim</model_file>
          <time_range>0 0.4</time_range>
    -     <forces_to_exclude>Muscles</forces_to_exclude>
    +     <forces_to_exclude>Muscles foot_ground</forces_to_exclude>
          <external_loads_file>leg_grf.xml</external_loads_file>
          <coordinates_file>leg.mot</coordinates_file>
      </InverseDynamicsTool>
    ```
    """
    if setup.tree is None:
        return
    for tool in setup.find_having("external_loads_file"):
        # A goal that tracks measured contact forces compares the loads and does not apply them.
        # Replaced forces do not act, so contact cannot count twice.
        if getattr(tool, "replace_force_set", False) or is_a(tool, "MocoGoal"):
            continue
        loads: Any = setup.read_document(tool.external_loads_file)
        if loads is None or not is_a(loads, "ExternalLoads"):
            continue
        loaded = {
            str(force.applied_to_body).rpartition("/")[2]
            for force in select_members(loads, "ExternalForce")
            if force.appliesForce
        }
        doubled_contacts = [
            (force, body)
            for force, bodies in _find_ground_contacts(setup)
            if not _is_excluded(setup, tool, force)
            # The body must be both loaded and in contact with ground.
            for body in sorted(bodies & loaded)
        ]
        if doubled_contacts:
            names = join_words([f"'{force.name}'" for force, _ in doubled_contacts], max_count=3)
            bodies = join_words(sorted({body for _, body in doubled_contacts}), max_count=3)
            tag = (
                "forces_to_exclude" if hasattr(tool, "forces_to_exclude") else "external_loads_file"
            )
            report(
                f"{names} of the model and the loads of '{tool.external_loads_file}' are both ground "
                f"reactions on {bodies}, so the ground reaction counts twice: exclude the contact forces",
                tool,
                tag=tag,
            )


def _find_ground_contacts(setup: Setup) -> Iterator[tuple[Any, set[str]]]:
    """Yield every force between surfaces on ground and on bodies, with the names of these bodies."""
    subject = make_model_subject(setup)
    for force in subject.find_by_class("Force"):
        if not force.appliesForce:
            continue
        bases = [
            base[0]
            for surface in _find_surfaces(setup, force)
            if (base := locate_frame(subject, subject.target_of(surface, "socket_frame")))
            is not None
        ]
        if any(isinstance(base, Ground) for base in bases):
            names = {str(base.name) for base in bases if not isinstance(base, Ground)}
            if names:
                yield force, names


def _find_surfaces(setup: Setup, force: Any) -> Iterator[Any]:
    """Yield the contact surfaces that a force names."""
    subject = make_model_subject(setup)
    for use in subject.uses:
        if use.owner is force:
            target = subject.resolution(use).target
            if target is not None and is_a(target, "ContactGeometry"):
                yield target


def _is_excluded(setup: Setup, tool: Any, force: Any) -> bool:
    """Return whether a tool switches a force of the model off."""
    names = {str(name) for name in getattr(tool, "forces_to_exclude", ())}
    if "all" in {name.lower() for name in names} or force.name in names:
        return True
    model: Any = setup.tree.model if setup.tree is not None else None
    groups = {group.name: group.members for group in model.force_set.groups}
    return any(force.name in map(str, groups.get(name, ())) for name in names)
