"""``osimlite info``: what is in a model file."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Annotated

import typer


def info(
    file: Annotated[Path, typer.Argument(help="A model file.", show_default=False)],
    every_class: Annotated[bool, typer.Option("--all", help="List every component class, however rare.")] = False,
) -> None:
    """Show what is in a model: versions, mass, bodies, joints, coordinates, muscles, and how many of each class."""
    from rich.console import Console
    from rich.table import Table

    from osimlite.document.reader import read_document
    from osimlite.document.source import Source
    from osimlite.schema.coordinates import Coordinate
    from osimlite.schema.joints import Joint
    from osimlite.schema.tree import is_a

    document = read_document(Source.of_file(file))
    model = document.model
    components = list(model.components())
    muscles = sum(is_a(component, "Muscle") for component in components)
    mass = sum(body.mass for body in model.body_set.objects)

    console = Console()
    facts = Table(show_header=False, box=None, pad_edge=False)
    facts.add_column(style="bold")
    facts.add_column(overflow="fold")
    for name, value in (
        ("model", model.name),
        ("file", f"{file} ({file.stat().st_size / 1000:.0f} kB)"),
        ("document version", str(document.version)),
        ("gravity", " ".join(f"{g:g}" for g in model.gravity) + " m/s^2"),
        ("bodies", f"{len(model.body_set.objects)}, {mass:.6g} kg"),
        ("joints", str(len(model.joint_set.objects))),
        ("coordinates", str(sum(isinstance(component, Coordinate) for component in components))),
        ("muscles", str(muscles)),
        ("forces besides", str(len(model.force_set.objects) - muscles)),
        ("markers", str(len(model.marker_set.objects))),
        ("contact surfaces", str(len(model.contact_geometry_set.objects))),
        ("constraints", str(len(model.constraint_set.objects))),
        ("components in all", str(len(components))),
        ("remarks of the reader", str(len(document.notes))),
    ):
        facts.add_row(name, value)
    console.print(facts)

    table = Table(title="Coordinates", title_justify="left")
    for heading in ("joint", "class", "coordinate", "default", "range", ""):
        table.add_column(heading, justify="right" if heading in ("default", "range") else "left", overflow="fold")
    for joint in model.components(Joint):
        for number, coordinate in enumerate(joint.coordinates):
            low, high = coordinate.range
            flags = [word for word in ("locked", "clamped", "prescribed") if getattr(coordinate, word)]
            table.add_row(
                joint.name if number == 0 else "",
                type(joint).__name__ if number == 0 else "",
                coordinate.name,
                f"{coordinate.default_value:.4g}",
                f"{low:.4g} .. {high:.4g}",
                " ".join(flags),
            )
    if table.row_count:
        console.print(table)

    counts = Counter(getattr(component, "class_name", None) or type(component).__name__ for component in components)
    shown = counts.most_common(None if every_class else 15)
    console.print("classes: " + ", ".join(f"{count} {name}" for name, count in shown), highlight=False)
    if len(counts) > len(shown):
        console.print(f"and {len(counts) - len(shown)} classes more (--all lists them)")
