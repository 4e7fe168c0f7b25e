"""What can be chosen about a simulation."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from osimlite.errors import SettingError
from osimlite.records import dataclass, replace
from osimlite.simulation.elements.gather import OPENSIM
from osimlite.simulation.files.storage import StoTable
from osimlite.simulation.stepper import Progress
from osimlite.text import or_known

PER_RUN = (
    "accuracy",
    "integrator",
    "fixed_step",
    "report_interval",
    "initial",
    "initial_speeds",
    "equilibrate",
    "controls",
    "progress",
)
"""The options of a run; the others are chosen when a model is made ready."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """What can be chosen about a simulation, by keyword arguments of :func:`osimlite.simulate` and `Simulation`.

    Those in `PER_RUN` can be chosen for every run of a `Simulation`.

    Attributes:
        accuracy: of the integrator, with the meaning it has in OpenSim; 0.001 if left out.
        integrator: "merson", whose steps are OpenSim's, if left out; "adams" for smooth motion that is a little stiff,
            as of few muscles; "bdf" for stiff motion, as of many; or "rosenbrock" for stiff motion at loose accuracy.
        fixed_step: take the engine's own steps of this length (s) instead of controlling the error.
        report_interval: time between the recorded moments, s; the last one is the end in any case.
        initial: values (rad, m, or a text such as "40deg") of coordinates by name or path that do not start at their
            default. The path of a state (``/jointset/knee/flexion/speed``, ``/forceset/stop/dissipatedEnergy``) stands
            for what it is in ``states.sto``; what it says of coordinates gives way to locks and constraints. A file of
            states stands for its last row.
        initial_speeds: generalized speeds that do not start at their default, likewise.
        equilibrate: start muscles where fiber and tendon are in equilibrium, as OpenSim's `equilibrateMuscles` does;
            states that `initial` names stay as it says.
        controls: what drives actuators besides the controllers of the model, as a PrescribedController more would: by
            name or path a number, a function of time (s) or ``(times, values)``; or a table of such columns, or its
            file. What nothing drives has a control of 0.
        progress: called with the simulated time reached and the length of the steps there (both in s), after every
            step, or after several that are quick.
        route: how the accelerations are computed: by Bullet's "mass-matrix", which "auto" stands for, or its
            "articulated-body" algorithm.
        skip_unsupported: leave out forces that cannot be computed; the summary lists them.
        simbody_early_return: reproduce a defect of Simbody in contact forces of several surfaces: the first contact
            that separates too fast to push takes the force of those after it.
        own_activation_times: let the activation of every DeGrooteFregly2016Muscle have its own time constants and
            smoothing; OpenSim takes those of the first one for all.
        wrapping: how paths bend around surfaces: as in "opensim", or along a "geodesic": smooth, the shortest way (or
            where a side is asked for at least a stationary one), with all surfaces of a path taken together, so that
            speed and moment arms are derivatives of the length.
        opensim_derivatives: compute two second derivatives, and masses in loops of joints, as OpenSim does, wrong; see
            :func:`osimlite.multibody.build_mechanism`.
        rolling: let every RollingOnSurfaceConstraint act, which OpenSim leaves off until a program turns them on.
        external_loads: a file of ExternalLoads: measured forces over time that act too.
        folder: where the model's file is; files that the model names (of contact meshes) are looked for there. The
            folder that the program runs in if left out.
        show: show the motion in Bullet's window, in real time, and return when it is closed; needs `fixed_step`.
    """

    accuracy: float | None = None
    integrator: str | None = None
    fixed_step: float | None = None
    report_interval: float = 0.01
    initial: Mapping[str, float | str] | str | Path | None = None
    initial_speeds: Mapping[str, float | str] | None = None
    equilibrate: bool = False
    controls: Mapping[str, Any] | StoTable | str | Path | None = None
    progress: Progress | None = None
    route: str = "auto"
    skip_unsupported: bool = False
    simbody_early_return: bool = False
    own_activation_times: bool = False
    wrapping: str = OPENSIM
    opensim_derivatives: bool = False
    rolling: bool = False
    external_loads: str | Path | None = None
    folder: str | Path | None = None
    show: bool = False

    @classmethod
    def of(cls, choices: Mapping[str, Any]) -> Options:
        """Of the keyword arguments that somebody gave.

        Raises:
            SettingError: there is no such option.
        """
        return cls().changed(choices)

    def changed(self, choices: Mapping[str, Any]) -> Options:
        """With other choices; errors as those of `of`."""
        known = [*vars(self)]
        for name in choices:
            if name not in known:
                raise SettingError(f"there is no option '{name}' of a simulation{or_known(name, known)}")
        return replace(self, **choices)

    def for_run(self, choices: Mapping[str, Any]) -> Options:
        """With other choices for one run.

        Raises:
            SettingError: there is no such option, or it is chosen when the model is made ready.
        """
        made = self.changed(choices)
        for name in choices:
            if name not in PER_RUN:
                raise SettingError(
                    f"'{name}' is chosen when a model is made ready: Simulation(model, engine, {name}=...)"
                )
        return made
