"""Tests of minimal effort with equations and bounds, against other programs on random problems."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.random import Generator, default_rng

from osimlite.mechanics.kernels.effort import effort_size
from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.engines.linking import PYTHON_CODE, Code, select_code
from osimlite.simulation.static_optimization import minimize_effort

optimize: Any = pytest.importorskip("scipy.optimize", reason="needs scipy (extra 'sweep')")


def solved(
    columns: Array,
    wanted: Array,
    low: Array,
    high: Array,
    power: float = 2.0,
    code: Code | None = None,
) -> tuple[Array, Array, Array]:
    """Run the kernel `least_effort`.

    Args:
        columns: transposed equation matrices (t, n, m).
        wanted: right-hand sides (t, m).
        low: lower bounds (n,).
        high: upper bounds (n,).
        power: exponent of the effort.
        code: source of the kernel; by default the best one.

    Returns:
        Unknowns (t, n), residuals (t, m), and 1 for each solved frame (t,).
    """
    frames, n, m = columns.shape
    sizes = np.array([frames, m, n, *[0] * (n * (m + 1))], dtype=np.int64)
    given = np.hstack([columns.reshape(frames, -1), wanted])
    result = np.zeros((frames, n + m + 1))
    code = code or select_code()
    code.make_ready(("least_effort",))
    numbers = np.concatenate([[power], low, high])
    code.get_entry("least_effort")(sizes, numbers, given, result, np.zeros(effort_size(m, n)))
    return result[:, :n], result[:, n:-1], result[:, -1]


def problem(
    random: Generator, m: int, n: int, frames: int = 1
) -> tuple[Array, Array, Array, Array]:
    """Return a random problem that has a solution.

    Args:
        random: source of random numbers.
        m: number of equations.
        n: number of unknowns.
        frames: number of frames.

    Returns:
        Transposed matrices (frames, n, m), right-hand sides (frames, m), and lower and upper bounds
        (n,), some of them infinite.
    """
    columns = random.normal(size=(frames, n, m)) * (random.random((frames, n, m)) < 0.6)
    low, high = -random.random(n), random.random(n)
    low[::4], high[::4] = -np.inf, np.inf
    low[1::4] = 0.01
    high[1::4] = 1.0
    within = random.uniform(np.maximum(low, -1.0), np.minimum(high, 1.0), size=(frames, n))
    return columns, np.einsum("tnm,tn->tm", columns, within), low, high


def test_frames_in_several_calls_give_what_one_call_gives() -> None:
    """Each frame starts from the solution of the previous one, even if a call of the kernel ended in between."""
    columns, wanted, low, high = problem(default_rng(5), 4, 9, frames=40)
    wanted[11] *= 100.0
    for power in (2.0, 3.0):
        x, missing, flags = minimize_effort(columns, wanted, power, np.array([low, high]))
        alone, lacking, is_solved = solved(columns, wanted, low, high, power)
        assert np.array_equal(x, alone)
        assert np.array_equal(missing, lacking)
        assert flags.tolist() == (is_solved == 1.0).tolist()
        assert not flags[11]


def test_weak_ones_give_what_full_ones_leave() -> None:
    """The problem has reserves of 1 N m and muscles with little freedom, from a window of CMC in a public walk."""
    with np.load(Path(__file__).with_name("full_muscles.npz")) as given:
        columns, wanted, (low, high) = given["columns"], given["wanted"], given["bounds"]
    (x,), _, (is_solved,) = solved(columns[None], wanted[None], low, high)
    assert is_solved
    assert np.max(np.abs(x @ columns - wanted) / (np.abs(x) @ np.abs(columns))) < 1e-10
    # The value comes from a prototype with another algorithm.
    assert x @ x == pytest.approx(648.4029065353637, rel=1e-9)


def test_the_quadratic_problem() -> None:
    random = default_rng(3)
    for _ in range(30):
        m = int(random.integers(1, 12))
        n = int(random.integers(m, 3 * m + 5))
        columns, wanted, low, high = problem(random, m, n)
        (x,), (missing,), (is_solved,) = solved(columns, wanted, low, high)
        assert is_solved
        assert x @ columns[0] == pytest.approx(wanted[0], abs=1e-11)
        assert missing == pytest.approx(0.0, abs=1e-11)
        assert (low <= x).all()
        assert (x <= high).all()
        # At the minimum, free unknowns follow from multipliers of the equations; at bounds these
        # point outwards.
        free = (low < x) & (x < high)
        push, *_ = np.linalg.lstsq(columns[0][free], x[free], rcond=None)
        pulled = columns[0] @ push
        assert pulled[free] == pytest.approx(x[free], abs=1e-8)
        rest = ~free
        if np.linalg.matrix_rank(columns[0][free]) == m:
            assert (
                np.where(
                    x[rest] == low[rest],
                    pulled[rest] <= low[rest] + 1e-8,
                    pulled[rest] >= high[rest] - 1e-8,
                )
            ).all()


def by_others(
    columns: Array, wanted: Array, low: Array, high: Array, power: float, start: Array
) -> float:
    """Return the minimum that SciPy's SLSQP finds, or infinity if it fails."""
    result = optimize.minimize(
        lambda x: np.sum(np.abs(x) ** power),
        start,
        jac=lambda x: power * np.sign(x) * np.abs(x) ** (power - 1.0),
        bounds=list(zip(low, high, strict=True)),
        constraints={
            "type": "eq",
            "fun": lambda x: x @ columns - wanted,
            "jac": lambda x: columns.T,
        },
        method="SLSQP",
        options={"maxiter": 500, "ftol": 1e-14},
    )
    return float(result.fun) if result.success else np.inf


