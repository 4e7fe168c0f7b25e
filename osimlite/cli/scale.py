"""``osimlite scale``: scale a generic model to the size and mass of a subject."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from osimlite.cli import _options as options
from osimlite.cli._command import Argument, Option, command


@command
def scale(
    file: options.File,
    static: Annotated[
        Path | None,
        Argument(help="Measured markers of the standing subject: .trc, .c3d or .sto."),
    ] = None,
    distance: Annotated[
        list[str] | None,
        Option(
            "--distance",
            metavar="BODY=A:B",
            help="Scale a body by the distance between the markers A and B: measured distance divided by that in the model. "
            "Several pairs, separated by commas, are averaged. BODY.XZ scales the axes X and Z only. May be repeated.",
        ),
    ] = None,
    factor: Annotated[
        list[str] | None,
        Option(
            "--factor",
            metavar="BODY=X[,Y,Z]",
            help="Scale a body by a number, or one for each axis.",
        ),
    ] = None,
    mass: options.Mass = None,
    preserve: Annotated[
        bool, Option("--preserve-masses", help="Keep each body's share of the total mass.")
    ] = False,
    place: Annotated[
        bool, Option("--place", help="Move the model's markers to their measured positions.")
    ] = False,
    first: options.FirstFrame = float("-inf"),
    last: options.LastFrame = float("inf"),
    output: Annotated[
        Path | None,
        Option(
            "-o", "--output", metavar="FILE", help="The scaled model.", show_default="scaled.osim"
        ),
    ] = None,
) -> None:
    """Scale a model to a subject, as OpenSim's ScaleTool does.

    Muscle lengths, masses and inertias are scaled accordingly. With --place the model is put into
    the pose of the subject, and its markers are moved to their measured positions.

    Example: osimlite scale gait2392.osim static.trc --distance femur_r=RASI:RKNE --mass 72 --place
        -o subject.osim
    """
    # Numpy and the fitting package are imported only when the command runs, so that help is fast.
    import itertools

    from osimlite.base.files import make_folder_of
    from osimlite.base.text import suggest_name
    from osimlite.cli._console import say
    from osimlite.cli._progress import progress_bar
    from osimlite.errors import SettingError
    from osimlite.fitting.scale_tool import scale as scaled
    from osimlite.io.document.printer import write
    from osimlite.io.document.reader import read
    from osimlite.schema.markers import Marker

    # BODY=A:B,C:D gives several pairs; "BODY.XZ" restricts the factor to these axes.
    measurements = {
        body: (
            [_parse_pair(pair_text, body) for pair_text in pairs_text.split(",")],
            {body.partition(".")[0]: _parse_axes(body)},
        )
        for body, pairs_text in options.parse_named_words(
            distance, "--distance", "BODY=MARKER:MARKER"
        ).items()
    }
    factors = {
        body: _parse_factors(text, body)
        for body, text in options.parse_named_words(factor, "--factor").items()
    }
    # Without any of these the model would be written unchanged.
    subject_mass = options.resolve_mass(mass)
    if not (measurements or factors or place or mass is not None):
        raise SettingError("there is nothing to scale; add --distance, --factor, --mass or --place")
    if static is not None and not (measurements or place):
        raise SettingError(f"'{static}' has no effect; add --distance or --place, or leave it out")
    with progress_bar("scaling", None):
        model = read(file)
        # A setup may name markers that the model lacks, as in OpenSim; here it is a spelling error.
        marker_names = {marker.name for marker in model.components(Marker)}
        for pairs, _ in measurements.values():
            for name in itertools.chain.from_iterable(pairs):
                if name not in marker_names:
                    raise SettingError(
                        f"--distance: '{model.name}' has no marker '{name}'{suggest_name(name, marker_names)}"
                    )
        result = scaled(
            model,
            static,
            measurements=measurements,
            factors=factors,
            mass=subject_mass,
            preserve_mass_distribution=preserve,
            place=place,
            start=first,
            end=last,
        )
    assert result.measured is not None
    # OpenSim's setups skip such a measurement. On a command line it is a mistake, and the body
    # would keep its size.
    if result.measured.notes:
        raise SettingError(f"--distance: {result.measured.notes[0]}")
    for name, ratio in result.measured.ratios.items():
        is_replaced = name.partition(".")[0] in factors
        say(f"{name}: {ratio:.6g}{', not used because of --factor' if is_replaced else ''}")
    say(f"mass: {result.describe_mass()}")
    if result.placed is not None:
        for _, line in result.placed.describe_pose():
            say(line)
    if result.unknown:
        say(result.unknown, err=True)
    path = Path("scaled.osim") if output is None else output
    make_folder_of(path)
    write(result.model, path)
    say(f"wrote {path}")


def _parse_pair(text: str, body: str) -> tuple[str, str]:
    from osimlite.errors import SettingError

    first, _, second = text.partition(":")
    if not first or not second:
        raise SettingError(
            f"'{text}' is not a pair of markers for '{body}'; write {body}=MARKER:MARKER"
        )
    return first.strip(), second.strip()


def _parse_axes(body: str) -> str:
    return body.partition(".")[2] or "XYZ"


def _parse_factors(text: str, body: str) -> tuple[float, ...]:
    from osimlite.errors import SettingError

    try:
        numbers = [float(number_text) for number_text in text.split(",")]
    except ValueError:
        # A word that is no number leads to the same message as a wrong count.
        numbers = []
    # One number holds for all three axes.
    if len(numbers) not in (1, 3):
        raise SettingError(
            f"'{text}' is not a factor for '{body}'; write one number, or three with commas"
        )
    return tuple(numbers * 3)[:3]
