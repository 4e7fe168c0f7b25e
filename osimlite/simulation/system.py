"""A mechanism with its forces: inverse dynamics, and reports of forces, energies, probes and links.

Engines derive from :class:`System`. The stages of an evaluation are Simbody's: positions of the
links, their velocities, the forces on them, their accelerations. An evaluation leaves its results in
the work vector, from which reports are read.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property

import numpy as np

from osimlite.base.progress import divide_rows
from osimlite.mechanics.kernels import layout
from osimlite.mechanics.kernels.layout import (
    ITEM,
    LINK_WORK,
    MODEL,
    OUTCOME,
    STAGE,
    WORK,
)
from osimlite.mechanics.kernels.pointers import Floats
from osimlite.mechanics.multibody.mechanism import GROUND
from osimlite.simulation.elements.force_records import ForceElement
from osimlite.simulation.elements.muscle import STRENGTH
from osimlite.simulation.evaluation import StateEvaluator
from osimlite.simulation.link_motion import Moments, locate_points

MOMENTS_PER_CALL = 4096
"""Number of states that one call of the kernels evaluates for a table; it bounds the memory that long motions need."""


class System(StateEvaluator):
    """A mechanism and its forces, packed for the kernels, with inverse dynamics and reports of states.

    Arguments, attributes and errors are those of :class:`StateEvaluator`.
    """

    def evaluate_probes(self, t: float, y: Sequence[float]) -> list[list[float]]:
        """Return the inputs of each probe at a state, before the probe's operation.

        Args:
            t: time, s.
            y: state (y,).

        Returns:
            One number for each label of each probe.
        """
        self.compute_applied_forces(t, y)
        result = []
        for probe, item_offset in zip(self.probes, self._probe_offsets, strict=True):
            # Some probes, such as of momentum, are computed in Python from the links; the others
            # have a kernel.
            if probe.probe_type.measure is not None:
                result.append(list(probe.probe_type.measure(probe, self, t, y)))
                continue
            self.program.code.get_entry(probe.probe_type.name)(
                self.program.ints, self.numbers, self._w, self._y, self._f, item_offset
            )
            first = self.structure[item_offset + ITEM.RECORD]
            result.append(self._w[first : first + len(probe.reading.labels)].tolist())
        return result

    def find_touching_contacts(self, t: float, y: Sequence[float]) -> int:
        """Return one bit for each contact that touches, and set `loads`.

        Args:
            t: time, s.
            y: state (y,).
        """
        self.compute_applied_forces(t, y)
        return int(self.loads[-1])

    def force_records(self, t: float, y: Sequence[float]) -> list[float]:
        """Return one number for each of `columns`.

        Args:
            t: time, s.
            y: state (y,).
        """
        self.compute_applied_forces(t, y)
        origins = [self._get_origin(body) for body in range(len(self.placements))] + [
            (0.0, 0.0, 0.0)
        ]
        return [
            value
            for element, records in self.read_records()
            for value in element.report(records, origins)
        ]

    def force_table(
        self, times: Sequence[float] | Floats, states: Sequence[Sequence[float]] | Floats
    ) -> Floats:
        """Return one row of `columns` for each state, evaluated in few calls of the kernels.

        Args:
            times: times (k,), s.
            states: states (k, y) in the order of the engine.

        Returns:
            Numbers (k, c), those of :meth:`force_records`.

        Raises:
            SimulationError: the rates of coordinates are not defined at a state, or a force cannot
                be computed.
        """
        moments = np.column_stack(
            [times, np.asarray(states, dtype=float).reshape(len(times), len(self._y))]
        )
        result = np.zeros((len(moments), len(self.columns)))
        if not self.columns:
            return result
        copied, sources, computed = self._sort_columns()
        slices = []
        offsets = list[int](sources)
        for number, columns in computed:
            record_slices = []
            for offset, record_size in self._items[number]:
                record_slices.append(slice(len(offsets), len(offsets) + record_size))
                offsets += range(offset, offset + record_size)
            slices.append((self.forces.elements[number], record_slices, columns))
        # Reports of torques need the origins of the bodies, hence rotation and position of each
        # link.
        links = int(self.structure[MODEL.WORK_LINK])
        size = LINK_WORK.SIZE
        count = len(offsets)
        for number in range(len(self._links) if computed else 0):
            first = links + size * number
            offsets += [
                *range(first, first + 9),
                *range(first + LINK_WORK.POSITION, first + LINK_WORK.POSITION + 3),
            ]
        # Chunks bound the memory for the work vectors of long motions.
        for start in range(0, len(moments), MOMENTS_PER_CALL):
            values = self.evaluate_moments(moments[start : start + MOMENTS_PER_CALL], offsets)
            rows = result[start : start + MOMENTS_PER_CALL]
            rows[:, copied] = values[:, : len(copied)]
            if not computed:
                continue
            origins = self._compute_origins(values[:, count:].reshape(len(values), -1, 12)).tolist()
            work = values[:, :count].tolist()
            for element, record_slices, columns in slices:
                rows[:, columns] = [
                    element.report(
                        [moment[record_slice] for record_slice in record_slices], body_origins
                    )
                    for moment, body_origins in zip(work, origins, strict=True)
                ]
        return result

    def _sort_columns(self) -> tuple[list[int], list[int], list[tuple[int, slice]]]:
        """Divide `columns` into copies of numbers in the work vector and columns that elements compute.

        Returns:
            Copied columns, their offsets in the work vector, and index and columns of each element
            that computes its columns.
        """
        copied = list[int]()
        sources = list[int]()
        computed = list[tuple[int, slice]]()
        first = 0
        for number, element in enumerate(self.forces.elements):
            columns = slice(first, first := first + len(element.columns))
            offsets = element.find_copied_offsets()
            if offsets is None:
                computed.append((number, columns))
            elif offsets:
                copied += range(columns.start, columns.stop)
                sources += [self._items[number][-1][0] + offset for offset in offsets]
        return copied, sources, computed

    def _compute_origins(self, links: Floats) -> Floats:
        """Return the origins of all bodies and of ground.

        Args:
            links: rotations (9 numbers) and positions (m) of the links (k, l, 12).

        Returns:
            Origins in ground (k, b + 1, 3), m; the last one is that of ground.
        """
        result = np.zeros((len(links), len(self.placements) + 1, 3))
        for body, (link, frame) in enumerate(self.placements):
            offset = frame[:3, 3]
            if link == GROUND:
                result[:, body] = offset
            else:
                result[:, body] = links[:, link, 9:] + links[:, link, :9].reshape(-1, 3, 3) @ offset
        return result

    def compute_energies(self, t: float, y: Sequence[float]) -> tuple[float, float, float]:
        """Compute the energies at a state.

        Returns:
            Kinetic energy, potential energy of gravity, and energy stored in forces, J.
        """
        self.compute_applied_forces(t, y)
        kinetic, gravity = self._compute_link_energies()
        # Simbody counts the potential energy of bodies that are welded to ground.
        gravity -= sum(
            float(mass * self.mechanism.gravity @ center) for mass, center in self.masses_in_ground
        )
        return (
            kinetic,
            gravity,
            float(sum(element.compute_energy(records) for element, records in self.read_records())),
        )

    def compute_stored_energy(self, path: str, t: float, y: Sequence[float]) -> float:
        """Return the energy stored in one force.

        Args:
            path: path of the force.
            t: time, s.
            y: state (y,).

        Returns:
            Energy, J; 0 if the force does not act.
        """
        self.compute_applied_forces(t, y)
        return float(
            sum(
                element.compute_energy(records)
                for element, records in self.read_records()
                if element.path == path
            )
        )

    def _compute_link_energies(self) -> tuple[float, float]:
        """Return the energies of all links after an evaluation.

        Returns:
            Kinetic energy ½ Σ (m v² + ωᵀ I ω) and potential energy -Σ m gᵀ c of gravity, J, with
            mass centres c and inertias I about them.
        """
        w, inertia = self._links, self.inertia
        motion = locate_points(w, inertia[:, 1:4])
        rotations = w[:, :9].reshape(-1, 3, 3)
        turning = w[:, LINK_WORK.VELOCITY : LINK_WORK.VELOCITY + 3]
        v = motion[:, 3:]
        # Inertias are along the axes of the links, so the angular velocities are rotated into them.
        body_velocities = (turning[:, None, :] @ rotations)[:, 0]
        # Ixx, Iyy, Izz, Ixy, Ixz, Iyz become a symmetric matrix.
        moments = inertia[:, [4, 7, 8, 7, 5, 9, 8, 9, 6]].reshape(-1, 3, 3)
        spin = np.sum(body_velocities * (moments @ body_velocities[:, :, None])[:, :, 0])
        kinetic = 0.5 * float(inertia[:, 0] @ np.sum(v * v, axis=1) + spin)
        return kinetic, -float(inertia[:, 0] @ motion[:, :3] @ self.mechanism.gravity)

    @property
    def inertia(self) -> Floats:
        """Mass (kg), mass centre (m) and inertia about it (kg·m²) of all links, in their frames (l, 10)."""
        size = layout.INERTIA.SIZE
        return self.numbers[layout.REALS.INERTIA :][: size * len(self._links)].reshape(-1, size)

    @cached_property
    def masses_in_ground(self) -> list[tuple[float, Floats]]:
        """Masses (kg) and mass centres (3,) in ground (m) of the bodies that are fixed to ground."""
        pairs = zip(self.placements, self.mechanism.bodies, strict=True)
        fixed = [(frame, body.mass_properties) for (link, frame), body in pairs if link == GROUND]
        return [
            (mass_properties.mass, frame[:3, :3] @ mass_properties.center + frame[:3, 3])
            for frame, mass_properties in fixed
        ]

    def compute_required_forces(self, moments: Floats, udot: Floats) -> Floats:
        """Compute inverse dynamics for many states.

        Constraints are ignored. Errors are those of :meth:`evaluate_moments`.

        Args:
            moments: times (s) and states (k, 1 + y).
            udot: accelerations (k, n) in the order of the state.

        Returns:
            Generalized forces (k, n) that the accelerations need beyond gravity and the forces of
            the model.
        """
        # The kernel of inverse dynamics writes its result in place of the derivatives of the
        # speeds.
        first = self.work_size + len(self.order)
        return self.evaluate_moments(moments, range(first, first + len(self.order)), udot=udot)

    def compute_accelerated_links(self, moments: Floats, udot: Floats) -> Floats:
        """Return the link records (k, l, n) of the kernels for given accelerations.

        The wrench of a link is the sum of the applied forces (with gravity) on it and on all that
        it carries, less the inertial forces: joints and constraints balance it. Errors are those of
        :meth:`evaluate_moments`.

        Args:
            moments: times (s) and states (k, 1 + y).
            udot: accelerations (k, n) in the order of the state.
        """
        first = int(self.structure[MODEL.WORK_LINK])
        result = self.evaluate_moments(moments, range(first, first + self._links.size), udot=udot)
        return result.reshape(-1, *self._links.shape)

    def compute_unit_forces(
        self, moments: Floats, udot: Floats, names: Sequence[str]
    ) -> tuple[Floats, Floats, Floats]:
        """Compute required generalized forces, and the contribution of each actuator at a control of 1.

        The force of each actuator must be proportional to its control, and all controls must be 0.
        Constraints are ignored. Errors are those of :meth:`evaluate_moments`.

        Args:
            moments: times (s) and states (k, 1 + y).
            udot: accelerations (k, n) in the order of the state.
            names: paths of the a actuators.

        Returns:
            Generalized forces that are missing without actuators (k, n), generalized forces of each
            actuator (k, a, n), and the forces (N) of muscles (k, a), which are 1 for other
            actuators.
        """
        code = self.program.code
        size = len(self.order)
        code.make_ready(("push_each_actuator", "inverse"))
        item_offsets = {
            self.forces.elements[owner].path: offset for offset, owner in self._owners.items()
        }
        controls = dict(zip(self._controls.names, self.control_offsets, strict=True))
        order = [0, len(names)]
        for name in names:
            item = item_offsets[name]
            path = -1
            strength = -1
            # A muscle pulls along its path with its strength; the other actuators apply their
            # optimal force.
            if self.has_quantity(name, STRENGTH):
                path = item - int(
                    self.structure[item + ITEM.DETAILS + self.get_force_type(name).text.int_count]
                )
                (strength,) = self.find_offsets(name, (STRENGTH,))
            order += item, controls[name], path, strength
        inputs = np.hstack([moments, udot])
        result = np.empty((len(moments), size + len(names) * (size + 1)))
        arguments = (
            self.program.ints,
            self.numbers,
            self._w,
            self._y,
            self._f,
            code.get_address("inverse"),
        )
        entry = code.get_entry("push_each_actuator")
        plan = np.array(order, dtype=np.int64)
        for rows in divide_rows("computing the force of each muscle", len(moments)):
            plan[0] = rows.stop - rows.start
            status = self._run_kernel(entry, *arguments, inputs[rows], plan, result[rows])
            if status != OUTCOME.OK:
                raise self.make_evaluation_error(
                    status, float(self._w[WORK.TIME]), self._y.tolist()
                )
        unit_results = result[:, size:].reshape(len(moments), len(names), size + 1)
        return result[:, :size], unit_results[:, :, :size], unit_results[:, :, size]

    def evaluate_all_links(self, moments: Moments) -> Floats:
        """Return the link records of the kernels at many states.

        Args:
            moments: times (s) with states.

        Returns:
            Link records (k, l, n).
        """
        return self.evaluate_links(
            np.array([(t, *y) for t, y in moments]).reshape(len(moments), 1 + len(self._y))
        )

    def evaluate_links(self, moments: Floats, links: Sequence[int] | None = None) -> Floats:
        """Return the link records of the kernels at many states.

        Args:
            moments: times (s) and states (k, 1 + y).
            links: indices of the l links; all if None.

        Returns:
            Link records (k, l, n), without accelerations.
        """
        first, (count, size) = int(self.structure[MODEL.WORK_LINK]), self._links.shape
        link_indices = range(count) if links is None else links
        offsets = [first + size * link + number for link in link_indices for number in range(size)]
        return self.evaluate_moments(moments, offsets, STAGE.VELOCITY).reshape(
            len(moments), len(link_indices), size
        )

    def read_records(self) -> Iterator[tuple[ForceElement, list[list[float]]]]:
        """Yield each force element with the records of its items after an evaluation."""
        work = self._w.tolist()
        for element, records in zip(self.forces.elements, self._items, strict=True):
            yield element, [work[offset : offset + size] for offset, size in records]

    def _get_origin(self, body: int) -> tuple[float, float, float]:
        """Return the origin of a body after an evaluation.

        Args:
            body: index of the body.

        Returns:
            Position in ground (3,), m.
        """
        link, frame = self.placements[body]
        x, y, z = frame[:3, 3].tolist()
        if link == GROUND:
            return x, y, z
        link_row = self._links[link]
        position = (
            link_row[LINK_WORK.POSITION : LINK_WORK.POSITION + 3]
            + link_row[:9].reshape(3, 3) @ frame[:3, 3]
        )
        x, y, z = position.tolist()
        return x, y, z
