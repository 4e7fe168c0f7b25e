"""Controls in a ControlSet or a table, and the controller that applies them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import inf, nextafter
from pathlib import Path

import numpy as np

from osimlite.base.records import dataclass
from osimlite.base.text import suggest_name
from osimlite.errors import ModelError
from osimlite.io.document.cache import read_object
from osimlite.io.tables.storage import find_named_file
from osimlite.mechanics.multibody.functions import ConstantValue, PiecewiseConstant, SmoothFunction
from osimlite.mechanics.multibody.smoothing_spline import PiecewisePolynomial
from osimlite.schema.control_sets import (
    Control,
    ControlConstant,
    ControlLinear,
    ControlLinearNode,
    ControlSet,
    ControlSetController,
)
from osimlite.simulation.elements.builder import ElementBuilder
from osimlite.simulation.elements.control_tables import read_controls
from osimlite.simulation.elements.controls import Drive, find_actuators, map_actuators
from osimlite.simulation.elements.registry import register_controller


@dataclass(frozen=True)
class ControlCurves:
    """Controls of a file.

    Attributes:
        curves: functions of time by the names of the controls; the first one of each name.
        of_model: names of the controls that the model must have.
    """

    curves: Mapping[str, SmoothFunction]
    of_model: Sequence[str]

    @classmethod
    def read(cls, path: Path) -> ControlCurves:
        """Read a ControlSet, or a table (``.sto``), which is interpolated linearly.

        Args:
            path: path of the file.

        Returns:
            Controls in the file.

        Raises:
            DocumentError: the file is neither a ControlSet nor a table.
            ModelError: a control has no nodes, or their times go back.
        """
        curves: dict[str, SmoothFunction] = {}
        if ".sto" in path.name:
            table = read_controls(path)
            for label, values in zip(table.columns, table.rows.T.tolist(), strict=True):
                curves.setdefault(
                    label, _connect_points(table.times.tolist(), values, extrapolate=True)
                )
            return cls(curves, table.columns)
        controls = read_object(path, ControlSet).objects
        for control in controls:
            curves.setdefault(control.name, _make_curve(control, str(path)))
        return cls(curves, [control.name for control in controls if control.is_model_control])

    @property
    def actuators(self) -> list[str]:
        """Names of the actuators that the model must have."""
        return [name.removesuffix(EXCITATION) for name in self.of_model]

    def find_curve(self, actuator: str) -> SmoothFunction | None:
        """Return the control of an actuator.

        Args:
            actuator: name of the actuator, which the control has with or without ``.excitation``.

        Returns:
            The function of time; None if there is no such control.
        """
        return self.curves.get(actuator) or self.curves.get(actuator + EXCITATION)


EXCITATION = ".excitation"
"""Suffix of the names of controls of muscles."""


def _make_curve(control: Control, file: str) -> SmoothFunction:
    if isinstance(control, ControlConstant):
        return ConstantValue(control.value)
    assert isinstance(control, ControlLinear)
    if not control.x_nodes:
        raise ModelError(
            f"the control '{control.name}' has no x_nodes; add at least one", file=file
        )
    return make_node_curve(control, control.x_nodes, file)


def make_node_curve(
    control: ControlLinear, nodes: Sequence[ControlLinearNode], file: str | None = None
) -> SmoothFunction:
    """Return lines or steps through nodes of a control, such as its x_nodes.

    Args:
        control: the control, which says whether there are steps and extrapolation.
        nodes: the nodes in the order of time.
        file: file of the control, for messages; None if unknown.

    Returns:
        The function of time (s).

    Raises:
        ModelError: the times go back, or a number is not finite.
    """
    times = [node.t for node in nodes]
    values = [node.value for node in nodes]
    if not np.isfinite([*times, *values]).all() or (np.diff(times) < 0.0).any():
        raise ModelError(
            f"the x_nodes of the control '{control.name}' go back in time or are not finite; sort and correct them",
            file=file,
        )
    if control.use_steps:
        # Each value applies up to and including its own time.
        return PiecewiseConstant(
            (times[0], *(nextafter(time, inf) for time in times[:-1])), tuple(values)
        )
    return _connect_points(times, values, extrapolate=control.extrapolate)


def _connect_points(
    times: Sequence[float], values: Sequence[float], *, extrapolate: bool
) -> SmoothFunction:
    """Return straight lines between points; two points at one time make a jump.

    Args:
        times: non-decreasing times, s.
        values: values at these times.
        extrapolate: whether the first and last lines continue outside; else the end values do.

    Returns:
        The function of time.
    """
    if len(times) == 1:
        return ConstantValue(values[0])
    widths = np.diff(times)
    # Two points at one time make a step, without a slope between them.
    slopes = np.where(widths > 0.0, np.diff(values) / np.where(widths > 0.0, widths, 1.0), 0.0)
    lines = np.column_stack((values[:-1], slopes))
    if extrapolate:
        return PiecewisePolynomial(np.array(times[:-1]), lines)
    # Constant before the first and after the last point.
    ends = np.array(((values[0], 0.0), (values[-1], 0.0)))
    return PiecewisePolynomial(np.array((times[0], *times)), np.vstack((ends[:1], lines, ends[1:])))


@register_controller(ControlSetController)
def drive_by_control_set(
    builder: ElementBuilder, controller: ControlSetController
) -> Iterator[Drive]:
    """Yield the drives of the actuators that the controller names, and of those that its file names.

    Raises:
        ModelError: the model has no actuator of a name in the file, or a control has no meaning.
    """
    if controller.controls_file in ("", "Unassigned"):
        return
    path = find_named_file(builder.folder, str(controller.controls_file))
    result = ControlCurves.read(path)
    driven = find_actuators(builder, controller)
    actuators = map_actuators(builder)
    # OpenSim adds the actuators of the file to those that the controller names.
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
        curve = result.find_curve(actuator.name)
        if curve is not None:
            yield Drive(actuator, curve)
