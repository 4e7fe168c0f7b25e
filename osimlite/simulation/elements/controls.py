"""Controls of a model's actuators: the sum of what its controllers and the user set.

A control that nothing drives is 0; several drives of one control are added. As in OpenSim, controls
have no limits.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import dataclass, replace
from osimlite.errors import ModelError, UnsupportedError
from osimlite.mechanics.kernels.layout import ITEM, WORK
from osimlite.mechanics.multibody.function_tables import table_of_one
from osimlite.mechanics.multibody.functions import SmoothFunction
from osimlite.schema.base import Unknown
from osimlite.schema.resolution import is_a
from osimlite.schema.sets import Controller
from osimlite.simulation.elements.integral import evaluate_function
from osimlite.simulation.elements.registry import CONTROLLERS

if TYPE_CHECKING:
    from osimlite.schema.forces import Actuator
    from osimlite.simulation.elements.builder import ElementBuilder


@dataclass(frozen=True, eq=False)
class Controls:
    """All controls of a model: for each of them the functions of time whose sum it is.

    Attributes:
        names: paths of the actuators in the order of the model; as in OpenSim's tools, an actuator
            with several controls has suffixes `_0`, `_1` ...
        functions: terms of each control's sum.
    """

    names: tuple[str, ...] = ()
    functions: tuple[tuple[SmoothFunction, ...], ...] = ()

    def add_functions(self, functions: Mapping[str, SmoothFunction]) -> Controls:
        """Return these controls with one more term for some of them.

        Args:
            functions: functions of time by the names of the controls.
        """
        pairs = zip(self.names, self.functions, strict=True)
        return replace(
            self,
            functions=tuple(
                (*terms, functions[name]) if name in functions else terms for name, terms in pairs
            ),
        )

    def make_record(self) -> tuple[list[int], list[float], str | Callable[..., None]]:
        """Return the kernel of the controls and its data.

        Returns:
            Integers and numbers of the record, and the name of the kernel, or a Python function if
            one of the functions of time has no table.
        """
        ends: list[int] = []
        tables: list[int] = []
        numbers: list[float] = []
        kernel: str | Callable[..., None] = "set_controls"
        for name, functions in zip(self.names, self.functions, strict=True):
            for function in functions:
                tables.append(len(numbers))
                try:
                    numbers += table_of_one(function, f"the control of '{name}'")
                except UnsupportedError:
                    kernel = self._compute_in_python
            # The sum of several functions is the control: ends tell which tables belong to it.
            ends.append(len(tables))
        return [len(ends), *ends, *tables], numbers, kernel

    def _compute_in_python(self, s: Any, x: Any, w: Any, y: Any, f: Any, item: int) -> None:
        first = s[item + ITEM.RECORD]
        time = w[WORK.TIME]
        for number, functions in enumerate(self.functions):
            w[first + number] = sum(evaluate_function(function, time) for function in functions)


NO_CONTROLS = Controls()
"""Controls of a model without actuators."""


class Reflex(NamedTuple):
    """Control in proportion to a muscle's lengthening speed.

    Attributes:
        gain: control at the maximum contraction velocity of the muscle.
    """

    gain: float


class Drive(NamedTuple):
    """Contribution of a controller to one control.

    Attributes:
        actuator: the component.
        signal: term of a control, or the error that says why it cannot be computed.
        number: index among the controls of the actuator; None for an actuator with one control.
    """

    actuator: Any
    signal: SmoothFunction | Reflex | UnsupportedError
    number: int | None = None


class ModelControls:
    """Controls that the controllers of a model set.

    Args:
        builder: builder of the model's elements.

    Attributes:
        controls: functions of time of each control.
        reflexes: control at the maximum lengthening speed of each muscle with a reflex, by path.

    Raises:
        ModelError: a controller has no meaning, or its file does not fit the model.
    """

    def __init__(self, builder: ElementBuilder) -> None:
        names: list[str] = []
        self._first: dict[str, int] = {}
        for actuator in builder.list_actuators():
            path = builder.path(actuator)
            count = actuator.control_count
            self._first[path] = len(names)
            names += [path] if count == 1 else [f"{path}_{number}" for number in range(count)]
        functions: list[list[SmoothFunction]] = [[] for _ in names]
        self.reflexes: dict[str, float] = {}
        self._refused: dict[str, UnsupportedError] = {}
        for controller, (actuator, signal, number) in _iterate_drives(builder):
            if not is_a(actuator, "Actuator"):
                # An actuator of an unknown class is reported as an unsupported force.
                continue
            path = builder.path(actuator)
            if number is None and actuator.control_count > 1:
                # OpenSim 4.6 reads the other controls from the memory behind the first.
                why = f" driven by '{builder.path(controller)}', which sets only one of its {actuator.control_count} controls"
                signal = builder.make_unsupported_error(actuator, why)
            if isinstance(signal, UnsupportedError):
                # The error is raised only if the actuator is computed: one that is off needs no
                # control.
                self._refused[path] = signal
            elif isinstance(signal, Reflex):
                self.reflexes[path] = self.reflexes.get(path, 0.0) + signal.gain
            else:
                functions[self._first[path] + (number or 0)].append(signal)
        self.controls = Controls(tuple(names), tuple(map(tuple, functions)))

    def find_first(self, builder: ElementBuilder, actuator: Any) -> int:
        """Return the index of the first control of an actuator.

        Args:
            builder: builder of the model's elements.
            actuator: the component.

        Raises:
            UnsupportedError: osimlite cannot compute one of its drives.
        """
        path = builder.path(actuator)
        if path in self._refused:
            raise self._refused[path]
        return self._first[path]

    def compute_gain(self, builder: ElementBuilder, actuator: Any) -> float:
        """Return the gain of the stretch reflexes of a muscle.

        Args:
            builder: builder of the model's elements.
            actuator: the muscle.

        Returns:
            Control per lengthening speed of the path, s/m.
        """
        fastest = actuator.optimal_fiber_length * actuator.max_contraction_velocity
        # OpenSim's reflex multiplies the speed of the path relative to the greatest speed of the
        # fibers.
        gain = self.reflexes.get(builder.path(actuator), 0.0)
        return gain / fastest if gain else 0.0


def _iterate_drives(builder: ElementBuilder) -> Iterator[tuple[Controller, Drive]]:
    """Yield the drives of each enabled controller, with the controller.

    `CONTROLLERS` has the function of each class of controllers.

    Raises:
        ModelError: an enabled CorrectionController needs the states of a tool, which a model does
            not have.
    """
    for controller in builder.find_components(Controller):
        if isinstance(controller, Unknown):
            continue
        # OpenSim 4.6 enables a ControlSetController that has read its file.
        if not (controller.enabled or is_a(controller, "ControlSetController")):
            continue
        if (drive_by := CONTROLLERS.find(type(controller))) is not None:
            path = builder.path(controller)
            if path not in builder.drives:
                builder.drives[path] = list(drive_by(builder, controller))
            yield from ((controller, drive) for drive in builder.drives[path])
            continue
        if is_a(controller, "CorrectionController"):
            raise ModelError(
                f"the CorrectionController '{builder.path(controller)}' follows the states of a "
                "ForwardTool, which a model alone does not have: OpenSim crashes; disable it"
            )
        why = f" driven by the {type(controller).__name__} '{builder.path(controller)}'"
        if is_a(controller, "TrackingController"):
            why += ", whose desired motion is known to its tool only"
        for actuator in find_actuators(builder, controller):
            yield controller, Drive(actuator, builder.make_unsupported_error(actuator, why))


def find_actuators(builder: ElementBuilder, controller: Controller) -> list[Any]:
    """Return the actuators that a controller names."""
    return [
        builder.resolve_target(controller, "socket_actuators", word)
        for word in controller.socket_actuators
    ]


def map_actuators(builder: ElementBuilder) -> dict[str, Actuator]:
    """Return the first actuator of each name.

    Returns:
        Actuators by name.
    """
    result: dict[str, Actuator] = {}
    for component in builder.list_actuators():
        result.setdefault(component.name, component)
    return result
