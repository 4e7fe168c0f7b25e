"""CasADi functions of a model: values and exact derivatives for optimization and analysis."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable
from functools import cached_property
from pathlib import Path
from typing import Any

from osimlite.base.files import make_folder
from osimlite.base.text import suggest_name
from osimlite.base.writing import write_into
from osimlite.derivatives.symbolic_model import SymbolicModel
from osimlite.derivatives.tangents import TangentModel
from osimlite.errors import SettingError, UnsupportedError
from osimlite.mechanics.kernels.layout import CONSTRAINED, MODEL
from osimlite.mechanics.multibody.mechanism import GROUND
from osimlite.schema.model import Model, check_is_model
from osimlite.simulation.elements.probe_type import DeclaredProbe

FUNCTIONS = "dynamics", "residual", "constraints", "outputs", "paths"
"""Names of the functions that `CasadiModel.save` writes."""


def casadi(
    model: Model, parameters: Iterable[str] = (), folder: str | Path | None = None
) -> CasadiModel:
    """Return a model as CasADi functions, made of the same laws that simulate it.

    Args:
        model: model to differentiate.
        parameters: paths of numbers of the model that stay symbols: ``/bodyset/torso/mass``,
            ``/forceset/soleus_r/max_isometric_force``, ``/bodyset/torso/mass_center/1``. A path may
            stand for several numbers that are equal.
        folder: folder of the model's file, for the files that it names; the current folder if None.

    Returns:
        The functions, each made when it is first used.

    Raises:
        MissingDependency: casadi is not installed, or cannot be loaded beside another library.
        ModelError: the model is not a mechanism.
        SettingError: a parameter does not exist.
        UnsupportedError: a part of the model has no formula, or a number cannot stay a symbol; the
            message names it.
    """
    check_is_model(model)
    return CasadiModel(model, tuple(parameters), Path(folder or "."))


class CasadiModel(SymbolicModel):
    """CasADi functions (``casadi.Function``) of a model, each made when it is first used.

    All are functions of columns: time t (s); the state x, named by `states`; its derivative xdot;
    the controls u of the actuators, named by `controls`, which replace the outputs of the model's
    controllers (a stretch reflex adds to them); the parameters p, named by `parameters`. Units are
    those of OpenSim's state files: m, rad, s, N. Where a result does not exist, for example in a
    singular pose of a joint, it is NaN.

    Arguments and attributes are those of
    :class:`osimlite.derivatives.symbolic_model.SymbolicModel`.
    """

    @property
    def searched(self) -> tuple[str, ...]:
        """Paths of the forces along paths around surfaces, which have no formula.

        Returns:
            Component paths.
        """
        return self._wrapped_paths.names

    @cached_property
    def in_tangents(self) -> TangentModel:
        """Tangents of the same model in machine code, with the values that the parameters have here."""
        result = TangentModel(self._model, self.parameters, self._folder)
        result.take(self.p)
        return result

    # --------------------------------------------------------------------------------------------- functions
    @cached_property
    def dynamics(self) -> Any:
        """``dynamics(t, x, u, p) -> xdot``: derivative of the state."""
        evaluation = self._evaluation
        return self._make_function(
            "dynamics",
            ("t", "x", "u", "p"),
            {"xdot": evaluation.mask_failures(self._sort_by_model(evaluation.f.cells))},
        )

    @cached_property
    def linear(self) -> Any:
        """``linear(t, x, u, p) -> xdot, A, B``: derivative of the state, with its exact derivatives.

        A is the derivative by the state (x, x), B that by the controls (x, u).
        """
        argument_names = "t", "x", "u", "p"
        symbols = self._make_arguments(argument_names)
        xdot = self.dynamics(*symbols)
        slopes = [
            self._library.jacobian(xdot, symbols[argument_names.index(name)]) for name in ("x", "u")
        ]
        return self._library.Function(
            "linear", symbols, [xdot, *slopes], [*argument_names], ["xdot", "A", "B"]
        )

    @cached_property
    def residual(self) -> Any:
        """``residual(t, x, xdot, u, p, multipliers) -> residual``: zero for motions of the model.

        The rows are in the order of the state. Rows of values are given rates less the rates by the
        speeds (rad/s, m/s). Rows of speeds are generalized forces ``M udot + c - f + Gᵀ
        multipliers`` (N, N m). Rows of auxiliary states are given rates less the rates by the force
        laws. The multipliers (N, N m) belong to the rows of G in `constraints`; without constraints there are no multipliers.
        """
        size = len(self.coordinates)
        xdot = self._sort_by_engine("xdot")
        workspace = self._evaluator.compute_missing_forces(xdot[size : 2 * size])
        f = workspace.f.cells
        # Rows of values and auxiliary states: given rate less computed rate. Those of speeds are
        # forces, which replace them below.
        rows = [
            input_rate - computed_rate for input_rate, computed_rate in zip(xdot, f, strict=True)
        ]
        rows[size : 2 * size] = f[size : 2 * size]
        if self.constraint_count:
            constraint_forces = self._constraint_errors["jacobian"].T @ self._symbols["multipliers"]
            rows[size : 2 * size] = [
                rows[size + k] + constraint_forces[self._find_coordinate(k)] for k in range(size)
            ]
        inputs = "t", "x", "xdot", "u", "p", "multipliers"
        return self._make_function(
            "residual", inputs, {"residual": workspace.mask_failures(self._sort_by_model(rows))}
        )

    def _find_coordinate(self, k: int) -> int:
        """Return the index among `coordinates` of a degree of freedom."""
        return self.state_indices.index(k)

    def generalized_forces(self, pushing: Collection[str]) -> Any:
        """Return ``generalized_forces(t, x, xdot, u, p) -> missing``: ``M udot + c`` less gravity and given forces.

        Args:
            pushing: paths of the given forces.

        Returns:
            ``casadi.Function`` whose result (k, 1), N and N m, is in the order of `coordinates`;
            constraint forces are not included.
        """
        size = len(self.coordinates)
        xdot = self._sort_by_engine("xdot")
        workspace = self._evaluator.compute_missing_forces(xdot[size : 2 * size], pushing)
        forces = self._sort_by_model(workspace.f.cells)[size : 2 * size]
        return self._make_function(
            "generalized_forces",
            ("t", "x", "xdot", "u", "p"),
            {"missing": workspace.mask_failures(forces)},
        )

    def joint_load(self, path: str, side: str) -> Any:
        """Return ``joint_load(t, x, xdot, u, p, multipliers) -> force, moment``: load of a joint on a body.

        It is the wrench that the bodies which the joint carries need for their accelerations beyond
        all other forces. The multipliers are those of `residual`.

        Args:
            path: path of the joint.
            side: ``child`` or ``parent``, the body on which the load acts.

        Returns:
            ``casadi.Function`` of the force (3,), N, and the moment (3,), N m, about the origin of
            the joint's frame on that side, along the axes of ground.
        """
        from osimlite.derivatives.outputs import compute_joint_load_columns, locate_frames

        bodies = self.mechanism.bodies
        placements = self._packed.placements
        body = next(body for body in bodies if body.mobilizer.joint == path)
        link = placements[bodies.index(body)].link
        if link == (GROUND if body.parent == GROUND else placements[body.parent].link):
            # A joint without motion is merged away, so a model with separate links computes its
            # load.
            separate_model = CasadiModel(
                self._model,
                self.parameters,
                self._folder,
                keep_fixed_bodies=True,
                loads_as_inputs=bool(self.loads),
            )
            return separate_model.joint_load(path, side)
        # The missing wrench acts on the body that the joint carries in the tree, and its opposite on
        # the other one.
        sign = 1.0 if (side == "child") != body.mobilizer.reversed else -1.0
        size = len(self.coordinates)
        xdot = self._sort_by_engine("xdot")
        workspace = self._evaluator.compute_missing_forces(xdot[size : 2 * size])
        constraint_wrenches = []
        if self.constraint_count:
            multipliers = self._list_symbols("multipliers")
            constraint_wrenches = [
                (constrained_link, multipliers[row], unit)
                for (
                    row,
                    constrained_link,
                ), unit in self._evaluator.evaluate_constraints().result.items()
            ]
        joint: Any = self._model.find(path)
        frame = (
            self._model.tree()
            .target(joint, f"socket_{side}_frame", getattr(joint, f"socket_{side}_frame"))
            .path
        )
        frame_locations = locate_frames(self.mechanism, self._packed)
        number = [*frame_locations].index(frame)
        origin = (
            frame_locations[frame][0],
            self._fixed_numbers[1][12 * number + 9 : 12 * number + 12],
        )
        argument_names = "t", "x", "xdot", "u", "p", "multipliers"
        return self._make_function(
            "joint_load",
            argument_names,
            compute_joint_load_columns(workspace, link, origin, sign, constraint_wrenches),
        )

    @cached_property
    def constraints(self) -> Any:
        """``constraints(t, x, xdot, p) -> position, velocity, acceleration, jacobian``: zero where constraints hold.

        The errors of the position equations (rad, m), of all equations in speeds (``G u`` less its
        target) and in accelerations (``G udot`` less its target). G (m, n) has a row for each
        equation and a column for each of `coordinates`.
        """
        return self._make_function("constraints", ("t", "x", "xdot", "p"), self._constraint_errors)

    @cached_property
    def _constraint_errors(self) -> dict[str, Any]:
        """Results of `constraints` by name.

        Returns:
            Position, velocity and acceleration errors, and the Jacobian.
        """
        from osimlite.derivatives.constraints import list_position_equations

        size = len(self.coordinates)
        count = self.constraint_count
        column = self._library.vertcat
        if not count:
            empty_column = self._library.SX(0, 1)
            empty_matrix = self._library.SX(0, size)
            return {
                "position": empty_column,
                "velocity": empty_column,
                "acceleration": empty_column,
                "jacobian": empty_matrix,
            }
        workspace = self._evaluator.evaluate_constraints()
        structure = self._evaluator.structure
        h = structure[structure[MODEL.CONSTRAINED] :]
        data = workspace.data
        order = [self.state_indices.index(k) for k in range(size)]
        rows = []
        for number in range(count):
            first_offset = h[CONSTRAINED.WORK_ROWS] + size * number
            row = [0.0] * size
            for k, state_index in enumerate(order):
                row[state_index] = data[first_offset + k]
            rows.append(self._library.horzcat(*row))
        jacobian = self._library.sparsify(self._library.SX(column(*rows)))
        u = self._symbols["x"][size : 2 * size]
        udot = self._symbols["xdot"][size : 2 * size]

        def get_rows(field: int) -> Any:
            return column(*data[h[field] : h[field] + count])

        errors = [
            data[h[CONSTRAINED.WORK_ERRORS] + number]
            for number in list_position_equations(structure)
        ]
        return {
            "position": self._library.SX(column(*errors)),
            "velocity": jacobian @ u - get_rows(CONSTRAINED.WORK_RATES),
            "acceleration": jacobian @ udot - get_rows(CONSTRAINED.WORK_DRIFTS),
            "jacobian": jacobian,
        }

    @cached_property
    def outputs(self) -> Any:
        """``outputs(t, x, u, p) -> ...``: columns whose entries are named by `output_names`.

        ``stations``, ``station_velocities``: positions and velocities of markers and other stations
        in ground (m, m/s); ``mass_center``, ``mass_center_velocity``; ``contact_forces``: for each
        pair the force in ground (N) on the second surface, or on the sphere, and its point (m);
        ``forces``: recorded values of each force, such as ``tension`` (N), ``activation``,
        ``fiber_length`` (m), ``cos_pennation``, ``active_fiber_force`` (N); ``probes``: value of
        each probe times its gain, before its operation over time. Probes of energies and of joints
        are not included.
        """
        return self._make_function(
            "outputs",
            ("t", "x", "u", "p"),
            {key: column for key, (_, column) in self._outputs.items()},
        )

    @cached_property
    def output_names(self) -> dict[str, tuple[str, ...]]:
        """Names of the entries of each result of `outputs`.

        Returns:
            Names by the name of the result.
        """
        return {name: tuple(labels) for name, (labels, _) in self._outputs.items()}

    @cached_property
    def _outputs(self) -> dict[str, tuple[list[str], Any]]:
        """Labels and column of each result of `outputs`.

        Returns:
            Labels and column by the name of the result.
        """
        from osimlite.derivatives.outputs import compute_output_columns

        workspace = self._evaluation
        if any(isinstance(element, DeclaredProbe) for element in self.forces.elements):
            workspace = self._evaluator.evaluate_probes()
        return compute_output_columns(
            self.mechanism, self._packed, self.forces, workspace, self._fixed_numbers[0]
        )

    def frames(self, paths: Iterable[str]) -> Any:
        """Return ``frames(t, x, p) -> position, rotation, velocity, angular_velocity`` of frames in ground.

        Args:
            paths: paths of k frames.

        Returns:
            ``casadi.Function``: origins (3, k) in m, rotation matrices (9, k) column by column,
            velocities of the origins (3, k) in m/s, angular velocities (3, k) in rad/s.

        Raises:
            SettingError: a frame does not exist.
        """
        from osimlite.derivatives.outputs import compute_frame_columns, locate_frames

        frame_locations = locate_frames(self.mechanism, self._packed)
        selected_frames = []
        numbers = {
            path: self._fixed_numbers[1][12 * number : 12 * number + 12]
            for number, path in enumerate(frame_locations)
        }
        for path in paths:
            if path not in frame_locations:
                raise SettingError(
                    f"the model has no frame '{path}'{suggest_name(path, frame_locations)}"
                )
            selected_frames.append((frame_locations[path][0], numbers[path]))
        argument_names = "t", "x", "p"
        symbols = [self._symbols[name] for name in argument_names]
        results = compute_frame_columns(self._velocity_evaluation, selected_frames)
        return self._library.Function(
            "frames", symbols, [*results.values()], [*argument_names], [*results]
        )

    @cached_property
    def paths(self) -> Any:
        """``paths(t, x, p) -> lengths, speeds, moment_arms``: geometry of the paths of `path_names`.

        Lengths (m), lengthening speeds (m/s), and moment arms (k, n) about each of `coordinates`
        (m; 1 for sliding coordinates): the generalized force of a tension of 1 N.
        """
        _, lengths, speeds = self._paths
        size = len(self.coordinates)
        # The speed is linear in the generalized speeds, with minus the moment arms as factors.
        arms = -self._library.jacobian(speeds, self._symbols["x"])[:, size : 2 * size]
        return self._make_function(
            "paths", ("t", "x", "p"), {"lengths": lengths, "speeds": speeds, "moment_arms": arms}
        )

    @cached_property
    def path_names(self) -> tuple[str, ...]:
        """Paths of the forces that act along paths.

        Returns:
            Component paths in the order of `paths`.
        """
        return tuple(self._paths[0])

    @cached_property
    def _paths(self) -> tuple[list[str], Any, Any]:
        """Names, lengths and lengthening speeds of the paths.

        Returns:
            Component paths, column of lengths (m), and column of speeds (m/s).
        """
        from osimlite.derivatives.outputs import compute_path_columns

        return compute_path_columns(self._packed, self.forces, self._evaluation)

    # ------------------------------------------------------------------------------------------------- files
    def save(self, folder: str | Path, functions: Iterable[str] = FUNCTIONS) -> list[Path]:
        """Write functions into a folder: each as ``NAME.casadi``, and all together as C.

        ``casadi.Function.load`` reads the former without osimlite; ``model.c`` and ``model.h`` need
        only a compiler. ``model.json`` has the names of the states, controls and parameters, and
        their initial values.

        Args:
            folder: folder, which is created.
            functions: names of the functions.

        Returns:
            Paths of the files.

        Raises:
            SettingError: a function does not exist.
            UnsupportedError: the model has paths around surfaces.
        """
        names = [*functions]
        folder = Path(folder)
        if unknown := [name for name in names if name not in FUNCTIONS]:
            raise SettingError(
                f"there is no function '{unknown[0]}'; there are {', '.join(FUNCTIONS)}"
            )
        if self._path_function is not None:
            raise UnsupportedError(
                "paths around surfaces have no formula, so they cannot be written to files; replace them by "
                "polynomials first (osimlite modify --replace paths=polynomial)"
            )
        make_folder(folder)
        paths = []
        generator = self._library.CodeGenerator("model.c", {"with_header": True})
        for name in names:
            function = getattr(self, name)
            paths.append(folder / f"{name}.casadi")
            function.save(str(paths[-1]))
            generator.add(function)
        # CasADi's generator prepends the folder to the file name.
        generator.generate(f"{folder}/")
        facts = {
            "model": self.name,
            "states": self.states,
            "controls": self.controls,
            "parameters": self.parameters,
            "x": self.x.tolist(),
            "p": self.p.tolist(),
            "functions": {name: str(getattr(self, name)) for name in names},
        }
        write_into(folder, "model.json", json.dumps(facts, indent=1) + "\n")
        return [*paths, folder / "model.c", folder / "model.h", folder / "model.json"]
