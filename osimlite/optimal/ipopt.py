"""Ipopt with a nonlinear program's own derivatives, readable progress and a clean stop on Ctrl-C."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

import numpy as np

from osimlite.base.records import dataclass
from osimlite.derivatives.symbols import casadi, postpone_interrupts
from osimlite.errors import SimulationError
from osimlite.mechanics.multibody.spatial import Array
from osimlite.optimal.hessian import Hessian
from osimlite.optimal.point_functions import cache_last
from osimlite.optimal.program import Program

METIS_MIN_VARIABLES = 1500
"""Number of variables from which METIS saves more time by its order than it takes."""
EXACT_TOLERANCE_FACTOR = 1e-2
"""Factor of a study's tolerance with exact second derivatives: Newton's last steps are few and cheap."""
MIN_TOLERANCE = 1e-8
"""Lower bound of the tolerance that `EXACT_TOLERANCE_FACTOR` leads to; Ipopt's default."""
FEASIBILITY_TOLERANCE = 1e-4
"""Largest violation up to which the iterate with the lower objective is the better one."""


THREADS_VARIABLE = "OPENBLAS_NUM_THREADS"
"""Environment variable that limits the threads of OpenBLAS."""
WARM_START_OPTIONS = {"mu_init": 1e-7, "bound_push": 1e-8, "bound_frac": 1e-8}
"""Ipopt options for a guess near the solution: a small barrier, and no move away from the bounds."""


@dataclass(frozen=True)
class Violation:
    """Violation of a constraint.

    Attributes:
        name: name of the constraint.
        time: time of the point, s; None for a constraint on both ends of the motion.
        size: distance of the value from its bounds.
    """

    name: str
    time: float | None
    size: float

    def __str__(self) -> str:
        time_note = "" if self.time is None else f" at {self.time:.4g} s"
        return f"{self.name}{time_note} ({self.size:.2g})"


@dataclass(frozen=True)
class Progress:
    """State of the search after an iteration.

    Attributes:
        iteration: number of the iteration.
        objective: value of the objective.
        worst: largest violation; None if all constraints hold.
    """

    iteration: int
    objective: float
    worst: Violation | None

    def __str__(self) -> str:
        violation = 0.0 if self.worst is None else self.worst.size
        return (
            f"iteration {self.iteration}, objective {self.objective:.6g}, "
            f"infeasibility {violation:.2g}"
        )


@dataclass(frozen=True, eq=False)
class SolverResult:
    """Result of one Ipopt run.

    Attributes:
        w: variables (n,).
        status: Ipopt's return status.
        success: whether the result is a solution within the tolerances.
        iterations: number of iterations.
        duration: duration of the search, s.
    """

    w: Array
    status: str
    success: bool
    iterations: int
    duration: float


def find_violations(
    program: Program, w: Array, rows: Array | None = None, most: int = 10
) -> list[Violation]:
    """Find the largest violations of the constraints, the largest first.

    Args:
        program: nonlinear program.
        w: variables (n,).
        rows: values of g at `w` (m,); None to compute them.
        most: maximum number of violations.

    Returns:
        Violations of constraints that do not hold.
    """
    rows = program.compute_values(w)[1] if rows is None else rows
    size = np.maximum(np.maximum(program.lower - rows, rows - program.upper), 0.0)
    # NaN would be last in the order; as the largest violation it is reported first.
    size = np.where(np.isfinite(size), size, np.inf)
    result = []
    for row in np.argsort(-size)[:most]:
        if size[row] > 0.0:
            fraction = program.times[row]
            time = None if np.isnan(fraction) else float(w[0] + fraction * (w[1] - w[0]))
            result.append(Violation(program.labels[row], time, float(size[row])))
    return result


