"""The controls of a model's actuators: what its controllers, and the user, make of each.

A control that nothing drives is 0; what several want of one is added up. OpenSim keeps it within no
limits.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from osimlite.base.records import dataclass, replace
from osimlite.errors import UnsupportedError
from osimlite.mechanics.kernels.layout import ITEM, WORK
from osimlite.mechanics.multibody.function_tables import table_of_one
from osimlite.mechanics.multibody.functions import Function
from osimlite.schema.actuators import Actuator
from osimlite.schema.base import Unknown
from osimlite.schema.controller_types import ControlSetController, TrackingController
from osimlite.schema.sets import Controller
from osimlite.simulation.elements.integral import value_of
from osimlite.simulation.elements.registry import CONTROLLERS

if TYPE_CHECKING:
    from osimlite.simulation.elements.builder import ElementBuilder


@dataclass(frozen=True, eq=False)
class Controls:
    """All controls: for each of them the functions of time whose sum it is."""

    # paths of the actuators in the order of the model; of one with several controls with `_0`, `_1`
    # ... behind it, as OpenSim's tools call them.
    names: tuple[str, ...] = ()
    functions: tuple[tuple[Function, ...], ...] = ()  # of each

    def driven(self, more: Mapping[str, Function]) -> Controls:
        """With a function added to some of them, by name."""
        pairs = zip(self.names, self.functions, strict=True)
        return replace(
            self,
            functions=tuple((*own, more[name]) if name in more else own for name, own in pairs),
        )

    def record(self) -> tuple[list[int], list[float], str | Callable[..., None]]:
        """Integers and numbers for the kernel that computes them, and this; in Python if a function has no table."""
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
                    kernel = self._computed
            ends.append(len(tables))
        return [len(ends), *ends, *tables], numbers, kernel

    def _computed(self, s: Any, x: Any, w: Any, y: Any, f: Any, item: int) -> None:
        first, time = s[item + ITEM.RECORD], w[WORK.TIME]
        for number, functions in enumerate(self.functions):
            w[first + number] = sum(value_of(function, time) for function in functions)


NO_CONTROLS = Controls()


class Reflex(NamedTuple):
    """A control in proportion to how fast a muscle lengthens, over its greatest contraction velocity."""

    gain: float


class Drive(NamedTuple):
    """What a controller does to an actuator."""

    actuator: Any  # the component
    # what it adds to a control, or the error that says why that cannot be computed
    signal: Function | Reflex | UnsupportedError
    # of the control among those of the actuator; of the only one if left out
    number: int | None = None


class ModelControls:
    """What the controllers of a model do.

    Args:
        builder: of the model's elements.

    Attributes: controls: the functions of time. reflexes: by the paths of the muscles that have
        one, what reflexes add where they lengthen the fastest.

    Raises:
        ModelError: a controller has no meaning, or a file that it names does not fit the model.
    """

    def __init__(self, builder: ElementBuilder) -> None:
        names: list[str] = []
        self._first: dict[str, int] = {}
        for actuator in builder.components(Actuator):
            path, count = builder.path(actuator), actuator.control_count
            self._first[path] = len(names)
            names += [path] if count == 1 else [f"{path}_{number}" for number in range(count)]
        functions: list[list[Function]] = [[] for _ in names]
        self.reflexes: dict[str, float] = {}
        self._refused: dict[str, UnsupportedError] = {}
        for controller, (actuator, signal, number) in _drives(builder):
            if not isinstance(actuator, Actuator):
                # Of a class that nobody knows, which is refused for that.
                continue
            path = builder.path(actuator)
            if number is None and actuator.control_count > 1:
                # OpenSim 4.6 takes the others from the memory behind the first.
                why = f" driven by '{builder.path(controller)}', which has one control for its {actuator.control_count}"
                signal = builder.unsupported(actuator, why)
            if isinstance(signal, UnsupportedError):
                self._refused[path] = signal
            elif isinstance(signal, Reflex):
                self.reflexes[path] = self.reflexes.get(path, 0.0) + signal.gain
            else:
                functions[self._first[path] + (number or 0)].append(signal)
        self.controls = Controls(tuple(names), tuple(map(tuple, functions)))

    def first_of(self, builder: ElementBuilder, actuator: Any) -> int:
        """Number of the first control of an actuator.

        Raises:
            UnsupportedError: something drives it that cannot be computed.
        """
        path = builder.path(actuator)
        if path in self._refused:
            raise self._refused[path]
        return self._first[path]

    def gain(self, builder: ElementBuilder, actuator: Any) -> float:
        """What reflexes add to the control of a muscle, for how fast it lengthens, s/m."""
        fastest = actuator.optimal_fiber_length * actuator.max_contraction_velocity
        gain = self.reflexes.get(builder.path(actuator), 0.0)
        return gain / fastest if gain else 0.0


def _drives(builder: ElementBuilder) -> Iterator[tuple[Controller, Drive]]:
    """What each enabled controller does.

    `CONTROLLERS` has the function of each class of controllers.
    """
    for controller in builder.components(Controller):
        if isinstance(controller, Unknown):
            continue
        # OpenSim 4.6 enables a ControlSetController that has read its file.
        if not (controller.enabled or isinstance(controller, ControlSetController)):
            continue
        if (drive_by := CONTROLLERS.find(type(controller))) is not None:
            path = builder.path(controller)
            if path not in builder.drives:
                builder.drives[path] = list(drive_by(builder, controller))
            yield from ((controller, drive) for drive in builder.drives[path])
            continue
        why = f" driven by the {type(controller).__name__} '{builder.path(controller)}'"
        if isinstance(controller, TrackingController):
            why += ", whose desired motion is known to its tool only"
        for actuator in named(builder, controller):
            yield controller, Drive(actuator, builder.unsupported(actuator, why))


def named(builder: ElementBuilder, controller: Controller) -> list[Any]:
    """The actuators that a controller names."""
    return [
        builder.target(controller, "socket_actuators", word) for word in controller.socket_actuators
    ]


def actuators_by_name(builder: ElementBuilder) -> dict[str, Actuator]:
    """The first actuator of each name."""
    result: dict[str, Actuator] = {}
    for component in builder.components(Actuator):
        result.setdefault(component.name, component)
    return result
