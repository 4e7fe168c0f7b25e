"""Evaluation of states of a mechanism with its forces, stage by stage, by the kernels."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from copy import copy
from functools import cached_property, partial
from math import isnan
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from osimlite.base.progress import divide_rows
from osimlite.errors import SimulationError
from osimlite.mechanics.kernels import layout
from osimlite.mechanics.kernels.layout import (
    CONTACT_WORK,
    ITEM,
    LINK_WORK,
    MODEL,
    OUTCOME,
    STAGE,
    WORK,
)
from osimlite.mechanics.kernels.pointers import Floats
from osimlite.mechanics.multibody.dynamics import describe_massless_motion
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.simulation.elements import Forces
from osimlite.simulation.elements.contact import PairContact
from osimlite.simulation.elements.controls import Controls
from osimlite.simulation.elements.force_records import CONTROLS
from osimlite.simulation.elements.probe_type import DeclaredProbe
from osimlite.simulation.engines.linking import Code, Program, select_code
from osimlite.simulation.pack import pack
from osimlite.simulation.states import StateLayout
from osimlite.simulation.stepper import NoSolution

if TYPE_CHECKING:
    from osimlite.simulation.pack_chain import Chain


class StateEvaluator:
    """Evaluator of states of a mechanism with its forces, which it packs for the kernels.

    Args:
        mechanism: the mechanism.
        forces: forces on it besides gravity.
        chain: joints whose mass matrix another program computes; None if the kernels compute it.
        code: backend that runs the kernels; None for the fastest that is installed.
        keep_fixed_bodies: whether a body that never moves in its parent is a link of its own.

    Attributes:
        structure: integers that describe topology; equal for models that differ in numbers only.
        numbers: all numbers of the model in one vector.
        program: the structure with the addresses of the functions that it calls.
        order: index in the mechanism of each coordinate of the state.
        state: layout of the state.
        placements: link of each body (-1 for ground), and the body's frame in it.
        contacts: names of the contacts, by index.
        columns: labels of the force records.
        probes: probes of the model.
        loads: contact forces of the last evaluation. Entry i is the force (N, in ground) of contact
            i if it touches; the last entry has one bit for each contact that touches.

    Raises:
        UnsupportedError: the kernels do not support a joint, function, constraint or force.
    """

    entries: tuple[str, ...] = ("evaluate",)
    """Names of the kernel functions that the system calls from outside."""

    def __init__(
        self,
        mechanism: Mechanism,
        forces: Forces,
        chain: Chain | None = None,
        code: Code | None = None,
        *,
        keep_fixed_bodies: bool = False,
    ) -> None:
        packed = pack(mechanism, forces, chain, keep_fixed_bodies=keep_fixed_bodies)
        self.structure = packed.structure
        self.placements = packed.placements
        self.order = packed.order
        contacts = [element for element in forces.elements if isinstance(element, PairContact)]
        self.contacts = tuple(
            item.pair_name(index) for item in contacts for index in range(len(item.pairs))
        )
        self.columns = tuple(label for element in forces.elements for label in element.columns)
        self.loads: list[Any] = [None] * len(self.contacts) + [0]
        self.program = Program(packed, select_code() if code is None else code, self.entries)
        self._items, self._owners = packed.items, packed.owners
        item_offsets = {owner: index for index, owner in packed.owners.items()}
        probes = (k for k, item in enumerate(forces.elements) if isinstance(item, DeclaredProbe))
        self._probe_offsets = [item_offsets.get(k, 0) for k in probes]
        self._w = np.zeros(self.structure[MODEL.WORK_SIZE])
        self._links = self._view_rows(MODEL.WORK_LINK, MODEL.LINKS, LINK_WORK.SIZE)
        self._pairs = self._view_rows(MODEL.WORK_CONTACT, MODEL.CONTACTS, CONTACT_WORK.SIZE)
        size = int(self.structure[MODEL.STATE_SIZE])
        self._y, self._f = np.zeros(size), np.zeros(size)
        self._set_model(mechanism, forces, packed.numbers)

    def _set_model(self, mechanism: Mechanism, forces: Forces, numbers: Floats) -> None:
        """Set the model, its numbers, and everything that depends on them.

        Args:
            mechanism: the mechanism.
            forces: forces on the mechanism besides gravity.
            numbers: numbers of the model in the layout of the kernels.
        """
        self.mechanism, self.forces, self.numbers = mechanism, forces, numbers
        self.state = StateLayout(mechanism, self.order, forces.elements)
        self.probes = tuple(item for item in forces.elements if isinstance(item, DeclaredProbe))
        self._controls = forces.controls
        self._driven_by: object = None
        self._bind_kernels()

    def copy_with_numbers(self, mechanism: Mechanism, forces: Forces, numbers: Floats) -> Self:
        """Return the system of a model with the same structure and other numbers.

        Both share their work vector, so they must not be used at the same time by two threads.

        Args:
            mechanism: mechanism of the other model.
            forces: forces of the other model.
            numbers: numbers of the other model in the layout of the kernels.
        """
        # The ordinary copy would construct a new engine.
        evaluator = object.__new__(type(self))
        evaluator.__dict__ |= self.__dict__
        evaluator.program = copy(self.program)
        # The cached property of `System` depends on the numbers.
        evaluator.__dict__.pop("masses_in_ground", None)
        evaluator._set_model(mechanism, forces, numbers)
        return evaluator

    def _bind_kernels(self) -> None:
        """Bind the kernels to the arrays of the system, so that a call passes only integers."""
        self._equilibrate: Callable[[int], int] | None = None
        self._evaluate = self.program.code.bind_entry(
            "evaluate", self.program.ints, self.numbers, self._w, self._y, self._f
        )

    def set_controls(self, controls: Controls) -> None:
        """Set the controls of the actuators for all later evaluations and motions.

        Args:
            controls: controls with the same names as those of the model.
        """
        record_offset = self.structure[MODEL.CONTROLS]
        if controls is self._controls or not record_offset:
            return
        ints, numbers, kernel = controls.make_record()
        first_number = self.structure[record_offset + ITEM.NUMBERS]
        if self._driven_by == (ints, len(numbers), kernel):
            # The numbers are replaced in place, so that callers of the kernels need no new arrays.
            self.numbers[first_number:] = numbers
            self._controls = controls
            return
        self._driven_by = ints, len(numbers), kernel
        self.structure = np.concatenate(
            (self.structure[: record_offset + ITEM.DETAILS], np.array(ints, dtype=np.int64))
        )
        self.numbers = np.concatenate(
            (self.numbers[:first_number], np.array(numbers, dtype=np.float64))
        )
        self.program.set_controls(self.structure, kernel)
        self._bind_kernels()
        self._controls = controls

    @property
    def current_controls(self) -> Controls:
        """Controls that drive the actuators now."""
        return self._controls

    def _view_rows(self, start: int, count: int, size: int) -> Floats:
        """Return a view of rows in the work vector.

        Args:
            start: field of the structure with the offset of the first row.
            count: field of the structure with the number of rows.
            size: length of a row.
        """
        first, rows = self.structure[start], self.structure[count]
        return self._w[first : first + size * rows].reshape(rows, size)

    def realize(self, t: float, y: Sequence[float], stage: int) -> int:
        """Evaluate a state up to a stage.

        Args:
            t: time, s.
            y: state (y,).
            stage: one of `STAGE`.

        Returns:
            The outcome, one of `OUTCOME`.

        Raises:
            OsimliteError: the state has a wrong length, or a Python function raised an error.
        """
        self._set_state(t, y)
        return self._run_kernel(self._evaluate, stage)

    def _run_kernel(self, function: Callable[..., int], *arguments: Any) -> int:
        status = self.program.run(function, *arguments)
        if status == OUTCOME.FAILED:
            raise self.program.failures.pop()
        return status

    def _set_state(self, t: float, y: Sequence[float]) -> None:
        if len(y) != len(self._y):
            raise self.state.make_length_error(len(y))
        self._w[WORK.TIME] = t
        self._y[:] = y

    def get_derivative(self) -> list[float]:
        """Return the derivative (y,) of the state after an evaluation.

        After the force stage it has generalized forces in place of udot.
        """
        return self._f.tolist()

    def compute_applied_forces(self, t: float, y: Sequence[float]) -> list[float]:
        """Return the derivative at a state with the applied generalized forces in place of udot.

        The forces belong to the generalized speeds. Gravity is not included.

        Args:
            t: time, s.
            y: state (y,).

        Returns:
            The derivative (y,); entries n to 2 n are generalized forces, N or N m.

        Raises:
            SimulationError: the rates of coordinates are not defined at this state, or a force
                cannot be computed.
        """
        status = self.realize(t, y, STAGE.FORCE)
        if status != OUTCOME.OK:
            raise self.make_evaluation_error(status, t, y)
        self.store_contact_loads(self._pairs[:, :3])
        return self.get_derivative()

    def equilibrate_muscles(
        self, t: float, y: Sequence[float], numbers: Floats | None = None
    ) -> list[float]:
        """Return a state with auxiliary states in equilibrium, as OpenSim's Model::equilibrateMuscles does.

        Args:
            t: time, s.
            y: state (y,).
            numbers: numbers of a model of the same structure; by default those of this system.

        Returns:
            The state (y,) with new auxiliary states.

        Raises:
            SimulationError: a force has no equilibrium, or the rates of coordinates are not defined
                at this state.
        """
        result, failed = self._equilibrate_all(t, y, numbers)
        if failed is not None:
            muscle = self._describe_item(
                self.structure[self._equilibrium_at(failed) + layout.EQUILIBRIUM.ITEM]
            )
            raise SimulationError(
                f"no equilibrium was found for {muscle}; start in another pose, or without equilibrate"
            )
        return result

    def equilibrate_each(self, t: float, y: Sequence[float]) -> tuple[list[float], dict[str, str]]:
        """Bring every muscle into equilibrium that has one, even if others have none.

        Args:
            t: time, s.
            y: state (y,).

        Returns:
            The state (y,), in which muscles without equilibrium keep their states, and the reasons
            by the paths of these muscles.

        Raises:
            SimulationError: the rates of coordinates are not defined at this state.
        """
        result, failed = self._equilibrate_all(t, y)
        if failed is None:
            return result, {}
        reasons = {}
        count = int(self.structure[MODEL.EQUILIBRIA])
        code = self.program.code
        work_vectors = (self._w, self._y, self._f)
        code.make_ready(("equilibrate",))
        while failed is not None:
            item = int(self.structure[self._equilibrium_at(failed) + layout.EQUILIBRIUM.ITEM])
            reasons[self.forces.elements[self._owners[item]].path] = self._describe_item(item)
            # The kernel reports the first failure only, so it is called again for the muscles after
            # it.
            ints = self.program.ints.copy()
            ints[MODEL.EQUILIBRIA] = count - (failed + 1)
            ints[MODEL.EQUILIBRIUM_AT] = self._equilibrium_at(failed + 1)
            self._set_state(t, y)
            status = self._run_kernel(
                partial(code.get_entry("equilibrate"), ints, self.numbers, *work_vectors),
                STAGE.VELOCITY,
            )
            failed = failed + 1 + int(self._f[0]) if status == OUTCOME.UNSOLVED else None
        for element in self.forces.elements:
            if element.path in reasons and element.states:
                first = self.state.find_first_state(element)
                result[first : first + len(element.states)] = y[first : first + len(element.states)]
        return result, reasons

    def _equilibrium_at(self, number: int) -> int:
        """Return the offset of the record of one of the equilibria."""
        return int(self.structure[MODEL.EQUILIBRIUM_AT]) + layout.EQUILIBRIUM.SIZE * number

    def _equilibrate_all(
        self, t: float, y: Sequence[float], numbers: Floats | None = None
    ) -> tuple[list[float], int | None]:
        """Equilibrate all muscles.

        Args:
            t: time, s.
            y: state (y,).
            numbers: numbers of a model of the same structure; by default those of this system.

        Returns:
            The state (y,), and the index of the first muscle without equilibrium, None if all have
            one.

        Raises:
            SimulationError: the rates of coordinates are not defined at this state.
        """
        if not self.structure[MODEL.EQUILIBRIA]:
            return list(y), None
        code = self.program.code
        ints = self.program.ints
        work_vectors = (self._w, self._y, self._f)
        if self._equilibrate is None:
            # Most models never need these kernels, so they are linked at their first use.
            self.program.link_equilibria()
            self._equilibrate = code.bind_entry("equilibrate", ints, self.numbers, *work_vectors)
        self._set_state(t, y)
        run = (
            self._equilibrate
            if numbers is None
            else partial(code.get_entry("equilibrate"), ints, numbers, *work_vectors)
        )
        try:
            status = self._run_kernel(run, STAGE.VELOCITY)
        except (ArithmeticError, ValueError) as failure:
            # Kernels in Python raise an exception where machine code computes NaN.
            raise SimulationError(
                f"the equilibrium of the muscles cannot be computed: {failure}"
            ) from failure
        if status == OUTCOME.UNSOLVED:
            return self._y.tolist(), int(self._f[0])
        if status != OUTCOME.OK:
            raise self.make_evaluation_error(status, t, y)
        return self._y.tolist(), None

    def _describe_item(self, item: int) -> str:
        """Return the subject of a message about an item whose equations have no solution.

        Args:
            item: offset of the item in the structure.
        """
        from osimlite.mechanics.kernels.paths import PATH_WORK
        from osimlite.simulation.elements.force_type import DeclaredForce
        from osimlite.simulation.elements.geometries.path import PATH

        owner = self._owners[item]
        element: Any = self.forces.elements[owner]
        *earlier_records, (offset, size) = self._items[owner]
        # A path that cannot be wrapped has the length NaN, and then the muscle has no solution
        # either.
        on_path = isinstance(element, DeclaredForce) and element.force_type.geometry is PATH
        if on_path and isnan(self._w[earlier_records[-1][0] + PATH_WORK.LENGTH]):
            return f"'{element.path}', whose path has no length in this pose"
        return element.describe_failure(self._w[offset : offset + size].tolist())

    def make_evaluation_error(self, status: int, t: float, y: Sequence[float]) -> SimulationError:
        """Return the error for the outcome of an evaluation.

        Args:
            status: one of `OUTCOME`.
            t: time, s.
            y: state (y,).
        """
        if not np.isfinite(np.array(y)).all():
            return SimulationError(
                "the state of the motion has become infinite or NaN; use a smaller accuracy value"
            )
        if status == OUTCOME.UNSOLVED:
            item = self.structure[self.structure[MODEL.ITEM_AT] + int(self._f[0])]
            return NoSolution(f"there is no solution for {self._describe_item(item)}")
        # The kernels report singular matrices by a number. The mechanism in Python finds the joint
        # and explains it.
        if status == OUTCOME.SINGULAR_RATES:
            try:
                self.mechanism.rate_matrix(self.state.values(y))
            except SimulationError as error:
                return error
        if status == OUTCOME.SINGULAR_MASS and self.structure[MODEL.CONSTRAINED]:
            try:
                self.mechanism.acceleration(self.state.values(y), self.state.speeds(y), time=t)
            except SimulationError as error:
                return error
        elif status == OUTCOME.SINGULAR_MASS:
            return describe_massless_motion(
                self.mechanism.coordinates[self.order[int(self._f[0])]].name
            )
        return SimulationError(
            "the motion cannot be computed any further; use a smaller accuracy value"
        )

    def read_record(self, path: str, offset: int) -> float:
        """Return a number of an element's record, or of the controls', after an evaluation.

        Args:
            path: path of the element, or `CONTROLS`.
            offset: offset in the record.
        """
        start = self.structure[MODEL.WORK_CONTROL] if path == CONTROLS else self._records_at[path]
        return float(self._w[start + offset])

    def find_offsets(self, path: str, names: Iterable[str]) -> list[int]:
        """Return offsets in the work vector of named quantities of a force.

        Args:
            path: path of the force.
            names: names in the declaration of its force type.

        Returns:
            One offset for each name.

        Raises:
            KeyError: the force records no such quantity.
        """
        offsets = self.get_force_type(path).record_names
        return [self._records_at[path] + offsets[name] for name in names]

    def has_quantity(self, path: str, name: str) -> bool:
        """Return whether a force records a quantity of this name."""
        return name in self.get_force_type(path).record_names

    def get_force_type(self, path: str) -> Any:
        """Return the declaration of the force at this path."""
        element: Any = next(item for item in self.forces.elements if item.path == path)
        return element.force_type

    @property
    def work_vector(self) -> Floats:
        """Work vector of the kernels, laid out as `kernels/layout.py` says."""
        return self._w

    @property
    def work_size(self) -> int:
        """Length of the work vector."""
        return len(self._w)

    def evaluate_moments(
        self,
        moments: Floats,
        offsets: Sequence[int],
        stage: int = STAGE.FORCE,
        udot: Floats | None = None,
    ) -> Floats:
        """Evaluate many states in one call of the kernels, and return entries of the work vector.

        Args:
            moments: times (s) and states (k, 1 + y).
            offsets: offsets in the work vector (m,); offsets from `work_size` on select entries of
                the derivative.
            stage: stage up to which the states are evaluated.
            udot: accelerations (k, n) in the order of the state; with them inverse dynamics is
                computed instead.

        Returns:
            Numbers (k, m).

        Raises:
            SimulationError: the rates of coordinates are not defined at a state, or a force cannot
                be computed.
        """
        if moments.shape[1] != 1 + len(self._y):
            raise self.state.make_length_error(moments.shape[1] - 1)
        law = "evaluate" if udot is None else "inverse"
        code = self.program.code
        code.make_ready(("evaluate_states", law))
        accelerations = np.empty((len(moments), 0)) if udot is None else udot
        inputs = np.ascontiguousarray(np.hstack([moments, accelerations]))
        result = np.empty((len(moments), len(offsets)))
        order = np.array(
            [0, accelerations.shape[1], code.get_address(law), len(offsets), *offsets],
            dtype=np.int64,
        )
        arguments = self.program.ints, self.numbers, self._w, self._y, self._f, stage
        entry = code.get_entry("evaluate_states")
        title = "evaluating the motion" if udot is None else "computing generalized forces"
        for rows in divide_rows(title, len(inputs)):
            order[0] = rows.stop - rows.start
            status = self._run_kernel(entry, *arguments, inputs[rows], order, result[rows])
            if status != OUTCOME.OK:
                raise self.make_evaluation_error(
                    status, float(self._w[WORK.TIME]), self._y.tolist()
                )
        return result

    @cached_property
    def _records_at(self) -> dict[str, int]:
        pairs = zip(self.forces.elements, self._items, strict=True)
        return {element.path: records[-1][0] for element, records in pairs if records}

    @property
    def control_offsets(self) -> range:
        """Offsets of the controls in the work vector, in the order of `Controls.names`."""
        first = int(self.structure[MODEL.WORK_CONTROL])
        return range(first, first + len(self._controls.names))

    def read_controls(self) -> list[float]:
        """Return the controls of all actuators after an evaluation, in the order of `Controls.names`."""
        return self._w[self.control_offsets].tolist()

    def store_contact_loads(self, forces: Floats) -> None:
        """Set `loads` from the forces of the contacts.

        Args:
            forces: contact forces in ground (P, 3), N; zero for contacts that do not touch.
        """
        bits = 0
        for number, force in enumerate(forces.tolist()):
            if any(force):
                bits |= 1 << number
                self.loads[number] = tuple(force)
        self.loads[-1] = bits
