"""``osimlite info``: contents of a model, setup or table."""

from __future__ import annotations

import re
import textwrap
from collections import Counter
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from osimlite.base.text import format_count
from osimlite.cli._command import Argument, Option, command

if TYPE_CHECKING:
    from osimlite.schema.base import Object
    from osimlite.schema.model import Model


@command
def info(
    file: Annotated[Path, Argument(help="A model, a setup or a table.", show_default=False)],
    everything: Annotated[
        bool, Option("--all", help="List every class, or every column of a table.")
    ] = False,
) -> None:
    """Show the contents of a model: versions, mass, bodies, joints, coordinates, muscles, and counts of all classes.

    Also lists what cannot be simulated. For a setup it lists the files that the tool reads and
    writes, for a table its times, units and columns.

    Example: osimlite info gait2392.osim
    """
    from osimlite.cli._answers import compute_or_load
    from osimlite.cli._console import FactTable, say
    from osimlite.io.document.reader import read_document
    from osimlite.io.document.source import Source
    from osimlite.lint.project_files import is_table
    from osimlite.schema.base import Object
    from osimlite.schema.coordinates import Coordinate
    from osimlite.schema.joints import Joint
    from osimlite.schema.model import Model
    from osimlite.schema.tree import is_a

    if is_table(str(file)):
        _print_table_info(file, everything)
        return
    source = Source.from_file(file)
    document = read_document(source, expected_class=Object)
    model = document.top
    size = f"{file} ({file.stat().st_size / 1000:.0f} kB)"
    if not isinstance(model, Model):
        rows = [
            (model.tag, model.name),
            ("file", size),
            ("document version", str(document.version)),
        ]
        rows += [*_list_files(model, file.parent), *_make_note_rows(len(document.notes))]
        FactTable(rows=rows).show()
        _print_classes([*model.walk()], everything)
        return
    tree = model.tree()
    # Leave out the components that OpenSim adds itself: they are not in the file.
    components = [component for component in tree.components if not tree.is_internal(component)]
    muscles = [component for component in components if is_a(component, "Muscle")]
    # Since OpenSim 4, forces may also stand outside of the ForceSet, in <components>.
    forces = [component for component in components if is_a(component, "Force")]
    wraps = [component for component in components if is_a(component, "PathWrap")]
    surfaces = sum(is_a(component, "WrapObject") for component in components)
    mass = sum(body.mass for body in model.body_set.objects)
    simulation = partial(_describe_simulation, model, file.parent, source.text)

    FactTable(
        rows=[
            ("model", model.name),
            ("file", size),
            ("document version", str(document.version)),
            (
                "gravity",
                " ".join(f"{component_m_s2:g}" for component_m_s2 in model.gravity) + " m/s^2",
            ),
            ("bodies", f"{len(model.body_set.objects)}, {mass:.6g} kg"),
            ("joints", str(len(model.joint_set.objects))),
            (
                "coordinates",
                str(sum(isinstance(component, Coordinate) for component in components)),
            ),
            ("muscles", str(len(muscles))),
            ("other forces", str(len(forces) - len(muscles))),
            (
                "wrap surfaces",
                f"{surfaces}, used by {format_count(len(wraps), 'path wrap')}" if surfaces else "0",
            ),
            ("markers", str(len(model.marker_set.objects))),
            ("controllers", str(len(model.controller_set.objects))),
            ("probes", str(len(model.probe_set.objects))),
            ("contact surfaces", str(len(model.contact_geometry_set.objects))),
            ("constraints", str(len(model.constraint_set.objects))),
            ("components", f"{len(components)} in the file"),
            *_make_note_rows(len(document.notes)),
            ("simulation", compute_or_load("simulation", str(file), source.data, simulation)),
        ]
    ).show()

    if any(joint.coordinates for joint in model.components(Joint)):
        say()
        say("Coordinates: default, range")
        for line in _format_coordinates(model):
            # These lines are not wrapped, so that names stay whole in a narrow terminal.
            say(line)

    if muscles:
        say()
        say("Muscles: maximum isometric force, optimal fiber length, tendon slack length, path")
        for line in _format_muscles(muscles):
            say(line)

    _print_classes(components, everything)


def _print_table_info(file: Path, show_all: bool) -> None:
    from osimlite.base.files import read_file
    from osimlite.cli._console import FactTable
    from osimlite.io.tables.headers import StorageHeader
    from osimlite.lint.table import Table

    table = Table(read_file(file), str(file))
    header_values = {key: entry.value.text for key, entry in table.entries.items()}
    header = table.header
    table_type = (
        f"storage, version {header.form}" if isinstance(header, StorageHeader) else "markers"
    )
    if isinstance(header, StorageHeader) and header.parts > 1:
        table_type += f", each cell a {header.kind}"
    rows = len(table.rows.times)
    facts = FactTable()
    facts.add("table", table_type)
    facts.add("file", f"{file} ({len(table.data) / 1000:.0f} kB)")
    facts.add("rows", str(rows))
    facts.add("markers" if table.is_markers else "columns besides time", str(len(table.columns)))
    if table.span is not None:
        first, last = table.span
        rate = f", {table.rate:.4g} Hz" if table.rate > 0.0 else ""
        facts.add("time", f"{first:g} to {last:g} s{rate}")
    elif rows:
        facts.add("time", "not readable in every row; see 'osimlite validate'")
    unit = "Units" if table.is_markers else "inDegrees"
    facts.add(unit, header_values.get(unit, "not stated"))
    facts.show()
    _print_items("Markers" if table.is_markers else "Columns", table.columns, show_all)


