"""Plan of a sweep or a search, which can be sent to other processes."""

from __future__ import annotations

import pickle
import zlib
from collections.abc import Callable, Mapping
from functools import partial
from math import isfinite
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from osimlite.base.quantity import warn_of_unit
from osimlite.base.records import dataclass, replace
from osimlite.base.text import suggest_name
from osimlite.errors import SettingError
from osimlite.io.document.printer import to_text
from osimlite.io.document.reader import read_text
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.schema.model import Model
from osimlite.simulation.elements.builder import OPENSIM
from osimlite.simulation.engines import engine_name
from osimlite.simulation.initial_state import convert_value, describe_suspect_value
from osimlite.simulation.options import IntegrationOptions
from osimlite.simulation.run import Simulation
from osimlite.studies.sweep.controls import Control, check_nodes, make_controller
from osimlite.studies.sweep.measures import get_measure_name, is_expression
from osimlite.studies.sweep.variables import (
    FunctionParameter,
    Gains,
    Range,
    Variable,
    resolve_variables,
)

if TYPE_CHECKING:
    from osimlite.simulation.control_steps import Controller, Gain

Maker = Callable[[Mapping[str, float]], Model]
"""Function that makes a model from the values of some of its parameters."""

MAX_INTEGRATOR_STEPS = 1_000_000
"""Most steps of the integrator in a run, so that a run which hardly advances does not delay the
others.
"""

REPORT_INTERVAL = 0.01
"""Default interval (s) between the states from which expressions are computed."""

DEFAULT_MEASURES = ("distance", "largest_force")
"""Measures of a plan that names none."""


@dataclass(frozen=True)
class Stop:
    """Level of a coordinate that ends a run.

    Attributes:
        coordinate: name or path of the coordinate.
        level: level (rad or m).
        is_below: whether the run ends when the coordinate falls below the level, else when it rises
            above.
    """

    coordinate: str
    level: float
    is_below: bool = True

    @property
    def words(self) -> str:
        """Text for why a run ended."""
        return f"{self.coordinate} {'below' if self.is_below else 'above'} {self.level:g}"


@dataclass(frozen=True)
class Plan(IntegrationOptions):
    """Runs of one model, each with its own values of the variables.

    Options of the integration, such as `accuracy` and `integrator`, are attributes too.

    Attributes:
        text: model as XML text (.osim).
        variables: variables that differ between runs.
        measures: names of measures, `module:function`, or functions.
        to: duration of a run (s).
        engine: name of the engine.
        wrapping: method of wrapping, see `Options`.
        stops: levels that end a run early.
        is_planted: whether each run starts with the deeper foot of the walker at rest on the
            ground.
        feet: contacts of each foot, see `find_footing`; found from the structure by default.
        report_interval: interval (s) at which states are saved for functions of the user; None for
            none.
        equilibrate: whether muscles start in equilibrium of fiber and tendon.
        interpolation: interpolation between the nodes of a control: "linear", "steps" or "cubic".
        skip_unsupported: whether to leave out forces that are not supported.
        make: function that makes the model, if its parameters vary.
        folder: folder of the model file, to which its files are relative.
        controller: feedback controller of all runs.
    """

    text: str
    variables: tuple[Variable, ...]
    measures: tuple[Any, ...] = DEFAULT_MEASURES
    to: float = 2.0
    engine: str = "compiled"
    wrapping: str = OPENSIM
    stops: tuple[Stop, ...] = ()
    is_planted: bool = False
    feet: tuple[str, ...] | None = None
    report_interval: float | None = None
    equilibrate: bool = False
    interpolation: str = "linear"
    skip_unsupported: bool = False
    make: Maker | None = None
    folder: str | None = None
    controller: Controller | None = None

    def model(self) -> Model:
        """Return the model, with none of the variables set."""
        return read_text(self.text.encode())

    @property
    def interval(self) -> float | None:
        """Interval (s) at which states are saved, as requested or for expressions; None for none."""
        return self.report_interval or (
            REPORT_INTERVAL if any(map(is_expression, self.measures)) else None
        )

    def pack(self) -> bytes:
        """Return the plan as bytes for other processes.

        Raises:
            SettingError: a function of the plan cannot be pickled.
        """
        try:
            # A model is a long XML text, which each process receives.
            return zlib.compress(pickle.dumps(self))
        # Lambdas and local functions raise one of these, depending on the version of Python.
        except (pickle.PicklingError, AttributeError, TypeError):
            raise SettingError(
                "a function of the sweep cannot be sent to other processes; put it into a module, and pass it as "
                "module:function"
            ) from None

    @staticmethod
    def unpack(data: bytes) -> Plan:
        """Return a packed plan.

        Unpickling runs code, so that the bytes must come from a trusted program.
        """
        return pickle.loads(zlib.decompress(data))

    def columns(self, *integer_names: str) -> dict[str, str]:
        """Return the columns of the table of results.

        Args:
            integer_names: names of columns of whole numbers that come first.

        Returns:
            Type of each column by name: "int64", "float64" or "string".

        Raises:
            SettingError: two columns have the same name.
        """
        result = dict.fromkeys(integer_names, "int64")
        other_columns = [(variable.name, "float64") for variable in self.variables]
        other_columns += [("status", "string"), ("reason", "string"), ("time", "float64")]
        other_columns += [
            (get_measure_name(spec), "float64") for spec in dict.fromkeys(self.measures)
        ]
        for name, column_type in other_columns:
            if name in result:
                raise SettingError(
                    f"the results would have two columns '{name}'; name a coordinate by its path, or rename a function"
                )
            result[name] = column_type
        return result

    def settings(self) -> dict[str, Any]:
        """Return all settings on which the results depend, as data for JSON.

        Returns:
            Value of each setting, by name; the model is represented by its digest.
        """
        import hashlib

        from osimlite import __version__

        return {
            "osimlite": __version__,
            "model": hashlib.sha256(self.text.encode()).hexdigest(),
            "vary": [setting.settings() for setting in self.variables],
            "measures": [get_measure_name(setting) for setting in self.measures],
            "to": self.to,
            "engine": self.engine,
            "stops": [setting.words for setting in self.stops],
            "planted": self.is_planted,
            "feet": None if self.feet is None else list(self.feet),
            "report_interval": self.report_interval,
            "equilibrate": self.equilibrate,
            "interpolation": self.interpolation,
            **self.summarize_choices(),
            "wrapping": self.wrapping,
            "skip_unsupported": self.skip_unsupported,
            **({} if self.controller is None else {"controller": self.controller.digest}),
        }


