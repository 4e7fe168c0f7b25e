"""Options of a simulation, their defaults, and the checks of their values.

An option is declared once, as an attribute of :class:`Options`: the library, the commands and the
manual read it there.
"""

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


MERSON = "merson"
"""Name of the default integrator."""
INTEGRATORS = {
    MERSON: "RungeKuttaMerson",
    "euler2": "SemiExplicitEuler2",
    "adams": "Adams",
    "bdf": "BDF",
    "rosenbrock": "Rosenbrock",
}
"""Integrators with error control: the method's class name by the option's value, which is also the name of the kernel.

The first two are Simbody's (OpenSim uses RungeKuttaMerson), the other three are for stiff or smooth
motions.
"""

DEFAULT_ACCURACY = 1e-3
"""Accuracy of OpenSim's Manager where none is set."""
LOOSEST_SOUND_ACCURACY = 1e-2
"""Loosest accuracy at which motions stay near the exact solution; looser ones cause a warning.

At this accuracy the walker ends within 0.01 rad of the exact motion after one second, with every
integrator. At 0.1 it is 0.05 rad off with Rosenbrock's method and 0.07 rad with Merson's.
"""

INITIAL_STEP_S = 0.01
"""First step that an integrator tries, s: a tenth of Simbody's default time scale."""
UNBOUNDED_STEPS = 0.0, inf
"""Shortest and longest step (s) where the options set none."""
BOUNDED_INTEGRATORS = (MERSON, "euler2")
"""Integrators that observe `step_bounds`; the others choose their steps without limits."""


def check_integrator(name: str) -> None:
    """Check the name of an integrator.

    Raises:
        SettingError: there is no integrator of that name.
    """
    if name not in INTEGRATORS:
        raise SettingError(f"there is no integrator '{name}'{suggest_or_list(name, INTEGRATORS)}")


@dataclass(frozen=True, kw_only=True)
class IntegrationOptions:
    """Options of integrators with error control, declared once for all that integrate motions.

    The records of simulations, batches, sweeps and learning tasks extend this one, and hand its
    options on with :meth:`integration_choices`. A new option of the integrator is therefore one
    attribute here, and its use: `BatchWorkspace` of `simulation/engines/batch.py` hands numbers to
    the kernels, for single motions too. The first step is chosen by :attr:`initial_step`. An
    attribute with a help text is an option of the commands too.
    """

    accuracy: float = define_option(
        DEFAULT_ACCURACY,
        "Integrator accuracy, as in OpenSim.",
        default_text="0.001",
        more="The default is 0.001.",
        type=float | None,
    )
    integrator: str = define_option(
        MERSON,
        "'merson' (OpenSim's), 'euler2' (SCONE's), 'adams' for smooth motions (few muscles), 'bdf' for stiff motions "
        "(many muscles), or 'rosenbrock' for stiff motions at loose accuracy.",
        default_text="merson",
        type=str | None,
    )
    step_bounds: tuple[float, float] = define_option(
        UNBOUNDED_STEPS,
        more="shortest and longest step of 'merson' and 'euler2', s. A step of the shortest length is accepted "
        "even if its error is too large.",
    )

    @property
    def initial_step(self) -> float:
        """First step that the integrator tries, s; within `step_bounds`."""
        shortest, longest = self.step_bounds
        return min(max(INITIAL_STEP_S, shortest), longest)

    def integration_choices(self) -> dict[str, Any]:
        """Return the values of the integration options, as keyword arguments for another record.

        Returns:
            Values by the names of the options.
        """
        return {name: getattr(self, name) for name in INTEGRATION_OPTIONS}

    def summarize_choices(self) -> dict[str, Any]:
        """Return the entries of a summary about the integration.

        They are accuracy, integrator, and all options that differ from their defaults.

        Returns:
            Values by name of the option.
        """
        return {
            name: getattr(self, name)
            for name, declared in INTEGRATION_OPTIONS.items()
            # These two are always of interest to readers of results; others only if someone has
            # changed them.
            if name in ("accuracy", "integrator") or getattr(self, name) != declared.default
        }

    def check_integration(self) -> None:
        """Check the values, since machine code might never end with wrong ones.

        Raises:
            SettingError: a value has no meaning.
        """
        if not 0.0 < self.accuracy < 1.0:
            raise SettingError(f"the accuracy must lie between 0 and 1; {self.accuracy} does not")
        check_integrator(self.integrator)
        # An ignored option would look as if it had an effect.
        if self.step_bounds != UNBOUNDED_STEPS and self.integrator not in BOUNDED_INTEGRATORS:
            raise SettingError(
                f"`step_bounds` has no effect on the steps of '{self.integrator}'; leave it out, or select the integrator "
                f"{' or '.join(BOUNDED_INTEGRATORS)}"
            )
        shortest, longest = self.step_bounds
        if not (0.0 <= shortest <= longest and longest > 0.0):
            raise SettingError(
                f"steps cannot last from {shortest:g} s to {longest:g} s; the shortest step is at least 0, and the "
                "longest is positive and not shorter"
            )


