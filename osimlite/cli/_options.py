"""Arguments and options that several commands share, each with one name, unit and help text."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from osimlite.cli._command import Argument, Option

if TYPE_CHECKING:
    from osimlite.base.options import OptionSpec
    from osimlite.io.document.printer import Numbers as NumberStyle
    from osimlite.mechanics.multibody.mechanism import Mechanism
    from osimlite.schema.model import Model
    from osimlite.studies.reflexes.feedback import Feedback

File = Annotated[Path, Argument(help="A model file.", show_default=False)]
Source = Annotated[
    str,
    Argument(help="A model file, or any source that 'osimlite build' accepts.", show_default=False),
]
Motion = Annotated[Path, Argument(help="Coordinates over time, .sto or .mot.", show_default=False)]
Parameters = Annotated[
    list[str] | None,
    Option(
        "-p",
        "--parameter",
        metavar="NAME=VALUE",
        help="Set a parameter of the model function.",
        show_default=False,
    ),
]
Start = Annotated[
    list[str] | None,
    Option("--set", metavar="NAME=VALUE", help="Initial value of a coordinate (rad, m, or 30deg)."),
]
StartSpeed = Annotated[
    list[str] | None,
    Option(
        "--set-speed", metavar="NAME=VALUE", help="Initial speed of a coordinate (rad/s or m/s)."
    ),
]
To = Annotated[float, Option("--to", metavar="SECONDS", help="End time of the simulation.")]
Engine = Annotated[
    str | None,
    Option(
        help="'compiled' or 'bullet' (PyBullet).",
        show_default="compiled",
    ),
]
FirstFrame = Annotated[
    float,
    Option(
        "--from",
        metavar="SECONDS",
        help="Time of the first frame to use.",
        show_default="the first",
    ),
]
LastFrame = Annotated[
    float,
    Option(
        "--until",
        metavar="SECONDS",
        help="Time of the last frame to use.",
        show_default="the last",
    ),
]
Mass = Annotated[
    float | None,
    Option(
        "--mass",
        metavar="KG",
        help="Mass of the subject.",
        show_default="each mass is scaled with the volume of its body",
    ),
]
Weights = Annotated[
    list[str] | None,
    Option(
        "--weight",
        metavar="NAME=NUMBER",
        help="Weight of a marker or sensor (default 1; 0 ignores it).",
    ),
]
Lowpass = Annotated[
    float | None,
    Option(
        metavar="HZ",
        help="Filter the coordinates first, as OpenSim's tools do; 6 is usual.",
        show_default=False,
    ),
]
AppliedTo = Annotated[
    list[str] | None,
    Option(
        "--applied-to",
        metavar="BODY=FORCE,POINT,MOMENT",
        help="The columns of the table in --external-loads that contain the load on a body: the prefixes of the labels of "
        "force, point and moment, such as f1_,p1_,m1_ for the first plate of a .c3d. Point and moment are optional. "
        "Separate several loads on one body by +: calcn_l=f2_,p2_,m2_+f3_,p3_,m3_.",
        show_default=False,
    ),
]
Foot = Annotated[
    list[str] | None,
    Option(
        metavar="CONTACT",
        help="Contact forces of one foot, joined by +. Repeat it for the other foot.",
        show_default="the ends of the legs",
    ),
]
Controls = Annotated[
    list[str] | None,
    Option(
        "--controls",
        metavar="CONTROLS",
        help="Table of controls, or NAME=VALUE; repeatable.",
        show_default=False,
    ),
]
Controller = Annotated[
    Path | None,
    Option(
        "--controller",
        metavar="FILE",
        help="Reflexes: a controller or a scenario, .yaml or .scone.",
        show_default=False,
    ),
]
Par = Annotated[
    Path | None,
    Option(
        "--par",
        metavar="FILE",
        help="Values of the parameters of reflexes (.par).",
        show_default="the initial values in their file",
    ),
]
Numbers = Annotated[
    str,
    Option(
        help="'shortest': as few digits as give the same number when read; 'opensim': 17 digits."
    ),
]
Format = Annotated[
    str, Option("--format", metavar="FORMAT", help="full, concise, json, github, sarif or junit.")
]
Select = Annotated[
    list[str] | None,
    Option(
        metavar="RULE",
        help="Run only these rules: codes, prefixes of codes (OSIM3), names.",
        show_default=False,
    ),
]
Ignore = Annotated[
    list[str] | None,
    Option(
        metavar="RULE", help="Ignore these rules; same form as for --select.", show_default=False
    ),
]
FailOn = Annotated[
    str | None,
    Option(
        metavar="SEVERITY",
        help="Lowest severity for which the exit code is 1: error, warning or info.",
        show_default=False,
    ),
]
Everything = Annotated[
    bool,
    Option(
        "--all",
        help="Print every finding; by default, only the first of several similar ones, with their number.",
    ),
]
OnlyOurs = Annotated[
    bool,
    Option(
        "--skip-other-xml",
        help="Skip XML files that are not OpenSim's, even if the command line names them.",
    ),
]
Folder = Annotated[
    Path | None,
    Option(
        "-o",
        "--output",
        metavar="FOLDER",
        help="Folder to write into.",
        show_default="named after the model's file",
    ),
]
Plot = Annotated[
    bool,
    Option(
        "--plot",
        help="Draw the results as PNG: curves of the left and the right side in one panel, at most 12 panels a page.",
    ),
]
Band = Annotated[
    Path | None,
    Option(
        "--band",
        metavar="FILE.csv",
        help="With --plot: draw the mean and standard deviation in this file behind the curves. Its columns are per "
        "cent (of the gait cycle), NAME_mean and NAME_sd.",
        show_default=False,
    ),
]
Geometry = Annotated[
    list[Path] | None,
    Option(
        "--geometry",
        metavar="FOLDER",
        help="Also look here for mesh files, after the model's folder and its subfolder Geometry; may be repeated. "
        "The mesh-paths of the settings and the folders in the environment variable OSIMLITE_GEOMETRY, separated by "
        "colons, are searched last.",
    ),
]

Browser = Annotated[bool, Option("--browser/--no-browser", help="Open the page in the browser.")]


def list_simulation_options(
    *names: str, integration: bool = False
) -> Callable[[], Iterator[OptionSpec]]:
    """Return a function that lists the simulation options for :func:`osimlite.cli._command.command_with`.

    Args:
        names: options to list; all by default.
        integration: whether to list the options of integration, too.
    """

    def list_selected() -> Iterator[OptionSpec]:
        from osimlite.base.options import list_options
        from osimlite.simulation.options import INTEGRATION_OPTIONS, Options

        return (
            option
            for option in list_options(Options)
            if not names
            or option.name in names
            or (integration and option.name in INTEGRATION_OPTIONS)
        )

    return list_selected


def read_feedback(controller: Path | None, par: Path | None) -> Feedback | None:
    """Return the controller in a file; None without a file.

    Args:
        controller: file of reflexes or of a scenario.
        par: file with values of its parameters.

    Raises:
        SettingError: `par` is given without a controller.
        OsimliteError: a file cannot be read.
    """
    from osimlite.errors import SettingError

    if controller is None:
        if par is not None:
            raise SettingError("--par sets parameters of a controller; add --controller")
        return None
    from osimlite.studies.reflexes.feedback import Feedback

    return Feedback(controller, {} if par is None else par)


Overwrite = Annotated[
    bool,
    Option(
        "--overwrite",
        help="Also replace files that an earlier run of this conversion did not write.",
    ),
]


def choose_output_folder(file: Path, output: Path | None) -> Path:
    """Return the requested folder, by default one in the current folder, named after the model's file.

    Args:
        file: path of the model file.
        output: requested folder; None for the default.

    Raises:
        OsimliteError: the default folder is a link that leads elsewhere.
    """
    # The functions of this module import what they use: its declarations are read by every command.
    from osimlite.base.writing import expect_folder_inside

    if output is not None:
        return output
    # The user did not choose the default name: a link of this name in a downloaded folder must not
    # redirect results.
    expect_folder_inside(Path(file.stem))
    return Path(file.stem)


def resolve_mass(mass: float | None) -> float:
    """Return the mass of a subject for the fitting functions: -1 if the option is absent.

    Args:
        mass: mass of the subject, kg; None if the option is absent.

    Raises:
        SettingError: the mass is not positive.
    """
    from osimlite.errors import SettingError

    if mass is None:
        return -1.0
    if not mass > 0.0:
        raise SettingError(f"--mass: expected a positive mass in kg, found {mass:g}")
    return mass


def parse_named_words(
    assignments: Iterable[str] | None, option: str, form: str = "NAME=VALUE"
) -> dict[str, str]:
    """Parse the ``NAME=VALUE`` words of an option.

    Args:
        assignments: words of the command line.
        option: name of the option, for messages.
        form: expected form, for messages.

    Returns:
        Text by name.

    Raises:
        SettingError: a word does not have this form, or two have the same name.
    """
    from osimlite.errors import SettingError

    result = {}
    for assignment in assignments or ():
        # The first equals sign separates: values may contain more of them.
        name, equals, value = (piece.strip() for piece in assignment.partition("="))
        if not equals:
            raise SettingError(f"{option} takes {form}, got '{assignment}'")
        if name in result:
            raise SettingError(f"{option} names '{name}' twice; leave one out")
        result[name] = value
    return result


def parse_applied_loads(assignments: Iterable[str] | None) -> dict[str, list[list[str]]]:
    """Parse the words of ``--applied-to``.

    Returns:
        Loads by body, each with the prefixes of its columns, as for
        :func:`osimlite.inverse_dynamics`.

    Raises:
        SettingError: a word does not have this form, or two have the same body.
    """
    text_by_body = parse_named_words(assignments, "--applied-to", "BODY=FORCE,POINT,MOMENT")
    # Several loads on one body are separated by "+", the columns of a load by commas.
    return {
        body: [load.strip().split(",") for load in text.split("+")]
        for body, text in text_by_body.items()
    }


def parse_named_numbers(assignments: Iterable[str] | None, option: str) -> dict[str, float]:
    """Parse the ``NAME=NUMBER`` words of an option.

    Args:
        assignments: words of the command line.
        option: name of the option, for messages.

    Returns:
        Numbers by name.

    Raises:
        SettingError: a word does not have this form, or two have the same name.
    """
    from osimlite.errors import SettingError

    result = {}
    for name, text in parse_named_words(assignments, option, "NAME=NUMBER").items():
        try:
            result[name] = float(text)
        except ValueError:
            raise SettingError(f"'{text}' is not a number for '{name}'; write {name}=2.5") from None
    return result


def parse_quantities(
    assignments: Iterable[str] | None,
    mechanism: Mechanism,
    option: str,
    states: Collection[str] = (),
) -> dict[str, float]:
    """Parse the ``COORDINATE=VALUE`` words of an option.

    Args:
        assignments: words of the command line.
        mechanism: mechanism with the coordinates.
        option: name of the option, for messages.
        states: paths of other states that may be named.

    Returns:
        Numbers (rad, m, or these per second) by coordinate or state.

    Raises:
        SettingError: a value of ``--set`` without a unit is probably in degrees, or the value of a
            state is not a number.
        OsimliteError: a word does not have this form, the coordinate is unknown, or the unit does
            not fit it.
    """
    from osimlite.base.text import suggest_name
    from osimlite.errors import ModelError, OsimliteError, SettingError
    from osimlite.simulation.initial_state import convert_value, describe_suspect_value

    result = {}
    form = "COORDINATE=VALUE with a number such as 0.5 or 30deg"
    for name, text in parse_named_words(assignments, option, form).items():
        try:
            # States such as activations have no unit to convert.
            if name in states:
                result[name] = float(text)
                continue
            result[name] = convert_value(mechanism, name, text, is_speed=option == "--set-speed")
            # Only values are compared with the coordinate's range; speeds have none.
            coordinate = mechanism.coordinates[mechanism.coordinate_index(name)]
            if option == "--set" and (suspicion := describe_suspect_value(coordinate, name, text)):
                raise SettingError(f"{option}: {suspicion} (if not, write {text.strip()}rad)")
        except ModelError as error:
            # The command is wrong and not the model, so this must not be a ModelError.
            message = error.message
            if name not in mechanism.coordinate_names and (similar := suggest_name(name, states)):
                message = f"'{mechanism.name}' has no coordinate or state '{name}'{similar}"
            raise OsimliteError(f"{option}: {message}") from None
        except ValueError:
            raise SettingError(
                f"{option}: the state '{name}' takes a number, not '{text}'"
            ) from None
    return result


def read_source(source: str, parameter: Iterable[str] | None) -> tuple[Model, Path | None]:
    """Read or build the model that a command names.

    Args:
        source: model file, or source of ``osimlite build``.
        parameter: ``NAME=VALUE`` words of ``-p``.

    Returns:
        The model, and the folder of its file; None without a file.

    Raises:
        SettingError: parameters are given for a model file.
        OsimliteError: the source does not exist, or does not accept the parameters.
    """
    from osimlite.errors import SettingError
    from osimlite.io.document.reader import read
    from osimlite.models.source import make_model

    # Other words than files are built-in models, or functions that build one.
    if Path(source).suffix.lower() != ".osim":
        return make_model(source, parse_named_words(parameter, "-p")), None
    if parameter:
        raise SettingError(
            f"'{source}' is a file and has no parameters; -p is for functions that build a model"
        )
    # Meshes and tables are searched beside the file, also if the command runs elsewhere.
    return read(source), Path(source).resolve().parent


def resolve_folders(geometry: Sequence[Path] | None) -> Sequence[Path]:
    """Return the folders of ``--geometry`` after checking that they exist.

    Raises:
        MissingFolderError: a folder does not exist.
    """
    from osimlite.errors import MissingFolderError

    # A misspelt folder would otherwise only show as missing meshes.
    for folder in geometry or ():
        if not folder.is_dir():
            raise MissingFolderError(
                "--geometry names a folder that does not exist", file=str(folder)
            )
    return geometry or ()


def list_mesh_folders(file: Path, geometry: Sequence[Path] | None) -> list[Path]:
    """Return the folders searched for meshes after the model's own: those of ``--geometry``, then of the settings.

    Args:
        file: path of the model file.
        geometry: folders of ``--geometry``; None without that option.

    Raises:
        MissingFolderError: a folder of the command line does not exist.
        OsimliteError: the settings cannot be read.
    """
    from osimlite.lint.settings import load_settings

    # The user's folders come before those of the settings.
    return [*resolve_folders(geometry), *map(Path, load_settings(file.resolve().parent).mesh_paths)]


def check_number_format(numbers: str) -> NumberStyle:
    """Return the value of ``--numbers`` after checking it.

    Raises:
        SettingError: the value is unknown.
    """
    from osimlite.errors import SettingError

    if numbers not in ("shortest", "opensim"):
        raise SettingError(f"--numbers must be 'shortest' or 'opensim', not '{numbers}'")
    # The comparison tells mypy which of the two literals is returned.
    return "opensim" if numbers == "opensim" else "shortest"
