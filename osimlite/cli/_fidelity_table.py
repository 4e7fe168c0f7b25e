"""Table of what a translation lost or approximated, for terminals."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from osimlite.base.text import join_words
from osimlite.cli._console import add_row, create_table
from osimlite.translate.exporters import EXPORTERS
from osimlite.translate.importers import OSIM, PROJECT

if TYPE_CHECKING:
    from osimlite.translate.fidelity import Fidelity


def tabulate(fidelity: Fidelity, target: str) -> Any:
    """Return a table of what the translation lost or approximated.

    Components with equal records share a row.

    Args:
        fidelity: records of the translation.
        target: name of the format, as an option has it.
    """
    titles = {exporter.name: exporter.title or exporter.name.upper() for exporter in EXPORTERS}
    title = (titles | {OSIM: "OpenSim", PROJECT: "the files for OpenSim"}).get(target, target)
    table = create_table(f"Lost or approximated in {title}: {fidelity.model}", padding=(0, 2, 1, 0))
    table.add_column("what", overflow="fold", ratio=4)
    table.add_column("translation", overflow="fold", ratio=3)
    table.add_column("components", overflow="fold", ratio=3)
    has_errors = any(record.errors for record in fidelity)
    if has_errors:
        table.add_column("worst error", overflow="fold", ratio=2)
    for group in fidelity.groups():
        # Users know a path by the name of its muscle.
        owners = (component.removesuffix("/path") for component in group.components)
        names = dict.fromkeys(owner.rsplit("/", 1)[1] or "the model" for owner in owners)
        largest_errors = [f"{name} {error.max:.2g} {error.unit}" for name, error in group.worst()]
        add_row(
            table,
            group.cannot_say,
            group.done,
            join_words(list(names), max_count=3),
            *([", ".join(largest_errors)] if has_errors else []),
        )
    return table