def run_ipopt(
    program: Program,
    guess: Array,
    report: Callable[[Progress], None] | None = None,
    *,
    is_warm_start: bool = False,
) -> SolverResult:
    """Minimize the objective of a nonlinear program from a guess.

    An interrupt (Ctrl-C) stops the search after the iteration; the result is then the best iterate.

    Args:
        program: nonlinear program.
        guess: initial variables (n,); those outside their bounds are moved onto them.
        report: function that is called with the progress after each iteration; None for none.
        is_warm_start: whether the guess is nearly a solution, so that Ipopt must not move it off its bounds.

    Returns:
        Variables with Ipopt's status; of a search without success, the best iterate.

    Raises:
        SimulationError: the objective or a constraint is not a number.
    """
    with postpone_interrupts():
        search = _SearchCallbacks(program, report)
        options = _make_solver_options(program, search, is_warm_start=is_warm_start)
    start_time = time.perf_counter()
    with postpone_interrupts():
        _load_ipopt()
        solver = casadi.nlpsol("moco", "ipopt", search.objective, options)
    lower = program.layout.lower
    upper = program.layout.upper
    with search.stop_on_interrupt():
        solution = solver(
            x0=search.scale(np.clip(guess, lower, upper)),
            lbx=search.scale(lower),
            ubx=search.scale(upper),
            lbg=program.lower,
            ubg=program.upper,
        )
    duration = time.perf_counter() - start_time
    stats = solver.stats()
    status = stats["return_status"]
    if not np.isfinite(np.array(solution["f"])).all() or status == "Invalid_Number_Detected":
        raise SimulationError(_describe_invalid_number(program, guess))
    w = search.unscale(np.array(solution["x"]).ravel())
    # The last iterate of an unfinished search is often worse than an earlier one.
    if not stats["success"] and search.best is not None:
        w = search.best
    return SolverResult(w, status, bool(stats["success"]), int(stats["iter_count"]), duration)


@cache
def _load_ipopt() -> None:
    """Load Ipopt with one thread for its BLAS, which reads the number of threads when it is loaded.

    The matrices are small, and sums of one part per core would differ between machines.
    """
    previous_value = os.environ.get(THREADS_VARIABLE)
    os.environ[THREADS_VARIABLE] = previous_value or "1"
    casadi.load_nlpsol("ipopt")
    if previous_value is None:
        del os.environ[THREADS_VARIABLE]


def _make_solver_options(
    program: Program, search: _SearchCallbacks, *, is_warm_start: bool
) -> dict[str, Any]:
    """Return the options of CasADi's solver with the functions of a search."""
    # Without a name Ipopt reads no file of options. By default it reads `ipopt.opt` in the current
    # folder, which may name a file to write to and a library to load.
    options = {
        "ipopt": _make_options(program)
        | (WARM_START_OPTIONS if is_warm_start else {})
        | {"print_level": 0, "sb": "yes", "option_file_name": ""},
        # Values of bad trial points are normal in a line search; progress comes from the callback.
        "print_time": False,
        "show_eval_warnings": False,
        # The multipliers and gradients of the result are not used.
        "no_nlp_grad": True,
        "calc_lam_p": False,
        "calc_lam_x": False,
        "iteration_callback": search.record_iteration,
        "grad_f": search.gradient,
        "jac_g": search.jacobian,
    }
    if _uses_exact_hessian(program):
        options["hess_lag"] = _make_hessian_callback(program, search)
    return options


def _uses_exact_hessian(program: Program) -> bool:
    """Return whether the search uses exact second derivatives.

    Without an objective all multipliers vanish at the solution, and until then second derivatives
    lead the search astray.
    """
    return program.problem.solver.optim_hessian_approximation == "exact" and bool(program.costs)


def _make_options(program: Program) -> dict[str, Any]:
    """Return Ipopt's options: those of Moco, except where a comment says otherwise."""
    settings = program.problem.solver
    options = dict[str, Any]()
    is_exact = _uses_exact_hessian(program)
    options["hessian_approximation"] = "exact" if is_exact else "limited-memory"
    # "extended" takes the same steps, but puts the quasi-Newton update into one larger matrix, instead
    # of a dozen solutions with the smaller one.
    options["limited_memory_aug_solver"] = "extended"
    if len(program.layout.lower) > METIS_MIN_VARIABLES:
        # The order of METIS suits the band over time: half the time of MUMPS's default.
        options["mumps_pivot_order"] = 5
    if settings.optim_max_iterations != -1:
        options["max_iter"] = settings.optim_max_iterations
    if (tolerance := settings.optim_convergence_tolerance) != -1.0:
        prefixes = ("", "dual_inf_", "compl_inf_")
        # Newton's method converges so fast at the end that it would stop where the barrier still costs
        # up to 1e-2 of the objective.
        strict = (
            min(tolerance, max(EXACT_TOLERANCE_FACTOR * tolerance, MIN_TOLERANCE))
            if is_exact
            else tolerance
        )
        options |= {f"{tolerance_prefix}tol": strict for tolerance_prefix in prefixes} | {
            f"acceptable_{tolerance_prefix}tol": tolerance for tolerance_prefix in prefixes
        }
    if (tolerance := settings.optim_constraint_tolerance) != -1.0:
        options |= {f"{prefix}constr_viol_tol": tolerance for prefix in ("", "acceptable_")}
    return options


