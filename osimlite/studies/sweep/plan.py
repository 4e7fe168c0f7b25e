"""What is to be run, as something that can be sent to other processes."""

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
from osimlite.studies.sweep.controls import Control, check_nodes, controller_of
from osimlite.studies.sweep.measures import is_expression, measure_name
from osimlite.studies.sweep.variables import Gains, Parameter, Range, Variable, resolve_variables

if TYPE_CHECKING:
    from osimlite.simulation.control_steps import Controller, Gain

Maker = Callable[[Mapping[str, float]], Model]
"""Makes a model from the values of some of its parameters."""

MOST_TRIES = 1_000_000
"""Steps that a run may try: one that hardly moves on must not keep the others waiting."""

REPORT_INTERVAL = 0.01
"""Time between the states that an expression looks at, unless another is asked for, s."""

DEFAULT_MEASURES = ("distance", "largest_force")


@dataclass(frozen=True)
class Stop:
    """A coordinate that ends a run when it falls below a level, or rises above it (rad or m)."""

    coordinate: str
    level: float
    is_below: bool = True

    @property
    def words(self) -> str:
        """Why a run ended."""
        return f"{self.coordinate} {'below' if self.is_below else 'above'} {self.level:g}"


@dataclass(frozen=True)
class Plan(IntegrationOptions):
    """Runs of one model, each with its own values of some numbers."""

    text: str  # the model as .osim
    variables: tuple[Variable, ...]  # what differs
    # names of measures, `module:function`, or functions
    measures: tuple[Any, ...] = DEFAULT_MEASURES
    to: float = 2.0  # how long a run lasts, s
    engine: str = "compiled"  # that computes it, by name
    wrapping: str = OPENSIM  # see `Options`
    stops: tuple[Stop, ...] = ()  # what ends a run before
    # whether the walker is put on the ground with the deeper foot, at rest there, before each run
    is_planted: bool = False
    # contacts of each foot of a walker, as `find_footing` takes them; found by its structure if
    # left out
    feet: tuple[str, ...] | None = None
    # time between the moments that a measure of one's own can look at (s), None for none
    report_interval: float | None = None
    equilibrate: bool = False  # start muscles where fiber and tendon are in equilibrium
    # what is between the nodes of a control: "linear", "steps" or "cubic"
    interpolation: str = "linear"
    skip_unsupported: bool = False  # leave out forces that cannot be computed
    make: Maker | None = None  # makes the model from parameters, where some of them are varied
    folder: str | None = None  # of the model's file, where the files are that it names
    controller: Controller | None = None  # what drives actuators by what it feels

    def model(self) -> Model:
        """The model, with none of the variables set."""
        return read_text(self.text.encode())

    @property
    def interval(self) -> float | None:
        """Time between the states that are kept, s: what was asked for, or else what an expression needs."""
        return self.report_interval or (
            REPORT_INTERVAL if any(map(is_expression, self.measures)) else None
        )

    def pack(self) -> bytes:
        """The plan for other processes.

        Raises:
            SettingError: a function cannot be named there.
        """
        try:
            return zlib.compress(pickle.dumps(self))
        except (pickle.PicklingError, AttributeError, TypeError):
            raise SettingError(
                "a function of the sweep cannot be sent to other processes; put it into a module and name it "
                "module:function"
            ) from None

    @staticmethod
    def unpack(data: bytes) -> Plan:
        """The plan that was packed; only from those whom you would let run programs here."""
        return pickle.loads(zlib.decompress(data))

    def columns(self, *first: str) -> dict[str, str]:
        """Columns of a table of the runs, after some of whole numbers, and what they hold.

        Raises:
            SettingError: two of them have one name.
        """
        result = dict.fromkeys(first, "int64")
        rest = [(item.name, "float64") for item in self.variables]
        rest += [("status", "string"), ("reason", "string"), ("time", "float64")]
        rest += [(measure_name(spec), "float64") for spec in dict.fromkeys(self.measures)]
        for name, kind in rest:
            if name in result:
                raise SettingError(
                    f"the results would have two columns '{name}'; call a coordinate by its path, a function otherwise"
                )
            result[name] = kind
        return result

    def settings(self) -> dict[str, Any]:
        """All that the results depend on."""
        import hashlib

        from osimlite import __version__

        return {
            "osimlite": __version__,
            "model": hashlib.sha256(self.text.encode()).hexdigest(),
            "vary": [item.settings() for item in self.variables],
            "measures": [measure_name(item) for item in self.measures],
            "to": self.to,
            "engine": self.engine,
            "stops": [item.words for item in self.stops],
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
    **choices: Any,
) -> Plan:
    """Make a plan.

    Args:
        source: the model, or what makes it from the parameters that it is given.
        vary: ranges by name, see :mod:`osimlite.studies.sweep.variables`; if nothing differs by
            them, all other parameters of a controller do, between their bounds.
        parameters: that `source` takes, with their defaults.
        below: levels that end a run when a coordinate falls below them: rad, m, or a text such as
            "30deg".
        above: levels that end a run when a coordinate rises above them, likewise.
        controls: that every run has: by the name or path of an actuator a number, or ``(times,
            values)``.
        choices: further attributes of :class:`Plan`.

    Raises:
        SettingError: a name means nothing, or a number has no meaning.
        ModelError: the model is no mechanism.
    """
    if controls:
        maker = partial(_copy_model, to_text(source)) if isinstance(source, Model) else source
        source = partial(_list_driven_actuators, maker, controls)
    model = source if isinstance(source, Model) else source({})
    mechanism = build_mechanism(model)
    gains: list[Gain] = []
    if (controller := choices.get("controller")) is not None:
        own = {
            name: choices[name]
            for name in ("skip_unsupported", "wrapping", "folder")
            if choices.get(name)
        }
        gains = controller.gains(model, Simulation(model, **own).engine)
        if not (vary or gains):
            raise SettingError(
                "say what to vary; the controller has no parameters, which are written as ~2<0,20>"
            )
    result = resolve_variables(vary, model, mechanism, parameters, gains)
    if all(item.is_fixed for item in result):
        held = {
            name for item in result if isinstance(item.target, Gains) for name in item.target.parts
        }
        rest = {gain.name: _read_bounds(gain) for gain in gains if gain.name not in held}
        result = resolve_variables({**vary, **rest}, model, mechanism, parameters, gains)
    for item in result:
        warn_of_unit(item.doubt)
    needs_maker = any(isinstance(item.target, Parameter) for item in result)
    make = source if needs_maker and not isinstance(source, Model) else None
    made = Plan(to_text(model), result, make=make)
    if not any(
        info.motion_type == "translational" and not info.locked for info in mechanism.coordinates
    ):
        # Only who asks for the distance by name is told that the model has none.
        made = replace(made, measures=tuple(name for name in made.measures if name != "distance"))
    made = replace(made, **{name: value for name, value in choices.items() if value is not None})
    for name, value in (
        ("to", made.to),
        ("accuracy", made.accuracy),
        ("report_interval", made.report_interval),
    ):
        if value is not None and not (isfinite(value) and value > 0.0):
            raise SettingError(f"'{name}' is a positive number, not {value:g}")
    if made.accuracy >= 1.0:
        raise SettingError(f"'accuracy' is less than 1, not {made.accuracy:g}")
    made.check_integration()
    targets = {place: item.target for place, item in enumerate(result)}
    nodes = {place: target for place, target in targets.items() if isinstance(target, Control)}
    check_nodes(nodes, made.interpolation, made.to)
    named = (*_make_stops(mechanism, below, True), *_make_stops(mechanism, above, False))
    given = (
        _make_stop(mechanism, stop.coordinate, stop.level, stop.is_below) for stop in made.stops
    )
    return replace(made, engine=engine_name(made.engine), stops=(*given, *named))