def _make_note_rows(count: int) -> list[tuple[str, str]]:
    """Return a row with the number of problems that the reader met, if there are any."""
    problems = format_count(count, "problem")
    return [("reading the file", f"{problems}; see 'osimlite validate'")] if count else []


def _list_files(top: Object, folder: Path) -> Iterator[tuple[str, str]]:
    """Yield the properties that name files and folders, with their values and whether the files are missing."""
    from osimlite.schema.specs import get_reference_specs

    for owner in top.walk():
        for spec in get_reference_specs(type(owner)):
            value = getattr(owner, spec.name)
            if not spec.reference.target.endswith(("file", "folder")):
                continue
            for name in value if isinstance(value, tuple) else (value,):
                if name not in ("", None, "Unassigned"):
                    is_missing = (
                        spec.reference.rule == "file" and not (folder / name.strip()).is_file()
                    )
                    status = (
                        " (missing)"
                        if is_missing
                        else " (written)"
                        if spec.reference.rule.startswith("output")
                        else ""
                    )
                    yield (
                        spec.name if owner is top else f"{owner.name or owner.tag}: {spec.name}",
                        f"{name}{status}",
                    )


def _print_classes(objects: Sequence[Object], show_all: bool) -> None:
    """Print the number of objects of each class."""
    from osimlite.schema.base import Unknown

    counts = Counter(
        each_object.class_name if isinstance(each_object, Unknown) else type(each_object).__name__
        for each_object in objects
    )
    _print_items("Classes", [f"{count} {name}" for name, count in counts.most_common()], show_all)


def _print_items(title: str, items: Sequence[str], show_all: bool) -> None:
    """Print a list of items, unless `show_all` the first 15 only."""
    from osimlite.base.text import escape_unprintable
    from osimlite.cli._console import count_columns, say, show

    visible_items = items if show_all else items[:15]
    # NUL keeps textwrap from breaking lines within an item.
    text = f"{title}: " + ", ".join(
        escape_unprintable(item).replace(" ", "\0") for item in visible_items
    )
    lines = textwrap.fill(text, count_columns(), subsequent_indent="  ", break_long_words=False)
    show("\n" + lines.replace("\0", " ") + "\n")
    if len(items) > len(visible_items):
        say(f"and {len(items) - len(visible_items)} more (--all lists them)")


def _format_coordinates(model: Model) -> Iterator[str]:
    """Yield a line for each joint, and one for each of its coordinates with default and range."""
    from osimlite.schema.joints import Joint
    from osimlite.schema.states import list_motions

    joints = [joint for joint in model.components(Joint) if joint.coordinates]
    width = max(len(coordinate.name) for joint in joints for coordinate in joint.coordinates)
    for joint in joints:
        yield f"  {joint.name} ({type(joint).__name__})"
        motions = list_motions(joint)
        for coordinate in joint.coordinates:
            unit = {"rotational": "rad", "translational": "m"}.get(
                motions.get(coordinate.name, ""), ""
            )
            lower, upper = coordinate.range
            flags = [
                flag for flag in ("locked", "clamped", "prescribed") if getattr(coordinate, flag)
            ]
            numbers = f"{coordinate.default_value:>9.4g} {unit:3}  {lower:.4g} to {upper:.4g} {unit}".rstrip()
            yield f"    {coordinate.name:{width}} {numbers}" + (
                f"  ({', '.join(flags)})" if flags else ""
            )


def _format_muscles(muscles: Sequence[Any]) -> Iterator[str]:
    """Yield a line for each muscle, grouped by class."""
    from osimlite.schema.paths import GeometryPath

    width = max(len(muscle.name) for muscle in muscles)
    for class_name in dict.fromkeys(type(muscle).__name__ for muscle in muscles):
        yield f"  {class_name}"
        for muscle in muscles:
            if type(muscle).__name__ != class_name:
                continue
            path = muscle.geometry_path
            path_text = type(path).__name__
            if isinstance(path, GeometryPath):
                wraps = len(path.path_wrap_set.objects)
                path_text = format_count(len(path.path_point_set.objects), "point")
                path_text += f", {format_count(wraps, 'wrap')}" if wraps else ""
            lengths = f"{muscle.optimal_fiber_length:>7.4g} m {muscle.tendon_slack_length:>7.4g} m"
            yield f"    {muscle.name:{width}} {muscle.max_isometric_force:>7.5g} N {lengths}  {path_text}"


def _describe_simulation(model: Model, folder: Path, text: str) -> tuple[str, bool]:
    """Describe which parts of a model cannot be simulated.

    Args:
        model: model to describe.
        folder: folder of the model file.
        text: content of the model file.

    Returns:
        The description, and whether it depends on the model file alone and may be cached.
    """
    from osimlite.base.require import require
    from osimlite.base.text import join_words
    from osimlite.errors import OsimliteError

    try:
        require("numpy", extra="sim", purpose="simulations")
        from osimlite.mechanics.multibody import build_mechanism
        from osimlite.simulation.elements import force_elements, summarize_skipped

        mechanism = build_mechanism(model)
        forces = force_elements(model, mechanism, skip_unsupported=True, folder=folder)
        # The mass matrix of bodies without mass is singular, which shows only here.
        mechanism.acceleration(*mechanism.default_state())
    except OsimliteError as error:
        return f"not possible: {error}", False
    description = "possible, every force is supported"
    if forces.skipped:
        skipped_text = join_words(summarize_skipped(forces.skipped))
        description = (
            f"possible only without unsupported forces (--skip-unsupported): {skipped_text}"
        )
    # An attribute ``file`` includes another file, which may change without this one.
    return description, not forces.reads_files and re.search(r"\sfile\s*=", text) is None
