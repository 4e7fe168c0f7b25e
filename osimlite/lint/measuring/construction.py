"""Attempt to build a model as a simulation does, with a report of the failures, for lint rules.

The steps are those of `osimlite simulate`: the mechanism, its forces and controllers, the default
pose that fulfils the constraints, one evaluation of the accelerations.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.base.patterns import compile_later
from osimlite.errors import DoubtfulWarning, OsimliteError, SimulationError, UnsupportedError
from osimlite.lint.construction import Obstacle, Stage
from osimlite.mechanics.kernels.layout import OUTCOME, STAGE
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.assembly import UnmetConstraintsError, find_unclamped
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.model import Model
from osimlite.schema.scholz_paths import Scholz2015GeometryPath
from osimlite.simulation.elements import Forces
from osimlite.simulation.elements.builder import ElementBuilder
from osimlite.simulation.elements.force_records import ForceElement
from osimlite.simulation.elements.geometries.paths.scholz2015_geometry_path import (
    check_cable as check_cable,
)
from osimlite.simulation.elements.probe_type import make_probes
from osimlite.simulation.engines.linking import READY_CODE
from osimlite.simulation.system import System

SINGULAR_RATIO = 1e-12
"""Ratio of the smallest to the largest eigenvalue below which a mass matrix counts as singular."""

_QUOTED_PATH = compile_later(r"'(/[^']*)'")


@np.errstate(all="ignore")
def try_construction(
    model: Model, folder: Path | None = None
) -> tuple[list[Obstacle], Mechanism | None]:
    """Try to build a model and to compute its accelerations.

    Args:
        model: model to build.
        folder: folder of the model file, to which the names of other files are relative; None for a
            model without a file.

    Returns:
        The obstacles in the order of the steps, and the mechanism for further computations; None if it
        cannot be built.
    """
    with warnings.catch_warnings():
        # Rules report faults that are only warnings of a simulation.
        warnings.simplefilter("ignore", DoubtfulWarning)
        construction = _Construction(model, folder)
        return [*construction.run()], construction.mechanism


class _Construction:
    """One attempt to compute the accelerations of a model."""

    def __init__(self, model: Model, folder: Path | None) -> None:
        self.model = model
        self.folder = Path(folder or ".")
        self.tree = model.tree()
        self.mechanism: Mechanism | None = None

    def run(self) -> Iterator[Obstacle]:
        """Yield the obstacles of all stages: mechanism, forces, assembly, accelerations."""
        try:
            self.mechanism = mechanism = build_mechanism(self.model)
        except OsimliteError as error:
            yield self.describe(error, Stage.MECHANISM)
            return
        builder = ElementBuilder(self.model, mechanism, self.folder)
        elements: list[ForceElement] = []
        failures = [*self.gather(builder, elements)]
        yield from failures
        is_complete = all(failure.stage == Stage.UNSUPPORTED for failure in failures)
        try:
            q = mechanism.assemble({})
        except OsimliteError as error:
            yield from self.describe_assembly(error)
            return
        yield from self.find_clamps(mechanism, q)
        # A force that is missing by mistake changes the accelerations, so they are then evaluated without
        # any forces: only errors of the mechanism itself are reported.
        if not is_complete:
            elements = []
        controls = builder.controls.controls if is_complete else Forces(()).controls
        yield from self.evaluate(mechanism, q, Forces(tuple(elements), controls=controls))

    # ------------------------------------------------------------------------------------- forces
    def gather(self, builder: ElementBuilder, elements: list[ForceElement]) -> Iterator[Obstacle]:
        """Make the elements of all forces and probes.

        Yields:
            Reasons why some forces or probes have no element.
        """
        try:
            # Building the controllers first reports an error of a controller once, and not again
            # for each actuator that it drives.
            builder.controls  # noqa: B018
        except OsimliteError as error:
            yield self.describe(error, Stage.FORCE)
            return
        for force in builder.iterate_forces():
            if isinstance(getattr(force, "geometry_path", None), Scholz2015GeometryPath):
                # Check its cable once and leave it out of the evaluations, which take seconds each
                # without machine code.
                try:
                    check_cable(builder, force)
                except OsimliteError as error:
                    yield self.describe(error, Stage.CABLE, builder.path(force))
                continue
            try:
                elements.append(builder.make_element(force))
            except OsimliteError as error:
                yield self.describe(error, Stage.FORCE, builder.path(force))
        try:
            make_probes(builder, elements)
        except OsimliteError as error:
            yield self.describe(error, Stage.FORCE)

    # ------------------------------------------------------------------------------- default pose
    def describe_assembly(self, error: OsimliteError) -> Iterator[Obstacle]:
        """Yield an obstacle for each constraint that the default pose does not meet."""
        if not isinstance(error, UnmetConstraintsError):
            is_pose = isinstance(error, SimulationError)
            yield self.describe(error, Stage.ASSEMBLY if is_pose else Stage.MECHANISM)
            return
        for path, distance in error.errors.items():
            component = self.tree.by_path.get(path)
            name = (
                f"{type(component).__name__} '{component.name}'"
                if component is not None
                else f"'{path}'"
            )
            size = f"{distance:.3g} (m or rad)" if isfinite(distance) else "an unknown amount"
            suffix = "" if len(error.errors) == 1 else f" and {len(error.errors) - 1} more"
            yield Obstacle(
                Stage.ASSEMBLY,
                path,
                f"no pose near the default pose fulfils {name}{suffix}; the nearest pose is off by {size}",
            )

    def find_clamps(self, mechanism: Mechanism, q: Array) -> Iterator[Obstacle]:
        """Yield the clamped coordinates that the assembled pose takes out of their ranges."""
        for index, info in enumerate(mechanism.coordinates):
            prescribed = info.prescribed
            value = float(q[index])
            if prescribed is not None and info.clamped and not info.locked:
                low, high = info.range
                if not low - 1e-9 <= value <= high + 1e-9:
                    yield Obstacle(
                        Stage.CLAMP,
                        info.path,
                        f"the prescribed_function of '{info.name}' starts at {value:.6g}, outside "
                        f"its clamped range, {low:.6g} to {high:.6g}",
                    )
        for index in find_unclamped(mechanism, q):
            info = mechanism.coordinates[index]
            if abs(q[index] - info.default_value) < 1e-9 or info.locked:
                # Another rule reports default values outside of the range.
                continue
            low, high = info.range
            yield Obstacle(
                Stage.CLAMP,
                info.path,
                f"the constraints take '{info.name}' to {q[index]:.6g}, outside its clamped "
                f"range, {low:.6g} to {high:.6g}",
            )

    # ------------------------------------------------------------------------------ accelerations
    def evaluate(self, mechanism: Mechanism, q: Array, forces: Forces) -> Iterator[Obstacle]:
        """Evaluate the accelerations in the default pose.

        Yields:
            Reasons why the accelerations cannot be computed.
        """
        try:
            u = mechanism.project_speeds(q, {})
            system = System(mechanism, forces, code=READY_CODE)
        except OsimliteError as error:
            yield self.describe(error, Stage.ACCELERATION)
            return
        try:
            state = system.state.pack(q.tolist(), u.tolist())
        except OsimliteError as error:
            yield self.describe(error, Stage.ACCELERATION)
            return
        status = _evaluate_accelerations(system, state)
        if status == OUTCOME.SINGULAR_MASS:
            # OpenSim computes with an indefinite mass matrix, so only a singular one is an obstacle.
            if not _is_indefinite(mechanism, q):
                yield self.describe_inertia(system, state)
        elif status != OUTCOME.OK:
            refusal = (
                system.make_evaluation_error(status, 0.0, state) if status is not None else None
            )
            culprits = [*self.find_culprits(mechanism, forces, q, u)]
            if culprits:
                yield from culprits
            elif isinstance(refusal, SimulationError) and status == OUTCOME.SINGULAR_RATES:
                yield self.describe(refusal, Stage.ACCELERATION)
            elif status is None:
                yield Obstacle(Stage.ACCELERATION, "", "the accelerations are not finite")
        elif not np.isfinite(np.array(system.get_derivative())[: 2 * len(system.order)]).all():
            culprits = [*self.find_culprits(mechanism, forces, q, u)]
            yield from culprits or [
                Obstacle(Stage.ACCELERATION, "", "the accelerations are not finite")
            ]
        else:
            yield from self.find_rates(system)

    def find_rates(self, system: System) -> Iterator[Obstacle]:
        """Yield the auxiliary states whose rates are not numbers."""
        rates = system.get_derivative()[2 * len(system.order) :]
        for variable, rate in zip(system.state.variables, rates, strict=True):
            if not isfinite(rate):
                owner, _, name = variable.path.rpartition("/")
                component = self.tree.by_path.get(owner)
                owner_description = (
                    f"{type(component).__name__} '{component.name}'"
                    if component is not None
                    else owner
                )
                yield Obstacle(
                    Stage.RATE,
                    owner,
                    f"the rate of {name} of {owner_description} is not finite at the start: "
                    "OpenSim's integrator stops there, unless the muscles are put into equilibrium first",
                )

    def describe_inertia(self, system: System, state: list[float]) -> Obstacle:
        """Return the obstacle of a singular mass matrix."""
        refusal = system.make_evaluation_error(OUTCOME.SINGULAR_MASS, 0.0, state)
        message = refusal.message.partition(";")[0]
        named = re.search(r"coordinate '([^']*)'", message)
        for info in system.mechanism.coordinates:
            if named is not None and info.name == named[1]:
                return Obstacle(Stage.INERTIA, info.path, message)
        return Obstacle(Stage.INERTIA, "", message)

    def find_culprits(
        self, mechanism: Mechanism, forces: Forces, q: Array, u: Array
    ) -> Iterator[Obstacle]:
        """Yield the forces that produce accelerations which are not finite, each tested alone."""
        if not _is_computed(mechanism, Forces(()), q, u):
            # Other rules report NaN among the numbers of the mechanism.
            return
        for element in forces.elements:
            single_force = Forces((element,), controls=forces.controls)
            if _is_computed(mechanism, single_force, q, u):
                continue
            component: Any = self.tree.by_path.get(element.path)
            kind = type(component).__name__ if component is not None else "force"
            yield Obstacle(
                Stage.ACCELERATION,
                element.path,
                f"{kind} '{element.path.rpartition('/')[2]}' computes no finite number in the "
                "default pose: every acceleration is NaN or infinite",
            )

    # ------------------------------------------------------------------------------------ helpers
    def describe(self, error: OsimliteError, stage: Stage, path: str = "") -> Obstacle:
        """Return an error of the builder as an obstacle, at the component that it names."""
        if isinstance(error, UnsupportedError):
            stage = Stage.UNSUPPORTED
        components = self.tree.by_path
        for quoted_path in _QUOTED_PATH.findall(error.message):
            if not path and quoted_path in components:
                path = quoted_path
        return Obstacle(stage, path, error.message)


def _is_indefinite(mechanism: Mechanism, q: Array) -> bool:
    """Return whether a mass matrix has an inverse, but negative eigenvalues: OpenSim computes with it.

    It comes from inertias with negative moments, which another rule reports.
    """
    try:
        values = np.linalg.eigvalsh(mechanism.mass_matrix(q))
    except (OsimliteError, np.linalg.LinAlgError):
        return False
    sizes = np.abs(values)
    return bool(len(values) and values.min() < 0.0 and sizes.min() > SINGULAR_RATIO * sizes.max())


def _is_computed(mechanism: Mechanism, forces: Forces, q: Array, u: Array) -> bool:
    """Return whether a mechanism has accelerations under some forces, or these cannot be tested."""
    try:
        system = System(mechanism, forces, code=READY_CODE)
    except OsimliteError:
        # A probe cannot be tested alone because it reads another element.
        return True
    status = _evaluate_accelerations(system, system.state.pack(q.tolist(), u.tolist()))
    if status == OUTCOME.OK:
        return bool(np.isfinite(np.array(system.get_derivative())[: 2 * len(system.order)]).all())
    return status in (OUTCOME.SINGULAR_MASS, OUTCOME.SINGULAR_RATES, OUTCOME.UNSOLVED)


def _evaluate_accelerations(system: System, state: list[float]) -> int | None:
    """Evaluate the accelerations and return the status; None if a result is not finite.

    Kernels that run as Python raise an exception where machine code computes NaN.

    Returns:
        The status of the evaluation, see `OUTCOME`.
    """
    try:
        return system.realize(0.0, state, STAGE.ACCELERATION)
    except (ArithmeticError, ValueError):
        return None
    except OsimliteError:
        return OUTCOME.FAILED