INTEGRATION_OPTIONS: dict[str, Any] = IntegrationOptions.__record_fields__  # type: ignore[attr-defined]
"""Declarations of the integration options, by name."""

RUN_OPTIONS = (
    *INTEGRATION_OPTIONS,
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
"""Options that may differ between the runs of one `Simulation`; the others belong to the prepared model."""


@dataclass(frozen=True, kw_only=True)
class Options(IntegrationOptions):
    """Options of :func:`osimlite.simulate` and :class:`Simulation`, given as keyword arguments.

    Those in `RUN_OPTIONS` may differ between the runs of a `Simulation`. An attribute with a help
    text is an option of ``osimlite simulate`` too.
    """

    fixed_step: float | None = define_option(
        None,
        "Use fixed steps (semi-implicit Euler), without error control.",
        unit="SECONDS",
        more="The value is the size of these steps, s.",
    )
    report_interval: float = define_option(
        0.01,
        "Time between the rows of the result files.",
        unit="SECONDS",
        more="The value is in s; the end of the motion is always recorded.",
    )
    initial: Mapping[str, float | str] | str | Path | None = define_option(
        None,
        more='initial values of coordinates by name or path (rad, m, or a text such as "40deg"); the others start at '
        "their default. Keys may also be paths of states, as in ``states.sto`` (``/jointset/knee/flexion/speed``, "
        "``/forceset/stop/dissipatedEnergy``); locks and constraints change such values of coordinates. From a file of "
        "states the last row is used.",
    )
    initial_speeds: Mapping[str, float | str] | None = define_option(
        None, more="initial generalized speeds by name or path; the others start at their default."
    )
    equilibrate: bool = define_option(
        False,
        "Start muscles in equilibrium of fibers and tendon.",
        more="It works as OpenSim's `equilibrateMuscles`, but states that `initial` sets do not change.",
    )
    controls: Mapping[str, Any] | StoTable | str | Path | None = define_option(
        None,
        more="controls of actuators, which are added to those of the model's controllers, like another "
        "PrescribedController: by name or path of the actuator a number, a function of time (s) or ``(times, values)``; "
        "or a table with these columns, or its file. An actuator without any control has the control 0.",
    )
    controller: Controller | None = define_option(
        None,
        more="feedback from sensors, which is added to the other controls: :class:`osimlite.Feedback`. It needs an "
        "integrator with error control, not `fixed_step`.",
    )
    resume: Trajectory | str | Path | None = define_option(
        None,
        "Continue an earlier simulation, from the folder with its results.",
        unit="FOLDER",
        type=Path | None,
        more="The value may also be its trajectory. The time continues, too. If the earlier simulation had a controller and "
        "ended at a control step, the result is equal to that of an uninterrupted simulation to the last bit.",
    )
    progress: Progress | None = define_option(
        None,
        more="function that is called with the simulated time and the step size (both in s) after every step, or after "
        "several quick steps.",
    )
    route: str = define_option(
        "auto",
        more='algorithm of the engine "bullet" for accelerations: "mass-matrix" or "articulated-body". "auto" selects '
        '"mass-matrix", but "articulated-body" for a model that allows it and has an inertia that no body can have.',
    )
    wrapping: str = define_option(
        "opensim",
        "Wrapping of paths: 'opensim', or 'geodesic' (along the shortest curves).",
        more="With 'geodesic' all surfaces of a path are solved together, so that speed and moment arms are derivatives "
        "of the length. If a wrap prescribes a side (quadrant), the curve is a geodesic, but may not be the shortest.",
    )
    skip_unsupported: bool = define_option(
        False, "Leave out forces that osimlite cannot compute.", more="The summary lists them."
    )
    opensim_derivatives: bool = define_option(
        False,
        "Repeat OpenSim's errors in the equations of joints that rotate about several axes.",
        more="OpenSim computes two second derivatives incorrectly there; see "
        ":func:`osimlite.mechanics.multibody.build_mechanism`.",
    )
    rolling: bool = define_option(
        False,
        "Turn on rolling constraints, which OpenSim leaves off.",
        more="In OpenSim only a program can turn them on.",
    )
    external_loads: str | Path | None = define_option(
        None,
        "Measured forces to apply: a file of ExternalLoads.",
        unit="FILE",
        type=Path | None,
    )
    simbody_early_return: bool = define_option(
        False,
        more="reproduce an error of Simbody in contact forces of several surfaces: after the first contact whose "
        "surfaces separate so fast that its force would be negative, all later contacts of the force get no force.",
    )
    own_activation_times: bool = define_option(
        False,
        more="use the activation time constants and the smoothing of each DeGrooteFregly2016Muscle; OpenSim uses those "
        "of the first muscle for all.",
    )
    folder: str | Path | None = define_option(
        None,
        more="folder of the model's file, in which files are searched that the model names (contact meshes). The "
        "default is the current folder.",
    )
    show: bool = define_option(
        False,
        more="show the motion in Bullet's window, in real time, and return when it is closed; needs `fixed_step`.",
    )

    @classmethod
    def parse(cls, choices: Mapping[str, Any]) -> Options:
        """Return the options that keyword arguments set, with defaults for the others.

        Raises:
            SettingError: a keyword is not an option.
        """
        return cls().change_options(choices)

    def change_options(self, choices: Mapping[str, Any]) -> Options:
        """Return a copy in which keyword arguments replace some options.

        None stands for the default of an integration option.

        Raises:
            SettingError: a keyword is not an option, or integration options meet a fixed step.
        """
        if not choices:
            return self
        option_names = [*vars(self)]
        for name in choices:
            if name not in option_names:
                raise SettingError(
                    f"there is no option '{name}' of a simulation{suggest_or_list(name, option_names)}"
                )
        integration = {
            name: choices[name] for name in INTEGRATION_OPTIONS if choices.get(name) is not None
        }
        # None stands for the default.
        defaults = {
            name: INTEGRATION_OPTIONS[name].default
            for name in choices
            if name in INTEGRATION_OPTIONS
        }
        changed = replace(self, **{**choices, **defaults, **integration})
        if changed.fixed_step is not None:
            # Only these keywords tell a requested value from an equal default.
            for name, declared in INTEGRATION_OPTIONS.items():
                if name in integration or getattr(changed, name) != declared.default:
                    raise SettingError(
                        f"`{name}` cannot be combined with `fixed_step`, which has no error control; leave one of "
                        "them out"
                    )
        return changed

    def override_for_run(self, choices: Mapping[str, Any]) -> Options:
        """Return a copy in which keyword arguments replace options for one run.

        Raises:
            SettingError: a keyword is not an option, or it belongs to the prepared model.
        """
        options = self.change_options(choices)
        for name in choices:
            if name not in RUN_OPTIONS:
                raise SettingError(
                    f"'{name}' belongs to the prepared model; pass it to Simulation(model, engine, {name}=...)"
                )
        return options


Options.__doc__ = f"{Options.__doc__}\n    Attributes:\n{describe_options(Options)}\n    "


MAX_FIXED_STEPS = 1_000_000_000
"""Largest number of fixed steps of a run, which take hours to days."""

MAX_FIXED_STEP_S = 0.1
"""Longest fixed step, s. Motions of bodies need about 0.001 s; MuJoCo's default is 0.002 s."""


def _is_number(value: object) -> bool:
    """Return whether a value is a real number; callers without a type checker may pass anything."""
    # A bool is a Real too, and harmless.
    return isinstance(value, Real)


def check_fixed_step(h: float, end: float) -> None:
    """Check the length of fixed steps.

    Args:
        h: step, s.
        end: end of the motion, s.

    Raises:
        SettingError: the step is not positive and finite, is longer than `MAX_FIXED_STEP_S`, or
            there are too many steps.
    """
    if not (_is_number(h) and isfinite(h) and h > 0.0):
        raise SettingError(f"the fixed step is a positive and finite number of seconds, not {h!r}")
    if h > MAX_FIXED_STEP_S:
        raise SettingError(
            f"a fixed step of {h:g} s is too long for the motion of bodies; use at most {MAX_FIXED_STEP_S:g} s, with "
            "contacts about 0.001 s"
        )
    if h * MAX_FIXED_STEPS < end:
        raise SettingError(
            f"{end:g} s in fixed steps of {h:g} s are more than a billion steps; use longer ones"
        )


def compute_report_times(end: float, interval: float, start: float = 0.0) -> list[float]:
    """Return the times of the rows of the results.

    Args:
        end: end of the motion, s.
        interval: time between rows, s.
        start: start of the motion, s.

    Returns:
        The start, the multiples of the interval after it, and the end, s.

    Raises:
        SettingError: a time is not a number, the motion does not end after its start, or there are
            too many rows.
    """
    for number in (end, interval):
        if not _is_number(number):
            raise SettingError(f"a time is a number of seconds, not {number!r}")
    if not (isfinite(end) and end > start):
        expected = "positive" if start == 0.0 else f"later than its start, {start:g} s"
        raise SettingError(f"the end time of a simulation must be {expected}, found {end:g} s")
    if not (isfinite(interval) and interval > 0.0):
        raise SettingError(f"the report interval must be positive, found {interval:g} s")
    # Ten million rows fill the memory.
    if end / interval > 1e7:
        raise SettingError(
            f"a report every {interval:g} s makes more than ten million rows; use a longer interval"
        )
    # Multiples instead of sums, so that rounding errors do not accumulate.
    times = [number * interval for number in range(floor(end / interval) + 1)]
    # A last time that differs from `to` by rounding only is `to`.
    if end - times[-1] <= 1e-9 * interval:
        times.pop()
    if start > 0.0:
        times = [start, *(time for time in times if time - start > 1e-9 * interval)]
    return [*times, end]
