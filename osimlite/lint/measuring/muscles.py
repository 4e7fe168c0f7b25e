"""Muscles in their initial state, and in equilibrium at the shortest and longest path."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterator, Sequence
from contextlib import suppress
from itertools import repeat
from math import nan
from pathlib import Path
from typing import Any

from osimlite.base.named_tuples import NamedTuple
from osimlite.errors import ModelError
from osimlite.lint.measures import FiberReach, MeasuringPose, MuscleStart
from osimlite.mechanics.laws.muscles import MuscleInputs
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.schema.model import Model
from osimlite.schema.muscles import Muscle
from osimlite.schema.states import list_states
from osimlite.simulation.elements.builder import ElementBuilder
from osimlite.simulation.elements.force_type import ForceType
from osimlite.simulation.elements.parameters import Fields, Number, Numbers, ParameterGroup
from osimlite.simulation.elements.registry import FORCE_TYPES

ROUNDING = 1e-9
"""Relative tolerance within which a fiber is at its shortest length."""
REST_ACTIVATION = 0.01
"""Activation of a muscle at rest: the smallest default of minimum_activation in OpenSim's muscle classes."""


class MuscleFibers(NamedTuple):
    """Muscle with its law as a Python function.

    Compiling the law would take longer than some hundred calls of it.

    Attributes:
        path: path of the muscle.
        kind: force type of the muscle.
        component: muscle of the model.
        values: values of the law's parameters, except for the control.
    """

    path: str
    kind: ForceType
    component: Any
    values: tuple[Any, ...]

    @property
    def is_elastic(self) -> bool:
        """True if the muscle has states to equilibrate."""
        return not set(self.kind.solved_states).isdisjoint(list_states(self.component))

    def get_start_states(self) -> dict[str, float]:
        """Return the initial states of the muscle.

        Returns:
            The values by the names of the states.
        """
        return {state.name: state.initial_value(self.component) for state in self.kind.states}

    def equilibrate(self, length: float, states: dict[str, float]) -> dict[str, float]:
        """Return the equilibrium states at a path length (m); NaN without equilibrium.

        Args:
            length: length of the path, m.
            states: initial values by the names of the states.

        Returns:
            The values by the names of the states.
        """
        if not self.is_elastic:
            return states
        is_found, *result = self._call_law(self.kind.equilibrium, length, states)
        return states | dict(
            zip(self.kind.solved_states, result if is_found else repeat(nan), strict=False)
        )

    def evaluate_law(self, length: float, states: dict[str, float]) -> dict[str, float]:
        """Evaluate the muscle law for a path at rest.

        Args:
            length: length of the path, m.
            states: values by the names of the states.

        Returns:
            The outputs by name; tension in `max_isometric_force`, fiber length in optimal lengths.
        """
        outputs = dict(
            zip(
                self.kind.outputs,
                # Tension and length are compared between muscles, hence relative to strength and
                # optimal length.
                map(float, self._call_law(self.kind.law, length, states)),
                strict=False,
            )
        )
        # A strength of 0 gives NaN, not an error.
        outputs["tension"] /= self.component.max_isometric_force or nan
        outputs["fiber_length"] /= self.component.optimal_fiber_length
        return outputs

    def _call_law(
        self, law: Callable[..., Any] | None, length: float, states: dict[str, float]
    ) -> Sequence[Any]:
        assert law is not None
        try:
            result: Sequence[Any] = law(
                MuscleInputs(length, 0.0, states.get("activation", 1.0), **states), *self.values
            )
        except (ArithmeticError, ValueError):
            # Machine code computes NaN where Python raises, for example for a root of -1.
            return [nan] * len(self.kind.outputs)
        return result


def find_fibers(
    model: Model, mechanism: Mechanism, paths: Container[str]
) -> Iterator[MuscleFibers]:
    """Yield the muscles whose laws have only numeric parameters: Thelen, Millard, De Groote, Meyer.

    Args:
        model: model with the muscles.
        mechanism: mechanism of the model.
        paths: paths of the requested muscles.
    """
    builder = ElementBuilder(model, mechanism, Path())
    for muscle in model.components(Muscle):
        kind = FORCE_TYPES.find(type(muscle))
        if kind is None or not muscle.appliesForce or builder.path(muscle) not in paths:
            continue
        _, *terms = kind.terms
        # Terms that are bundled are examined one by one.
        single_terms = (
            single_term
            for term in terms
            for single_term in (term.terms if isinstance(term, ParameterGroup) else (term,))
        )
        # Laws with curves or other objects as parameters would have to be compiled.
        if not all(
            isinstance(single_term, Fields | Number | Numbers) for single_term in single_terms
        ):
            continue
        # Other rules report what OpenSim rejects.
        with suppress(ModelError):
            if kind.check is not None:
                kind.check(builder, muscle)
            yield MuscleFibers(
                builder.path(muscle),
                kind,
                muscle,
                tuple(term.read(builder, muscle) for term in terms),
            )


def compute_start(fibers: MuscleFibers, length: float) -> MuscleStart | None:
    """Compute the initial state and the equilibrium of a muscle; None without states to equilibrate.

    Args:
        fibers: muscle with its law.
        length: length of the path, m.

    Returns:
        Fiber lengths and tensions in both states.
    """
    if not fibers.is_elastic:
        return None
    states = fibers.get_start_states()
    at_start = fibers.evaluate_law(length, states)
    at_equilibrium = fibers.evaluate_law(length, fibers.equilibrate(length, states))
    lengths, tensions = (
        (at_start[name], at_equilibrium[name]) for name in ("fiber_length", "tension")
    )
    return MuscleStart(fibers.path, lengths, tensions)


def compute_reach(
    fibers: MuscleFibers, length: float, is_active: bool, pose: MeasuringPose
) -> FiberReach:
    """Compute the fibers in equilibrium.

    Args:
        fibers: muscle with its law.
        length: length of the path, m.
        is_active: whether the muscle is fully active; otherwise it has the activation at rest.
        pose: pose with this length, for messages.

    Returns:
        The fiber length, and whether it is at the limit of the muscle.
    """
    outputs = fibers.evaluate_law(
        length,
        fibers.equilibrate(
            length,
            fibers.get_start_states() | {"activation": 1.0 if is_active else REST_ACTIVATION},
        ),
    )
    # The names of the smallest fiber length differ between the muscle classes.
    numbers = fibers.values[0]
    min_length = (
        getattr(numbers, "smallest", getattr(numbers, "shortest", 0.0))
        / fibers.component.optimal_fiber_length
    )
    is_limit = (
        outputs["fiber_length"] <= min_length * (1.0 + ROUNDING) or outputs["cos_pennation"] <= 0.0
    )
    return FiberReach(fibers.path, is_active, pose, outputs["fiber_length"], is_limit)
