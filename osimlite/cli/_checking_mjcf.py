"""``osimlite translate --check``: compare a MuJoCo model with the OpenSim model it was made from."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from osimlite.base.text import join_words
from osimlite.cli._console import add_row, create_table, print_table, say


def print_mjcf_check(file: Path, mjcf: Path, output: Path | None) -> None:
    """Compare a MuJoCo model with an OpenSim model, print a table of muscles, and save the result.

    Args:
        file: OpenSim model.
        mjcf: MuJoCo model.
        output: folder for check.json; None writes no file.
    """
    from osimlite.base.files import make_folder, write_atomically
    from osimlite.io.document.reader import read
    from osimlite.translate.mjcf.check import check_mjcf

    result = check_mjcf(read(file), mjcf)
    print_table(_make_table(result, mjcf.name))
    say(
        "fiber ratio: optimal fiber length relative to the model's; slack: change of the tendon slack length"
    )
    if result.missing:
        say(f"the file lacks {join_words(list(result.missing), max_count=6)}")
    if result.coordinates:
        say(
            f"the file has no joint for {join_words(list(result.coordinates), max_count=6)}; these "
            "coordinates do not move in the comparison"
        )
    if result.bodies is not None:
        say(
            f"origins of bodies differ from the model's by {1e3 * result.bodies.rms:.2g} mm (root mean square)"
        )
    if output is not None:
        make_folder(output)
        write_atomically(output / "check.json", result.to_json())
        say(f"wrote {output / 'check.json'}")


def _format_mm(error: float) -> str:
    """Return an error (m) as a text in mm; "0" if it is only rounding."""
    return "0" if error < 1e-9 else f"{1e3 * error:.3g}"


def _make_table(result: Any, name: str) -> Any:
    """Return the table of errors, one muscle per row, sorted by the error of the moment arm.

    Errors are root mean squares over random poses; of the moment arms, that of the worst coordinate.
    The last columns are the ratio of the implied optimal fiber length to the model's, and the
    difference of the tendon slack lengths.
    """
    table = create_table(f"{name}: root mean square errors")
    for column in (
        "muscle",
        "length, mm",
        "moment arm, mm",
        "force, Fmax",
        "fiber ratio",
        "slack, mm",
    ):
        table.add_column(column, justify="left" if column == "muscle" else "right", overflow="fold")
    for muscle in sorted(result.muscles, key=lambda muscle_check: -muscle_check.worst_arm.rms):
        add_row(
            table,
            muscle.name,
            _format_mm(muscle.length.rms),
            _format_mm(muscle.worst_arm.rms),
            "" if muscle.force is None else f"{muscle.force.rms:.3f}",
            "" if muscle.fiber is None else f"{muscle.fiber:.4g}",
            "" if muscle.tendon is None else f"{1e3 * muscle.tendon:+.3g}",
        )
    return table
