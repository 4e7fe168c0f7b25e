"""Options and plans that `sweep`, `optimize` and `find-gait` share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from osimlite.cli._command import Option
from osimlite.cli._options import parse_named_words, read_source

if TYPE_CHECKING:
    from osimlite.studies.sweep.plan import Plan

Vary = Annotated[
    list[str] | None,
    Option(
        "--vary",
        metavar="NAME=RANGE",
        help="NAME: a coordinate, COORDINATE/speed, MUSCLE/control, COMPONENT/PROPERTY, or a parameter of the model "
        "function or controller. Without --vary, all parameters of the controller vary. RANGE: "
        "LOW:HIGH, LOW:HIGH:log, or LOW:HIGH:COUNT in a sweep. Wildcards, factors, controls over "
        "time: docs/sweeps.md.",
        show_default=False,
    ),
]
ReportInterval = Annotated[
    float | None,
    Option(
        metavar="SECONDS",
        help="Time step of the motion for measures (expressions, module:function).",
        show_default="0.01 for expressions",
    ),
]
Interpolation = Annotated[
    str, Option(help="Interpolation between nodes of a control: 'linear', 'steps' or 'cubic'.")
]
Below = Annotated[
    list[str] | None,
    Option(
        "--stop-below",
        metavar="NAME=VALUE",
        help="End a run when a coordinate falls below this value.",
        show_default=False,
    ),
]
Above = Annotated[
    list[str] | None,
    Option(
        "--stop-above",
        metavar="NAME=VALUE",
        help="End a run when a coordinate rises above this value.",
        show_default=False,
    ),
]
Planted = Annotated[
    bool,
    Option(
        "--planted",
        help="Start with the lower foot at rest on the ground.",
    ),
]
Workers = Annotated[
    int | None,
    Option(
        min=1,
        metavar="N",
        help="Threads or processes.",
        show_default="one per core",
    ),
]
Cluster = Annotated[
    str | None,
    Option(metavar="ADDRESS", help="Use the Dask cluster of this scheduler.", show_default=False),
]


SIMULATION_PARAMETERS = (
    "to",
    "engine",
    "stop_below",
    "stop_above",
    "planted",
    "foot",
    "report_interval",
    "parameter",
    "controls",
    "controller",
    "par",
    "interpolation",
    "accuracy",
    "integrator",
    "equilibrate",
    "wrapping",
    "skip_unsupported",
)
"""Parameters of the simulations, which the help lists as a group."""

SWEEP_OPTIONS = "wrapping", "equilibrate", "skip_unsupported"
"""Simulation options that sweeps accept besides those of integration."""


def make_plan(
    source: str,
    vary: Sequence[str] | None,
    parameter: Sequence[str] | None,
    below: Sequence[str] | None,
    above: Sequence[str] | None,
    controls: Sequence[str] | None = None,
    **settings: Any,
) -> Plan:
    """Return the plan of a sweep that command-line options describe.

    Args:
        source: model file, or source of ``osimlite build``.
        vary: ranges of the variables.
        parameter: fixed parameters of the model function.
        below: coordinates and values below which a run ends.
        above: coordinates and values above which a run ends.
        controls: controls of actuators.
        settings: further keyword arguments of :func:`osimlite.studies.sweep.plan.plan`.

    Raises:
        SettingError: nothing varies, or a number without a unit is probably not in rad.
        OsimliteError: another option is invalid.
    """
    import warnings

    from osimlite.errors import SettingError, UnitWarning
    from osimlite.simulation.run_controls import parse_controls
    from osimlite.studies.sweep.variables import parse_ranges

    ranges = parse_ranges(vary or [])
    # A controller has parameters that vary by default.
    if not ranges and settings.get("controller") is None:
        raise SettingError("name the quantities to vary, for example --vary RHip_rz=0.2:0.6")
    levels = {
        "below": _parse_levels(below, "--stop-below"),
        "above": _parse_levels(above, "--stop-above"),
    }
    # A suspicious unit is a warning in the library and an error here, where a run may take hours.
    with warnings.catch_warnings():
        warnings.simplefilter("error", UnitWarning)
        try:
            return _make_plan(
                source,
                ranges,
                parameter,
                controls=parse_controls(controls or []),
                **levels,
                **settings,
            )
        except UnitWarning as warning:
            raise SettingError(f"{warning} (if not, write rad after the number)") from None


def _make_plan(
    source: str, ranges: Mapping[str, Any], parameter: Sequence[str] | None, **settings: Any
) -> Plan:
    from functools import partial
    from inspect import Parameter

    from osimlite.errors import SettingError
    from osimlite.models.source import list_parameters
    from osimlite.studies.sweep.plan import plan

    # A model file has no parameters; a function may be called with others for each run.
    if Path(source).suffix.lower() == ".osim":
        model, folder = read_source(source, parameter)
        return plan(model, ranges, folder=str(folder), **settings)
    set_values = parse_named_words(parameter, "-p")
    # A value for a parameter that also varies would be overwritten in each run.
    doubly_set = [name for name in ranges if name in set_values]
    if doubly_set:
        raise SettingError(
            f"the parameter '{doubly_set[0]}' is set by -p and varied by --vary; leave out one of the two"
        )
    varied_defaults = {
        name: default for name, default in list_parameters(source).items() if name not in set_values
    }
    # The nominal model needs a value for each parameter without a default; take the lower bound of its
    # range.
    nominal_values = {
        name: str(ranges[name]).partition(":")[0]
        for name in varied_defaults
        if varied_defaults[name] is Parameter.empty and name in ranges
    }
    # A partial function of this module can be sent to other processes.
    return plan(
        partial(_make_model, source, {**nominal_values, **set_values}),
        ranges,
        parameters=varied_defaults,
        **settings,
    )


def _make_model(source: str, set_values: Mapping[str, str], parameters: Mapping[str, float]) -> Any:
    from osimlite.models.source import make_model

    # Functions may require int parameters, so whole numbers are written without a decimal point.
    texts = {
        name: repr(int(value) if value.is_integer() else value)
        for name, value in parameters.items()
    }
    return make_model(source, {**set_values, **texts})


def _parse_levels(assignments: Sequence[str] | None, option: str) -> dict[str, str]:
    from osimlite.base.quantity import parse_quantity
    from osimlite.errors import SettingError

    form = "COORDINATE=VALUE with a number such as 0.5 or 30deg"
    result = parse_named_words(assignments, option, form)
    for text in result.values():
        if parse_quantity(text) is None:
            raise SettingError(f"{option} takes {form}, got '{text}'")
    return result