def _describe_invalid_number(program: Program, guess: Array) -> str:
    """Return the message for an objective or a constraint that is not a number."""
    costs, rows = program.compute_values(guess)
    invalid_names = [program.labels[row] for row in np.flatnonzero(~np.isfinite(rows))[:1]]
    invalid_names += [
        name for name, cost in zip(program.costs, costs, strict=True) if not np.isfinite(cost)
    ]
    description = (
        f"'{invalid_names[0]}' is not a number at the guess"
        if invalid_names
        else "a value is not a number during the search"
    )
    return f"{description}; provide a feasible guess_file, or tighten the bounds"


class _ArrayCallback(casadi.Callback):  # type: ignore[misc]
    """CasADi function that a Python function computes from NumPy arrays.

    Args:
        name: name of the CasADi function.
        inputs: sparsity of each argument by its name.
        outputs: sparsity of each result by its name.
        law: function of one array of nonzeros per argument that returns those of each result.
    """

    def __init__(
        self, name: str, inputs: dict[str, Any], outputs: dict[str, Any], law: Callable[..., Any]
    ) -> None:
        casadi.Callback.__init__(self)
        self._inputs = inputs
        self._outputs = outputs
        self._law = law
        self.construct(name, {})

    def get_n_in(self) -> int:
        return len(self._inputs)

    def get_n_out(self) -> int:
        return len(self._outputs)

    def get_name_in(self, index: int) -> str:
        return [*self._inputs][index]

    def get_name_out(self, index: int) -> str:
        return [*self._outputs][index]

    def get_sparsity_in(self, index: int) -> Any:
        return [*self._inputs.values()][index]

    def get_sparsity_out(self, index: int) -> Any:
        return [*self._outputs.values()][index]

    def has_eval_buffer(self) -> bool:
        return True

    def eval_buffer(self, argument_buffers: Any, results: Any) -> int:
        # CasADi passes None for absent arguments and for results that it does not need.
        arrays = [
            np.zeros(0) if argument is None else np.frombuffer(argument, dtype=float)
            for argument in argument_buffers
        ]
        for buffer, result in zip(results, self._law(*arrays), strict=True):
            if buffer is not None:
                np.frombuffer(buffer, dtype=float)[:] = result
        return 0


def _make_dense_column(size: int) -> Any:
    """Return the sparsity of a dense column."""
    return casadi.Sparsity.dense(size, 1)


