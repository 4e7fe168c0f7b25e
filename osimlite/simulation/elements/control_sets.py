"""Control curves: the lines and steps of OpenSim's ControlSet."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import inf, nextafter
from pathlib import Path

import numpy as np

from osimlite.base.records import dataclass
from osimlite.base.text import suggest_name
from osimlite.errors import ModelError
from osimlite.io.document.cache import read_object
from osimlite.io.tables.storage import beside
from osimlite.mechanics.multibody.functions import Constant, Function, PiecewiseConstant
from osimlite.mechanics.multibody.smoothing_spline import PiecewisePolynomial
from osimlite.schema.control_sets import (
    Control,
    ControlConstant,
    ControlLinear,
    ControlLinearNode,
    ControlSet,
)
from osimlite.schema.controller_types import ControlSetController
from osimlite.simulation.elements.builder import ElementBuilder
from osimlite.simulation.elements.control_tables import read_controls
from osimlite.simulation.elements.controls import Drive, actuators_by_name, named
from osimlite.simulation.elements.registry import register_controller


@dataclass(frozen=True)
class ControlCurves:
    """The controls of a file.

    Attributes: curves: functions of time by the names of the controls; of several controls of a
        name the first. of_model: the names of those that the model is to have.
    """

    curves: Mapping[str, Function]
    of_model: Sequence[str]

    @classmethod
    def read(cls, path: Path) -> ControlCurves:
        """From a document, or from a table (``.sto``), which is one of lines between its rows.

        Raises:
            DocumentError: it holds something else.
            ModelError: a control has no nodes, or their times go back.
        """
        curves: dict[str, Function] = {}
        if ".sto" in path.name:
            table = read_controls(path)
            for label, values in zip(table.columns, table.rows.T.tolist(), strict=True):
                curves.setdefault(label, _lines(table.times.tolist(), values, goes_on=True))
            return cls(curves, table.columns)
        controls = read_object(path, ControlSet).objects
        for control in controls:
            curves.setdefault(control.name, _curve(control, str(path)))
        return cls(curves, [control.name for control in controls if control.is_model_control])

    @property
    def actuators(self) -> list[str]:
        """Names of the actuators that the model is to have."""
        return [name.removesuffix(EXCITATION) for name in self.of_model]

    def of(self, actuator: str) -> Function | None:
        """The control that is called after an actuator, or else with ``.excitation`` behind its name."""
        return self.curves.get(actuator) or self.curves.get(actuator + EXCITATION)


EXCITATION = ".excitation"


def _curve(control: Control, file: str) -> Function:
    if isinstance(control, ControlConstant):
        return Constant(control.value)
    assert isinstance(control, ControlLinear)
    if not control.x_nodes:
        raise ModelError(f"the control '{control.name}' has no x_nodes; give it some", file=file)
    return node_curve(control, control.x_nodes, file)


def node_curve(
    control: ControlLinear, nodes: Sequence[ControlLinearNode], file: str | None = None
) -> Function:
    """Lines or steps through nodes of a control, such as its x_nodes.

    Raises:
        ModelError: their times go back.
    """
    times, values = [node.t for node in nodes], [node.value for node in nodes]
    if not np.isfinite([*times, *values]).all() or (np.diff(times) < 0.0).any():
        raise ModelError(
            f"the x_nodes of the control '{control.name}' go back in time, or have no numbers; sort them",
            file=file,
        )
    if control.use_steps:
        # A value holds up to its own time, that included.
        return PiecewiseConstant(
            (times[0], *(nextafter(time, inf) for time in times[:-1])), tuple(values)
        )
    return _lines(times, values, goes_on=control.extrapolate)


def _lines(times: Sequence[float], values: Sequence[float], *, goes_on: bool) -> Function:
    """Straight lines between points; outside they go on, or the end values hold. Points at one time make a jump."""
    if len(times) == 1:
        return Constant(values[0])
    widths = np.diff(times)
    slopes = np.where(widths > 0.0, np.diff(values) / np.where(widths > 0.0, widths, 1.0), 0.0)
    lines = np.column_stack((values[:-1], slopes))
    if goes_on:
        return PiecewisePolynomial(np.array(times[:-1]), lines)
    ends = np.array(((values[0], 0.0), (values[-1], 0.0)))
    return PiecewisePolynomial(np.array((times[0], *times)), np.vstack((ends[:1], lines, ends[1:])))


@register_controller(ControlSetController)
def drive_by_control_set(
    builder: ElementBuilder, controller: ControlSetController
) -> Iterator[Drive]:
    """What it does to the actuators that it names, and to the first of each name in its file.

    Raises:
        ModelError: there is no actuator of a name in the file, or a control has no meaning.
    """
    if controller.controls_file in ("", "Unassigned"):
        return
    path = beside(builder.folder, str(controller.controls_file))
    result = ControlCurves.read(path)
    driven = named(builder, controller)
    actuators = actuators_by_name(builder)
    for name in result.actuators:
        if name not in actuators:
            raise ModelError(
                f"'{builder.path(controller)}' has no actuator for the control '{name}' of its file"
                f"{suggest_name(name, actuators)}",
                file=str(path),
            )
        if all(item.name != name for item in driven):
            driven.append(actuators[name])
    for actuator in driven:
        curve = result.of(actuator.name)
        if curve is not None:
            yield Drive(actuator, curve)