def plan(
    source: Model | Maker,
    vary: Mapping[str, Range],
    *,
    parameters: Mapping[str, Any] = MappingProxyType({}),
    below: Mapping[str, float | str] = MappingProxyType({}),
    above: Mapping[str, float | str] = MappingProxyType({}),
    controls: Mapping[str, Any] = MappingProxyType({}),
    **options: Any,
) -> Plan:
    """Return a plan of runs.

    Args:
        source: model, or a function that makes it from parameters.
        vary: ranges by name, see :mod:`osimlite.studies.sweep.variables`. If none of them varies
            anything, all other parameters of the controller vary within their bounds.
        parameters: parameters of `source` with their defaults.
        below: levels that end a run when a coordinate falls below them: rad, m, or text such as
            "30deg".
        above: levels that end a run when a coordinate rises above them.
        controls: controls of all runs, by the name or path of an actuator: a number, or `(times,
            values)`.
        options: further attributes of :class:`Plan`.

    Raises:
        SettingError: a name is unknown, or a number is out of bounds.
        ModelError: the model is not a valid mechanism.
    """
    # The wrapper adds the controller also to models that a function makes anew.
    if controls:
        make_model = partial(_parse_model, to_text(source)) if isinstance(source, Model) else source
        source = partial(_make_controlled_model, make_model, controls)
    model = source if isinstance(source, Model) else source({})
    mechanism = build_mechanism(model)
    gains: list[Gain] = []
    if (controller := options.get("controller")) is not None:
        simulation_options = {
            name: options[name]
            for name in ("skip_unsupported", "wrapping", "folder")
            if options.get(name)
        }
        gains = controller.gains(model, Simulation(model, **simulation_options).engine)
        if not (vary or gains):
            raise SettingError(
                "there is nothing to vary, because the controller has no parameters (written as ~2<0,20>); "
                "name what to vary with --vary (vary=)"
            )
    result = resolve_variables(vary, model, mechanism, parameters, gains)
    # Nothing varies by name: all other parameters of the controller do.
    if all(variable.is_fixed for variable in result):
        varied_gains = {
            name
            for variable in result
            if isinstance(variable.target, Gains)
            for name in variable.target.parts
        }
        other_gains = {
            gain.name: _read_bounds(gain) for gain in gains if gain.name not in varied_gains
        }
        result = resolve_variables({**vary, **other_gains}, model, mechanism, parameters, gains)
    for variable in result:
        warn_of_unit(variable.warning)
    # The function is pickled only if needed: those of scripts often cannot be.
    needs_maker = any(isinstance(variable.target, FunctionParameter) for variable in result)
    make_function = source if needs_maker and not isinstance(source, Model) else None
    made_plan = Plan(to_text(model), result, make=make_function)
    if not any(
        info.motion_type == "translational" and not info.locked for info in mechanism.coordinates
    ):
        # The default measures leave out the distance if the model has none; a selected one is an error.
        made_plan = replace(
            made_plan, measures=tuple(name for name in made_plan.measures if name != "distance")
        )
    made_plan = replace(
        made_plan, **{name: value for name, value in options.items() if value is not None}
    )
    for name, value in (
        ("to", made_plan.to),
        ("accuracy", made_plan.accuracy),
        ("report_interval", made_plan.report_interval),
    ):
        if value is not None and not (isfinite(value) and value > 0.0):
            raise SettingError(f"'{name}' must be a positive number, not {value:g}")
    # The accuracy is a relative error.
    if made_plan.accuracy >= 1.0:
        raise SettingError(f"'accuracy' must be less than 1, not {made_plan.accuracy:g}")
    made_plan.check_integration()
    targets = {index: variable.target for index, variable in enumerate(result)}
    nodes = {index: target for index, target in targets.items() if isinstance(target, Control)}
    check_nodes(nodes, made_plan.interpolation, made_plan.to)
    stops_by_name = (*_make_stops(mechanism, below, True), *_make_stops(mechanism, above, False))
    prescribed = (
        _make_stop(mechanism, stop.coordinate, stop.level, stop.is_below)
        for stop in made_plan.stops
    )
    return replace(
        made_plan, engine=engine_name(made_plan.engine), stops=(*prescribed, *stops_by_name)
    )


