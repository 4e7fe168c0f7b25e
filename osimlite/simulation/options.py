"""What can be chosen about a simulation."""

from __future__ import annotations

from collections.abc import Mapping
from math import floor, inf, isfinite
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, Any

from osimlite.base.options import define_option, describe_options
from osimlite.base.records import dataclass, replace
from osimlite.base.text import suggest_or_list
from osimlite.errors import SettingError

if TYPE_CHECKING:
    from osimlite.io.tables.storage import StoTable
    from osimlite.simulation.control_steps import Controller
    from osimlite.simulation.stepper import Progress
    from osimlite.simulation.trajectory import Trajectory


PER_RUN = (
    "accuracy",
    "integrator",
    "fixed_step",
    "report_interval",
    "initial",
    "initial_speeds",
    "equilibrate",
    "controls",
    "controller",
    "resume",
    "progress",
)
"""The options of a run; the others are chosen when a model is made ready."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """What can be chosen about a simulation, by keyword arguments of :func:`osimlite.simulate` and `Simulation`.

    Those in `PER_RUN` can be chosen for every run of a `Simulation`. What has a help is an option
    of ``osimlite simulate`` too.
    """

    accuracy: float | None = define_option(
        None, "Integrator accuracy, as in OpenSim.", shown="0.001", more="0.001 if left out."
    )
    integrator: str | None = define_option(
        None,
        "'merson', whose steps are OpenSim's; 'euler2', whose steps are SCONE's; 'adams' for smooth motion, as of few "
        "muscles; 'bdf' for stiff motion, as of many; 'rosenbrock' for stiff motion at loose accuracy.",
        shown="merson",
    )
    fixed_step: float | None = define_option(
        None,
        "Use fixed steps (semi-implicit Euler), without error control.",
        unit="SECONDS",
        more="They are the engine's own, s.",
    )
    report_interval: float = define_option(
        0.01,
        "Time between the rows of the result files.",
        unit="SECONDS",
        more="The recorded moments are so far apart, s; the last one is the end in any case.",
    )
    initial: Mapping[str, float | str] | str | Path | None = define_option(
        None,
        more='values (rad, m, or a text such as "40deg") of coordinates by name or path that do not start at their '
        "default. The path of a state (``/jointset/knee/flexion/speed``, ``/forceset/stop/dissipatedEnergy``) stands "
        "for what it is in ``states.sto``; what it says of coordinates gives way to locks and constraints. A file of "
        "states stands for its last row.",
    )
    initial_speeds: Mapping[str, float | str] | None = define_option(
        None, more="generalized speeds that do not start at their default, likewise."
    )
    equilibrate: bool = define_option(
        False,
        "Start muscles in equilibrium of fibers and tendon.",
        more="So does OpenSim's `equilibrateMuscles`; states that `initial` names stay as it says.",
    )
    controls: Mapping[str, Any] | StoTable | str | Path | None = define_option(
        None,
        more="what drives actuators besides the controllers of the model, as a PrescribedController more would: by "
        "name or path a number, a function of time (s) or ``(times, values)``; or a table of such columns, or its "
        "file. What nothing drives has a control of 0.",
    )
    controller: Controller | None = define_option(
        None,
        more="what drives actuators by what it feels, beside all else that does: :class:`osimlite.Feedback`. Steps are "
        "those of an integrator.",
    )
    resume: Trajectory | str | Path | None = define_option(
        None,
        "Continue an earlier simulation, from the folder with its results.",
        unit="FOLDER",
        type=Path | None,
        more="Or the trajectory of one; the time goes on, too. With a controller that began a control step there, to "
        "the last bit as if it had not ended.",
    )
    progress: Progress | None = define_option(
        None,
        more="called with the simulated time reached and the length of the steps there (both in s), after every step, "
        "or after several that are quick.",
    )
    route: str = define_option(
        "auto",
        more='how the accelerations are computed: by Bullet\'s "mass-matrix", which "auto" stands for, or its '
        '"articulated-body" algorithm.',
    )
    wrapping: str = define_option(
        "opensim",
        "How paths wrap around surfaces: 'opensim', as in OpenSim; 'geodesic', smoothly along shortest curves.",
        more="Along a geodesic (where a side is asked for at least a stationary one), all surfaces of a path are taken "
        "together, so that speed and moment arms are derivatives of the length.",
    )
    skip_unsupported: bool = define_option(
        False, "Leave out unsupported forces.", more="The summary lists them."
    )
    opensim_derivatives: bool = define_option(
        False,
        "Repeat OpenSim's errors in joints that rotate about several axes.",
        more="Two second derivatives there are wrong; see :func:`osimlite.mechanics.multibody.build_mechanism`.",
    )
    rolling: bool = define_option(
        False,
        "Turn on rolling constraints, which OpenSim leaves off.",
        more="So they are until a program turns them on.",
    )
    external_loads: str | Path | None = define_option(
        None,
        "Measured forces to apply: a file of ExternalLoads.",
        unit="FILE",
        type=Path | None,
    )
    simbody_early_return: bool = define_option(
        False,
        more="reproduce a defect of Simbody in contact forces of several surfaces: the first contact that separates "
        "too fast to push takes the force of those after it.",
    )
    own_activation_times: bool = define_option(
        False,
        more="let the activation of every DeGrooteFregly2016Muscle have its own time constants and smoothing; OpenSim "
        "takes those of the first one for all.",
    )
    folder: str | Path | None = define_option(
        None,
        more="where the model's file is; files that the model names (of contact meshes) are looked for there. The "
        "folder that the program runs in if left out.",
    )
    show: bool = define_option(
        False,
        more="show the motion in Bullet's window, in real time, and return when it is closed; needs `fixed_step`.",
    )

    @classmethod
    def of(cls, choices: Mapping[str, Any]) -> Options:
        """Of the keyword arguments that somebody gave.

        Raises:
            SettingError: there is no such option.
        """
        return cls().changed(choices)

    def changed(self, choices: Mapping[str, Any]) -> Options:
        """With other choices; errors as those of `of`."""
        if not choices:
            return self
        known = [*vars(self)]
        for name in choices:
            if name not in known:
                raise SettingError(
                    f"there is no option '{name}' of a simulation{suggest_or_list(name, known)}"
                )
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


Options.__doc__ = f"{Options.__doc__}\n    Attributes:\n{describe_options(Options)}\n    "


MOST_STEPS = 1_000_000_000
"""Of a fixed length, which take hours to days."""

LONGEST_STEP = 0.1
"""A longer fixed step (s) follows no motion of bodies: a thousandth is usual, and MuJoCo takes 0.002 by itself."""


def _is_number(value: object) -> bool:
    """Whether it is a number: not every caller checks types."""
    return isinstance(value, Real)


def check_step(h: float, to: float) -> None:
    """SettingError for a fixed step h that means nothing for a motion up to a time, both in s."""
    if not (_is_number(h) and isfinite(h) and h > 0.0):
        raise SettingError(f"the fixed step is a positive and finite number of seconds, not {h!r}")
    if h > LONGEST_STEP:
        raise SettingError(
            f"a fixed step of {h:g} s is too long for any motion of bodies; take at most {LONGEST_STEP:g} s, with "
            "contacts about 0.001 s"
        )
    if h * MOST_STEPS < to:
        raise SettingError(
            f"{to:g} s in fixed steps of {h:g} s are more than a thousand million; take longer steps"
        )


def report_times(to: float, interval: float, start: float = 0.0) -> list[float]:
    """`start`, those of interval, 2 interval ... after it, and `to` (s).

    Raises:
        SimulationError: a number has no meaning.
    """
    for number in (to, interval):
        if not _is_number(number):
            raise SettingError(f"a time is a number of seconds, not {number!r}")
    if not (isfinite(to) and to > start):
        told = "for a positive time, not" if start == 0.0 else f"from {start:g} s on, and not to"
        raise SettingError(f"a simulation goes on {told} {to:g} s")
    if not (isfinite(interval) and interval > 0.0):
        raise SettingError(f"the report interval is a positive time, not {interval:g} s")
    if to / interval > 1e7:
        raise SettingError(
            f"a report every {interval:g} s makes more than ten million rows; take a longer interval"
        )
    times = [number * interval for number in range(floor(to / interval) + 1)]
    # A last moment that differs from `to` only by rounding is `to`.
    if to - times[-1] <= 1e-9 * interval:
        times.pop()
    if start > 0.0:
        times = [start, *(time for time in times if time - start > 1e-9 * interval)]
    return [*times, to]


MERSON = "merson"
INTEGRATORS = {
    MERSON: "RungeKuttaMerson",
    "euler2": "SemiExplicitEuler2",
    "adams": "Adams",
    "bdf": "BDF",
    "rosenbrock": "Rosenbrock",
}
"""The integrators with error control by the names that users give, which their kernels have, with
their own names: two of Simbody's, of which OpenSim takes the first, and those for stiff motion.
"""

DEFAULT_ACCURACY = 1e-3
LOOSE = 1e-2
"""The loosest accuracy that keeps motions near the model's own.

The walker ends within 0.01 rad of it after a second, by every integrator; at 0.1 it is 0.05 rad off
by Rosenbrock's method and 0.07 by Merson's.
"""
"""What OpenSim's Manager uses where no accuracy was set."""

INITIAL_STEP = 0.01
"""First step tried, s: a tenth of Simbody's default time scale."""
NO_BOUNDS = 0.0, inf
"""Of the lengths of steps, s."""


def check_integrator(name: str) -> None:
    """SettingError if there is no such integrator."""
    if name not in INTEGRATORS:
        raise SettingError(f"there is no integrator '{name}'{suggest_or_list(name, INTEGRATORS)}")
