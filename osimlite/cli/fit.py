"""``osimlite fit``: fit a model to a person from recorded movements."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from osimlite.cli import _options as options
from osimlite.cli._command import Argument, Option, command


@command
def fit(
    file: options.File,
    trials: Annotated[
        list[Path], Argument(help="Files with measured markers of movements: .trc, .c3d, .sto.")
    ],
    static: Annotated[
        Path | None,
        Option("--static", metavar="FILE", help="Measured markers of the standing subject."),
    ] = None,
    held: Annotated[
        list[str] | None,
        Option(
            "--hold",
            metavar="NAME",
            help="Keep this marker's position in the model, and fit those of all others; may be repeated. "
            "By default the markers with <fixed> true keep theirs.",
        ),
    ] = None,
    weight: options.Weights = None,
    by_axis: Annotated[
        bool,
        Option(
            "--by-axis",
            help="Scale each body by three factors, one for each axis, instead of one factor.",
        ),
    ] = False,
    sides: Annotated[
        bool,
        Option(
            "--each-side",
            help="Scale the bodies of the left and the right side by different factors.",
        ),
    ] = False,
    frames: Annotated[
        int, Option("--frames", metavar="COUNT", help="Number of frames to use, over all trials.")
    ] = 200,
    mass: options.Mass = None,
    output: options.Folder = None,
) -> None:
    """Fit a model to a person: compute segment sizes and marker positions from recorded movements.

    Computes the most likely poses, segment sizes and marker positions together; movements determine
    the joint positions. Writes the model, its markers, its scale factors, and a setup with which
    OpenSim's ScaleTool makes the same model.

    Example: osimlite fit gait2392.osim walk*.trc --static static.trc --hold RASI --hold LASI --mass
        72 -o subject
    """
    from osimlite.base.files import make_folder, write_atomically
    from osimlite.cli._console import say
    from osimlite.cli._progress import progress_bar
    from osimlite.fitting.person import fit as fitted
    from osimlite.fitting.person_files import create_person_files
    from osimlite.io.document.reader import read

    subject_mass = options.resolve_mass(mass)
    with progress_bar("fitting", None):
        person = fitted(
            read(file),
            {str(path): path for path in trials},
            static,
            weights=options.parse_named_numbers(weight, "--weight"),
            held=held,
            by_axis=by_axis,
            symmetric=not sides,
            frames=frames,
            mass=subject_mass,
        )
    folder = options.choose_output_folder(file, output)
    texts = create_person_files(person, file, folder, subject_mass)
    make_folder(folder)
    for name, text in texts.items():
        write_atomically(folder / name, text)
    segments: dict[str, list[str]] = {}
    for body, body_factors in person.factors.items():
        numbers = " ".join(
            f"{factor:.4f}" for factor in (body_factors if by_axis else body_factors[:1])
        )
        segments.setdefault(f"{numbers} ± {max(person.uncertain[body]):.3f}", []).append(body)
    for size, bodies in segments.items():
        say(f"{', '.join(bodies)}: {size}")
    errors_before, errors_after = person.errors(person.before), person.errors(person.after)
    for trial, error in errors_after.items():
        say(
            f"{trial}: errors of {100.0 * error:.2f} cm (root mean square), {100.0 * errors_before[trial]:.2f} cm before"
        )
    for note in person.notes:
        say(note)
    say(f"wrote {', '.join(texts)} in {folder}")