class _SearchCallbacks:
    """Functions that Ipopt calls, and the best iterate.

    Ipopt searches for scaled variables x, from which the variables follow as ``w = factors x +
    offsets``.

    Args:
        program: nonlinear program.
        report: function that is called with the progress after each iteration.

    Attributes:
        stops: whether Ipopt stops after the current iteration.
        count: number of iterations so far.
        best: variables w of the best iterate (n,); None before the first iteration.
        factors: factors of the scaling (n,).
        offsets: offsets of the scaling (n,).
        objective: CasADi function of f and g.
        gradient: CasADi function of the gradient of f by x.
        jacobian: CasADi function of the Jacobian of g by x.
        record_iteration: CasADi function that Ipopt calls after each iteration.
    """

    def __init__(self, program: Program, report: Callable[[Progress], None] | None) -> None:
        self.program = program
        self.report = report
        self.stops = False
        self.count = 0
        self.best: Array | None = None
        self._best = (np.inf, np.inf)
        self.factors, self.offsets = program.layout.scaling
        columns = np.array(program.jacobian_sparsity.get_triplet()[1], dtype=int)
        # By the chain rule, a column of the Jacobian by x is that by w times the factor of its
        # variable.
        self._column_factors = self.factors[columns]
        width = len(program.layout.lower)
        rows = len(program.labels)
        inputs = {"x": _make_dense_column(width), "p": casadi.Sparsity(0, 0)}
        sizes = {"f": 1, "x": width, "lam_x": width, "g": rows, "lam_g": rows}
        scalar = casadi.Sparsity.scalar()
        gradient_sparsity = casadi.Sparsity.dense(width, 1)
        # Ipopt evaluates objective and constraints at one x by separate calls.
        self._values_at = cache_last(lambda x: program.compute_values(self.unscale(x)))
        self._slopes_at = cache_last(lambda x: program.compute_slopes(self.unscale(x)))
        self.objective = _ArrayCallback(
            "nlp", inputs, {"f": scalar, "g": _make_dense_column(rows)}, self._compute_values
        )
        self.gradient = _ArrayCallback(
            "nlp_grad_f",
            inputs,
            {"f": scalar, "grad_f_x": gradient_sparsity},
            self._compute_gradient,
        )
        self.jacobian = _ArrayCallback(
            "nlp_jac_g",
            inputs,
            {"g": _make_dense_column(rows), "jac_g_x": program.jacobian_sparsity},
            self._compute_jacobian,
        )
        # CasADi passes all results of its solver to the callback of an iteration, so that it has
        # one argument for each.
        result_names = [casadi.nlpsol_out(index) for index in range(casadi.nlpsol_n_out())]
        outputs = {name: _make_dense_column(sizes.get(name, 0)) for name in result_names}
        self.record_iteration = _ArrayCallback(
            "record_iteration", outputs, {"stops": scalar}, self._record_iteration
        )

    def unscale(self, x: Array) -> Array:
        """Return the variables w of Ipopt's variables x."""
        return self.factors * x + self.offsets

    def scale(self, w: Array) -> Array:
        """Return Ipopt's variables x of the variables w."""
        return (w - self.offsets) / self.factors

    def _compute_values(self, x: Array, *_: Array) -> tuple[Any, ...]:
        costs, rows = self._values_at(x)
        return costs.sum(), rows

    # The first result of CasADi's signature is f again, or g below: Ipopt gets both from `objective`.
    def _compute_gradient(self, x: Array, *_: Array) -> tuple[Any, ...]:
        return 0.0, self._slopes_at(x)[0] * self.factors

    def _compute_jacobian(self, x: Array, *_: Array) -> tuple[Any, ...]:
        return 0.0, self._slopes_at(x)[1] * self._column_factors

    # ---------------------------------------------------------------------------------------- after an iteration
    def _record_iteration(self, x: Array, f: Array, rows: Array, *_: Array) -> tuple[Any, ...]:
        """Store the best iterate, report the progress, and return whether Ipopt is to stop.

        Args:
            x: scaled variables (n,).
            f: objective (1,).
            rows: values of g (m,).

        Returns:
            1 to stop the search, else 0.
        """
        # The callback gets the values at the accepted iterate, which need no further evaluation.
        objective = float(f[0])
        largest_violations = find_violations(self.program, self.unscale(x), rows, most=1)
        size = largest_violations[0].size if largest_violations else 0.0
        # Among feasible iterates the objective decides, among others the violation.
        rank = (size, np.inf) if size > FEASIBILITY_TOLERANCE else (0.0, objective)
        if rank < self._best:
            self.best = self.unscale(x)
            self._best = rank
        if self.report is not None:
            self.report(
                Progress(
                    self.count, objective, largest_violations[0] if largest_violations else None
                )
            )
        self.count += 1
        return (1.0 if self.stops else 0.0,)

    @contextmanager
    def stop_on_interrupt(self) -> Iterator[None]:
        """Let the first Ctrl-C stop the search after the iteration, and the second at once."""
        # Python allows handlers of signals in the main thread only.
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        # Python only delivers signals between its own instructions, and Ipopt calls Python in each
        # iteration.
        previous_handler = signal.getsignal(signal.SIGINT)

        def stop(*_: Any) -> None:
            self.stops = True
            signal.signal(signal.SIGINT, previous_handler)

        signal.signal(signal.SIGINT, stop)
        try:
            yield
        finally:
            signal.signal(signal.SIGINT, previous_handler)


def _make_hessian_callback(program: Program, search: _SearchCallbacks) -> Any:
    """Return the CasADi function of the Hessian of the Lagrangian by the scaled variables, upper triangle."""
    hessian = Hessian(program)
    row_factors, column_factors = (
        search.factors[np.array(indices, dtype=int)] for indices in hessian.sparsity.get_triplet()
    )
    # Names and order of these arguments are CasADi's signature of the function hess_lag.
    inputs = {
        "x": _make_dense_column(len(program.layout.lower)),
        "p": casadi.Sparsity(0, 0),
        "lam_f": casadi.Sparsity.scalar(),
        "lam_g": _make_dense_column(len(program.labels)),
    }

    def compute_hessian(x: Array, *multiplier_arguments: Array) -> tuple[Any, ...]:
        return (
            hessian.compute_entries(
                search.unscale(x), float(multiplier_arguments[-2][0]), multiplier_arguments[-1]
            )
            * row_factors
            * column_factors,
        )

    return _ArrayCallback(
        "nlp_hess_l", inputs, {"hess_gamma_x_x": hessian.sparsity}, compute_hessian
    )