@pytest.mark.parametrize("power", [1.5, 2.0, 3.0, 4.0, 10.0])
def test_other_powers(power: float) -> None:
    random = default_rng(5)
    for _ in range(10):
        m = int(random.integers(1, 6))
        columns, wanted, low, high = problem(random, m, 2 * m + 3)
        (x,), _, (is_solved,) = solved(columns, wanted, low, high, power)
        assert is_solved
        assert x @ columns[0] == pytest.approx(wanted[0], abs=1e-9)
        start = np.clip(x + 0.05 * random.normal(size=len(x)), low, high)
        other = by_others(columns[0], wanted[0], low, high, power, start)
        assert np.sum(np.abs(x) ** power) <= other + 1e-7 * max(1.0, other)


def test_frames_that_follow_one_another_are_as_alone() -> None:
    columns, wanted, low, high = problem(default_rng(7), 6, 15, frames=20)
    together, _, _ = solved(columns, wanted, low, high)
    alone = [solved(columns[[k]], wanted[[k]], low, high)[0][0] for k in range(20)]
    assert together == pytest.approx(np.array(alone), abs=1e-11)


def test_equations_that_repeat_each_other() -> None:
    columns, wanted, low, high = problem(default_rng(8), 4, 12)
    alone, _, _ = solved(columns, wanted, low, high)
    twice = np.concatenate([columns, 3.0 * columns], axis=2), np.hstack([wanted, 3.0 * wanted])
    (x,), _, (is_solved,) = solved(*twice, low, high)
    assert is_solved
    assert x == pytest.approx(alone[0], abs=1e-9)


def test_what_is_missing_where_there_is_no_solution() -> None:
    random = default_rng(9)
    for _ in range(20):
        m = int(random.integers(1, 6))
        columns, _, low, high = problem(random, m, 2 * m + 2)
        low, high = np.maximum(low, -1.0), np.minimum(high, 1.0)
        wanted = 100.0 * random.normal(size=(1, m))
        _, (missing,), (is_solved,) = solved(columns, wanted, low, high)
        assert not is_solved
        scale = np.linalg.norm(columns[0], axis=0)
        nearest = optimize.lsq_linear(
            columns[0].T / scale[:, None], wanted[0] / scale, (low, high), tol=1e-12
        )
        assert missing / scale == pytest.approx(-nearest.fun, abs=1e-4 * np.abs(nearest.fun).max())


def test_one_after_the_other_a_solution_and_none() -> None:
    columns, wanted, low, high = problem(default_rng(10), 5, 12, frames=3)
    low, high = np.maximum(low, -1.0), np.minimum(high, 1.0)
    wanted[1] = 1000.0
    x, _, is_solved = solved(columns, wanted, low, high)
    assert is_solved.tolist() == [1.0, 0.0, 1.0]
    assert x[2] == pytest.approx(solved(columns[[2]], wanted[[2]], low, high)[0][0], abs=1e-11)


def test_entries_that_are_rounding_errors_are_none() -> None:
    columns, wanted, low, high = problem(default_rng(12), 3, 8)
    noise = 1e-15 * default_rng(13).normal(size=(1, 8, 1))
    x, (missing,), (is_solved,) = solved(
        np.concatenate([columns, noise], axis=2), np.hstack([wanted, [[5.0]]]), low, high
    )
    assert not is_solved
    assert missing == pytest.approx([0.0, 0.0, 0.0, 5.0], abs=1e-9)
    assert x == pytest.approx(solved(columns, wanted, low, high)[0], abs=1e-7)


def test_python_does_the_same() -> None:
    columns, wanted, low, high = problem(default_rng(11), 3, 8)
    assert solved(columns, wanted, low, high, code=PYTHON_CODE)[0] == pytest.approx(
        solved(columns, wanted, low, high)[0], abs=1e-12
    )