def _read_bounds(gain: Gain) -> tuple[float, float]:
    if not (isfinite(gain.low) and isfinite(gain.high)):
        raise SettingError(
            f"the parameter '{gain.name}' has no bounds, as in 1~0.1<0,2>; vary it as in {gain.name}=0:2"
        )
    return gain.low, gain.high


def _copy_model(text: str, parameters: Mapping[str, float]) -> Model:
    return read_text(text.encode())


def _list_driven_actuators(
    source: Maker, controls: Mapping[str, Any], parameters: Mapping[str, float]
) -> Model:
    model = source(parameters)
    model.add(controller_of(model, controls))
    return model


def _make_stops(
    mechanism: Mechanism, levels: Mapping[str, float | str], is_below: bool
) -> list[Stop]:
    return [_make_stop(mechanism, name, level, is_below) for name, level in levels.items()]


def _make_stop(mechanism: Mechanism, name: str, given: float | str, is_below: bool) -> Stop:
    infos = {key: info for info in mechanism.coordinates for key in (info.name, info.path)}
    if name not in infos:
        raise SettingError(f"there is no coordinate '{name}'{suggest_name(name, infos)}")
    if infos[name].locked:
        raise SettingError(
            f"the coordinate '{name}' is locked, so that it stops nothing; name one that moves"
        )
    level = convert_value(mechanism, name, given)
    if not isfinite(level):
        raise SettingError(f"the level of '{name}' that stops a run is a number, not {given}")
    warn_of_unit(describe_suspect_value(infos[name], name, given))
    return Stop(name, level, is_below)