def _read_bounds(gain: Gain) -> tuple[float, float]:
    """Return the bounds of a parameter of the controller as a range.

    Raises:
        SettingError: a bound is not finite.
    """
    if not (isfinite(gain.low) and isfinite(gain.high)):
        raise SettingError(
            f"the parameter '{gain.name}' has no bounds, such as <0,2> in 1~0.1<0,2>; give its range, for "
            f"example {gain.name}=0:2"
        )
    return gain.low, gain.high


def _parse_model(text: str, parameters: Mapping[str, float]) -> Model:
    """Return the model of a text; a partial application of it can be pickled, a lambda cannot."""
    return read_text(text.encode())


def _make_controlled_model(
    source: Maker, controls: Mapping[str, Any], parameters: Mapping[str, float]
) -> Model:
    """Return the model of a function with a controller for prescribed controls added."""
    model = source(parameters)
    model.add(make_controller(model, controls))
    return model


def _make_stops(
    mechanism: Mechanism, levels: Mapping[str, float | str], is_below: bool
) -> list[Stop]:
    """Return the stops for levels by the names of coordinates."""
    return [_make_stop(mechanism, name, level, is_below) for name, level in levels.items()]


def _make_stop(mechanism: Mechanism, name: str, level_text: float | str, is_below: bool) -> Stop:
    """Return the stop at a level (rad, m, or text with a unit) of a coordinate that moves.

    Raises:
        SettingError: the coordinate does not exist or is locked, or the level is not a finite
            number.
    """
    infos = {key: info for info in mechanism.coordinates for key in (info.name, info.path)}
    if name not in infos:
        raise SettingError(f"there is no coordinate '{name}'{suggest_name(name, infos)}")
    # A stop at a coordinate that does not move can only be a mistake.
    if infos[name].locked:
        raise SettingError(
            f"the coordinate '{name}' is locked, so it cannot stop a run; name a coordinate that moves"
        )
    level = convert_value(mechanism, name, level_text)
    if not isfinite(level):
        raise SettingError(
            f"the value of '{name}' that stops a run must be a number, not {level_text}"
        )
    warn_of_unit(describe_suspect_value(infos[name], name, level_text))
    return Stop(name, level, is_below)
