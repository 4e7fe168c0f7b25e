"""Several copies of a model that are stepped together, by machine code on all cores."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from osimlite.base.cores import count_cores
from osimlite.mechanics.kernels.pointers import Floats
from osimlite.mechanics.multibody.functions import Constant
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.model import Model
from osimlite.simulation.batches import BatchOptions
from osimlite.simulation.engines.batch import Batch
from osimlite.simulation.run import Simulation
from osimlite.simulation.run_controls import places_of

AT_ONCE = 4
"""So many copies a thread takes at a time."""


class Copies:
    """Copies of a model, each in a state of its own, driven by controls that are held for a step.

    A copy comes out the same whatever is beside it, and on however many threads.

    Args:
        model: that is copied; its own controllers add to the controls.
        count: of the copies.
        step: length of a step, s.
        accuracy: of the integrator.
        integrator: which.
        longest: of the integrator's own steps, s.

    Attributes:
        states: of all copies (w, y), in the order of the engine; they are changed in place.
        controls: names of the actuators, in the order in which controls are given.
        places: where the numbers of the model have them (c,).
    """

    def __init__(
        self,
        model: Model,
        count: int,
        step: float,
        accuracy: float,
        integrator: str,
        longest: float = inf,
    ) -> None:
        self.simulation = simulation = Simulation(model, "compiled")
        engine: Any = simulation.engine
        self.engine = engine
        own = simulation.forces.controls
        self.controls = own.names
        driven = own.add_functions({name: Constant(0.0) for name in own.names})
        self.engine.drive(driven)
        self.start = np.array(simulation.initial_state({}, {}, equilibrate=True))
        self.places = places_of(engine, driven)
        options = BatchOptions(
            to=step, accuracy=accuracy, integrator=integrator, step_bounds=(0.0, longest)
        )
        options.check()
        self.batch = Batch(engine, np.tile(self.start, (count, 1)), options, start_holds=True)
        self._first_step = float(self.batch.clocks[0, 1])
        self._parts = [(first, min(first + AT_ONCE, count)) for first in range(0, count, AT_ONCE)]
        # Each core works on numbers of the model of its own, which are few enough to be near.
        self._rooms = [
            (self.batch.room(), engine.numbers.copy()) for _ in range(min(count_cores(), count))
        ]
        self._pool = ThreadPoolExecutor(len(self._rooms) - 1) if len(self._rooms) > 1 else None

    @property
    def states(self) -> Array:
        """Of all copies (w, y)."""
        return self.batch.states

    def put(self, which: Any, states: Array) -> None:
        """Have copies be in other states."""
        self.batch.states[which] = states
        self.batch.clocks[which, 1] = self._first_step

    def step(self, controls: Array) -> NDArray[np.bool_]:
        """Hold controls (w, c) for a step; which of the copies (w,) could go on to its end."""
        going = np.zeros(len(self.states), dtype=np.int64)
        self._together(
            "hold_several",
            self._parts,
            self.places,
            np.array(controls, dtype=np.float64, order="C"),
            len(self.places),
            going,
        )
        return going > 0

    def walk(self, which: Sequence[int], *parts: Any) -> int:
        """Have copies walk by :func:`osimlite.mechanics.kernels.walks.walk_several`; returns what that says last."""
        return self._together("walk_several", [(k, k + 1) for k in which], *parts)

    def _together(self, law: str, parts: Sequence[tuple[int, int]], *given: Any) -> int:
        """Have all cores compute parts of the copies, from the first to before the last."""
        self.engine.program.code.make_ready((law,))
        left, said = iter(parts), [0]

        def share(room: Floats, numbers: Floats) -> None:
            for first, last in left:
                said.append(self.batch.hold(law, room, numbers, *given, first, last))

        others = (
            []
            if self._pool is None
            else [self._pool.submit(share, *room) for room in self._rooms[1:]]
        )
        try:
            share(*self._rooms[0])
        finally:
            # Also after Ctrl-C nobody else works in the rooms.
            for other in others:
                other.result()
        return max(said)

    def close(self) -> None:
        """Free threads and engine."""
        if self._pool is not None:
            self._pool.shutdown()
        self.simulation.close()
