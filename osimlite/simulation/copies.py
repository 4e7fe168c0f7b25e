"""Copies of a model that are stepped together by machine code on all cores."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from osimlite.base.cores import count_cores
from osimlite.mechanics.kernels.pointers import Floats
from osimlite.mechanics.multibody.functions import ConstantValue
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.model import Model
from osimlite.simulation.batches import BatchOptions
from osimlite.simulation.engines.batch import BatchWorkspace
from osimlite.simulation.options import IntegrationOptions
from osimlite.simulation.run import Simulation
from osimlite.simulation.run_controls import find_constant_offsets

COPIES_PER_TASK = 4
"""Number of copies that a thread computes before it takes the next ones."""


class Copies:
    """Copies of a model, each with its own state, whose controls are held constant for a step.

    The result of a copy depends neither on the other copies nor on the number of threads.

    Args:
        model: the model; its controllers add to the controls.
        count: number of copies.
        step: length of a control step, s.
        options: accuracy, integrator and other options of the integration.

    Attributes:
        states: states of all copies (w, y) in the engine's order; they are changed in place.
        controls: names of the actuators, in the order of the controls.
        control_offsets: offsets of the controls in the numbers of the model (c,).
    """

    def __init__(
        self,
        model: Model,
        count: int,
        step: float,
        options: IntegrationOptions,
    ) -> None:
        self.simulation = simulation = Simulation(model, "compiled")
        engine: Any = simulation.engine
        self.engine = engine
        model_controls = simulation.forces.controls
        self.controls = model_controls.names
        # Constants are numbers of the model, which the caller replaces at each step.
        constant_controls = model_controls.add_functions(
            {name: ConstantValue(0.0) for name in model_controls.names}
        )
        self.engine.set_controls(constant_controls)
        self.start = np.array(simulation.initial_state({}, {}, equilibrate=True))
        self.control_offsets = find_constant_offsets(engine, constant_controls)
        batch_options = BatchOptions(to=step, **options.integration_choices())
        batch_options.check()
        self.batch = BatchWorkspace(
            engine, np.tile(self.start, (count, 1)), batch_options, start_holds=True
        )
        self._first_step = float(self.batch.clocks[0, 1])
        self._parts = [
            (first, min(first + COPIES_PER_TASK, count))
            for first in range(0, count, COPIES_PER_TASK)
        ]
        # Each core has its own copy of the model's numbers, which fits into its cache.
        self._workspaces = [
            (self.batch.make_workspace(), engine.numbers.copy())
            for _ in range(min(count_cores(), count))
        ]
        self._pool = (
            ThreadPoolExecutor(len(self._workspaces) - 1) if len(self._workspaces) > 1 else None
        )

    @property
    def states(self) -> Array:
        """States of all copies (w, y)."""
        return self.batch.states

    def set_states(self, which: Any, states: Array) -> None:
        """Set the states of some copies, and restart their step size.

        Args:
            which: indices or slice of the copies.
            states: states of these copies (k, y).
        """
        self.batch.states[which] = states
        # The step size of the old motion says nothing about the new one, and the result must not
        # depend on what a copy did before.
        self.batch.clocks[which, 1] = self._first_step

    def step_all(self, controls: Array) -> NDArray[np.bool_]:
        """Advance all copies by one control step.

        Args:
            controls: controls (w, c) that are held constant during the step.

        Returns:
            Whether each copy (w,) reached the end of the step; False where integration failed.
        """
        running = np.zeros(len(self.states), dtype=np.int64)
        self._run_on_all_cores(
            "hold_several",
            self._parts,
            self.control_offsets,
            np.array(controls, dtype=np.float64, order="C"),
            len(self.control_offsets),
            running,
        )
        return running > 0

    def walk_some(self, which: Sequence[int], *arguments: Any) -> int:
        """Advance some copies by :func:`osimlite.mechanics.kernels.walks.walk_several`.

        Args:
            which: indices of the copies.
            arguments: further arguments of the kernel.

        Returns:
            The largest outcome, one of `OUTCOME`; 0 if all went well.
        """
        return self._run_on_all_cores("walk_several", [(k, k + 1) for k in which], *arguments)

    def _run_on_all_cores(
        self, law: str, ranges: Sequence[tuple[int, int]], *arguments: Any
    ) -> int:
        """Run a kernel for parts of the copies on all cores.

        Args:
            law: name of the kernel.
            ranges: first and last copy (exclusive) of each call.
            arguments: arguments of the kernel before these two.

        Returns:
            Largest result of the kernel.
        """
        self.engine.program.code.make_ready((law,))
        # One iterator for all threads: each takes the next part when it is ready, so that slow
        # copies do not hold up the others. The lock of the interpreter makes `next` safe.
        remaining_ranges = iter(ranges)
        statuses = [0]

        def run_ranges(workspace: Floats, numbers: Floats) -> None:
            for first, last in remaining_ranges:
                statuses.append(
                    self.batch.run_walk_law(law, workspace, numbers, *arguments, first, last)
                )

        futures = (
            []
            if self._pool is None
            else [self._pool.submit(run_ranges, *workspace) for workspace in self._workspaces[1:]]
        )
        try:
            run_ranges(*self._workspaces[0])
        finally:
            # Wait also after Ctrl-C, so that no other thread still uses the workspaces.
            for future in futures:
                future.result()
        return max(statuses)

    def close(self) -> None:
        """Shut down the threads and close the engine."""
        if self._pool is not None:
            self._pool.shutdown()
        self.simulation.close()
