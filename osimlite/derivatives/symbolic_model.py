"""Model of CasADi symbols: its numbers, state and controls, and the kernels evaluated on them.

The kernels are traced once for each stage. Paths around surfaces are found by a search, which has no
formula, and enter functions as callbacks.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from osimlite.derivatives.differentiable_model import DifferentiableModel
from osimlite.mechanics.kernels.layout import STAGE
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.model import Model
from osimlite.simulation.elements import Forces
from osimlite.simulation.pack import PackedModel, pack
from osimlite.simulation.states import sort_by_component

if TYPE_CHECKING:
    from osimlite.derivatives.symbolic_evaluator import SymbolicEvaluator, SymbolicWorkspace
    from osimlite.derivatives.wrapped_paths import WrappedPaths


class SymbolicModel(DifferentiableModel):
    """Model with columns of CasADi symbols for time, state, controls and parameters.

    Arguments and attributes are those of
    :class:`osimlite.derivatives.differentiable_model.DifferentiableModel`, and:

    Args:
        loads_as_inputs: whether t also contains the values of the time-dependent loads at that time
            (`loads`; none for a model with parameters): tables of thousands of rows make large
            formulas.
    """

    def __init__(
        self,
        model: Model,
        parameters: Sequence[str],
        folder: Path,
        *,
        keep_fixed_bodies: bool = False,
        loads_as_inputs: bool = False,
    ) -> None:
        # Imported first, as its error names the missing package.
        from osimlite.derivatives.symbolic_evaluator import list_load_functions
        from osimlite.derivatives.symbols import casadi as library

        self._library = library
        super().__init__(model, parameters, folder, keep_fixed_bodies=keep_fixed_bodies)
        self.loads = (
            list_load_functions(self.forces.elements) if loads_as_inputs and not parameters else []
        )
        self._symbols = {
            "t": library.SX.sym("t", 1 + len(self.loads)),
            "x": library.SX.sym("x", len(self.states)),
            "xdot": library.SX.sym("xdot", len(self.states)),
            "u": library.SX.sym("u", len(self.controls)),
            "p": library.SX.sym("p", len(self.parameters)),
            "multipliers": library.SX.sym("multipliers", self.constraint_count),
            # Paths around surfaces are found by a search, which has no formula: their lengths and
            # derivatives are arguments of the inner functions.
            "paths": library.SX.sym("paths", self._wrapped_paths.size),
        }
        self._wrapped_paths.set_symbols(self._list_symbols("paths"))
        self._path_function = (
            self._wrapped_paths.make_function() if self._wrapped_paths.size else None
        )
        # Forces without a formula raise an error here, not at the first use.
        self._evaluator  # noqa: B018

    def _collect_forces(self, model: Model, mechanism: Mechanism) -> Forces:
        self._wrapped_paths = self._find_wrapped_paths(model, mechanism)
        return self._wrapped_paths.forces

    def _find_wrapped_paths(self, model: Model, mechanism: Mechanism) -> WrappedPaths:
        """Return the forces of a model, with symbols for paths around surfaces.

        Args:
            model: model with the forces.
            mechanism: mechanism of the model.
        """
        from osimlite.derivatives.wrapped_paths import WrappedPaths

        infos = mechanism.coordinates
        unlocked = [k for k, info in enumerate(infos) if not info.locked]
        paths = sort_by_component(model, [f"{infos[k].path}/value" for k in unlocked])
        index_by_path = {f"{infos[k].path}/value": k for k in unlocked}
        return WrappedPaths(
            mechanism,
            super()._collect_forces(model, mechanism),
            [index_by_path[path] for path in paths],
        )

    def _pack_numbers(self, changed_model: Model) -> Array:
        """Return all numbers that may depend on parameters.

        Args:
            changed_model: the model with other values of the parameters.

        Returns:
            Numbers of the kernels, points and frames, and lengths of paths around surfaces; none if
            the structure of the model changes.
        """
        mechanism = build_mechanism(changed_model)
        searched = self._find_wrapped_paths(changed_model, mechanism)
        packed = pack(mechanism, searched.forces, keep_fixed_bodies=self._keep_fixed_bodies)
        if not np.array_equal(packed.structure, self._packed.structure):
            return np.zeros(0)
        # Paths around surfaces must not depend on a parameter, because their lengths are not linear in
        # it. Two poses suffice to notice a dependence.
        path_measures = (
            [
                searched.measure_paths(self.x[: len(self.coordinates)] + shift)
                for shift in (0.0, 0.1)
            ]
            if searched.size
            else []
        )
        return np.concatenate(
            (packed.numbers, *_list_fixed_numbers(mechanism, packed), *path_measures)
        )

    @cached_property
    def _evaluator(self) -> SymbolicEvaluator:
        """Evaluator of the kernels on the symbols of this model."""
        from osimlite.derivatives.constraints import find_independent_equations
        from osimlite.derivatives.parameters import insert_parameters
        from osimlite.derivatives.symbolic_evaluator import SymbolicEvaluator

        numbers = self._packed.numbers.tolist()
        if self._parameters:
            numbers = insert_parameters(
                self._parameters.base.tolist(), self._parameters.slopes, self._list_symbols("p")
            )
        equations = (
            find_independent_equations(self.mechanism, self._packed, self._state)
            if self.constraint_count
            else ()
        )
        return SymbolicEvaluator(
            self._packed,
            self.forces,
            numbers,
            self._symbols["t"][0],
            self._sort_by_engine("x"),
            self._list_symbols("u"),
            equations,
            self._list_symbols("t")[1:],
        )

    def _list_symbols(self, name: str) -> list[Any]:
        """Return the entries of a column of symbols.

        Args:
            name: name of the column, such as "x".
        """
        symbol = self._symbols[name]
        return [symbol[k] for k in range(symbol.numel())]

    def _sort_by_engine(self, name: str) -> list[Any]:
        """Return the entries of a state in the order of the kernels.

        Args:
            name: name of the column of symbols, "x" or "xdot".
        """
        result: list[Any] = [0.0] * len(self.states)
        for index, entry in zip(self.state_indices, self._list_symbols(name), strict=True):
            result[index] = entry
        return result

    def _sort_by_model(self, y: Sequence[Any]) -> list[Any]:
        """Return the entries of a state in the order of `states`."""
        return [y[index] for index in self.state_indices]

    @cached_property
    def _evaluation(self) -> SymbolicWorkspace:
        """Evaluation of the kernels up to the accelerations."""
        return self._evaluator.evaluate(STAGE.ACCELERATION)

    @cached_property
    def _velocity_evaluation(self) -> SymbolicWorkspace:
        """Evaluation of poses and speeds of the links, without forces."""
        return self._evaluator.evaluate(STAGE.VELOCITY)

    @cached_property
    def _fixed_numbers(self) -> tuple[list[Any], list[Any]]:
        """Points of stations, and axes and origins of frames, in their links; some may be symbols.

        Returns:
            Points (3 k,), and axes and origins (12 m,).
        """
        stations, frames = (
            numbers_of_group.tolist()
            for numbers_of_group in _list_fixed_numbers(self.mechanism, self._packed)
        )
        if self._parameters:
            first_station = len(self._packed.numbers)
            first_frame = first_station + len(stations)
            numbers = [*self._evaluator.numbers]
            stations = numbers[first_station:first_frame]
            frames = numbers[first_frame : first_frame + len(frames)]
        return stations, frames

    def _make_function(
        self, name: str, argument_names: Sequence[str], results: dict[str, Any]
    ) -> Any:
        """Return a CasADi function of named symbols and results.

        Paths around surfaces enter as the results of a callback, which an outer function inserts.

        Args:
            name: name of the function.
            argument_names: names of its arguments.
            results: formulas by name.
        """
        symbols = [self._symbols[argument_name] for argument_name in argument_names]
        if self._path_function is None or "x" not in argument_names:
            return self._library.Function(
                name, symbols, [*results.values()], [*argument_names], [*results]
            )
        # The formulas are SX; the paths are a function that CasADi calls, which takes MX.
        function_of_paths = self._library.Function(
            f"{name}_of_paths", [*symbols, self._symbols["paths"]], [*results.values()]
        )
        arguments = self._make_arguments(argument_names)
        outputs = function_of_paths(
            *arguments,
            self._path_function(arguments[argument_names.index("x")][: len(self.coordinates)]),
        )
        return self._library.Function(
            name,
            arguments,
            [*outputs] if len(results) > 1 else [outputs],
            [*argument_names],
            [*results],
        )

    def _make_arguments(self, argument_names: Sequence[str]) -> list[Any]:
        """Return symbols for the arguments of a function: MX if it contains a callback, else SX."""
        symbol_class = self._library.SX if self._path_function is None else self._library.MX
        return [symbol_class.sym(name, self._symbols[name].numel()) for name in argument_names]


def _list_fixed_numbers(mechanism: Mechanism, packed: PackedModel) -> tuple[Array, Array]:
    """Return the numbers of stations and frames that do not depend on the state.

    Returns:
        Points of all stations in their links (3 k,), and axes and origins of all frames (12 m,).
    """
    from osimlite.derivatives.outputs import locate_frames, locate_stations

    stations = [number for _, _, point in locate_stations(mechanism, packed) for number in point]
    frames = [
        number for _, numbers in locate_frames(mechanism, packed).values() for number in numbers
    ]
    return np.array(stations), np.array(frames)
