"""Linear algebra of small matrices: rank-deficient equations, Cholesky's method, eigenvalues.

Equations that may repeat or contradict each other are solved by a complete orthogonal decomposition
with Householder reflections (G. H. Golub, C. F. Van Loan, Matrix Computations, 1996, chapters 5.2
and 5.5). Equations are processed in the order of their largest remaining norm until the rank is
reached, and reduced to a triangle of the size of the rank. Eigenvalues come from the cyclic Jacobi
method (the same, chapter 8.4). Equations that need no pivoting are solved by Gaussian elimination.
"""

from __future__ import annotations

from math import sqrt

from osimlite.mechanics.kernels.dynamics import (
    SMALLEST_PIVOT,
)
from osimlite.mechanics.kernels.layout import (
    CONSTRAINED,
    MODEL,
    WORK,
)
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, call

REDUNDANCY_TOLERANCE = 1e-9
"""Relative size of the part of an equation beyond the others below which it counts as redundant."""
ROUNDING = 1e-13
"""Equations shorter than this (m, rad), or than this part of the longest one, are rounding errors."""

FACTOR_EXTRA = 3
"""Number of vectors (count,) in a factor: diagonal, order, diagonal of the second reduction.

A factor of `count` equations in `size` unknowns holds the reduced equations with their reflections
(count, size), these vectors, the second reduction (count, count) for fewer independent equations
than `count`, and at the end the rank.
"""


def factor_size(count: int, size: int) -> int:
    """Return the length of a factor of `count` equations in `size` unknowns.

    Args:
        count: number of equations.
        size: number of unknowns.
    """
    return count * size + count * count + FACTOR_EXTRA * count + 1


def factorise_by_law(model: Ints, data: Floats, count: int, a: Floats, smallest: float) -> int:
    """Factorise equations in all speeds by the law of the model.

    The indirection lets the compiled program have one copy of the factorization. See
    `factorise_equations`.

    Args:
        model: integers of the model.
        data: results; SCRATCH is used.
        count: number of equations.
        a: left sides (count, n), replaced by the factor.
        smallest: relative threshold of independence.

    Returns:
        Rank of the equations.
    """
    data[WORK.SCRATCH] = smallest
    return call(
        model[MODEL.LAWS + model[model[MODEL.CONSTRAINED] + CONSTRAINED.FACTORISE]],
        model,
        data,
        data,
        a,
        a,
        count,
    )


def solve_by_law(
    model: Ints, count: int, a: Floats, values: Floats, work: Floats, reals: Floats
) -> None:
    """Solve equations that `factorise_by_law` factorised, see `solve_minimum_norm`.

    Args:
        model: integers of the model.
        count: number of equations.
        a: factor from `factorise_by_law`.
        values: right sides (count,).
        work: workspace (count,).
        reals: filled with the shortest solution (n,).
    """
    call(
        model[MODEL.LAWS + model[model[MODEL.CONSTRAINED] + CONSTRAINED.MINIMUM_NORM]],
        model,
        values,
        work,
        a,
        reals,
        count,
    )


def factorise_law(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, count: int
) -> int:
    """Factorise equations as a law, which is called by its address.

    Args:
        model: integers of the model.
        reals: not used.
        data: results; SCRATCH holds the threshold of independence.
        y: workspace, not used here.
        f: left sides, replaced by the factor.
        count: number of equations.

    Returns:
        The rank, which is stored at the end of the factor, too.
    """
    size = model[MODEL.DOFS]
    rank = factorise_equations(count, size, f, data[WORK.SCRATCH])
    f[factor_size(count, size) - 1] = rank
    return rank


def minimum_norm_law(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, count: int
) -> int:
    """Solve factorised equations as a law, which is called by its address.

    Args:
        model: integers of the model.
        reals: right sides (count,).
        data: workspace (count,).
        y: factor from `factorise_law`.
        f: filled with the shortest solution (n,).
        count: number of equations.

    Returns:
        Rank of the equations.
    """
    size = model[MODEL.DOFS]
    rank = int(y[factor_size(count, size) - 1])
    solve_minimum_norm(count, size, y, rank, reals, data, f)
    return rank


def factorise_equations(count: int, size: int, a: Floats, smallest: float) -> int:
    """Factorise equations in place.

    An equation counts as independent if its part beyond the others is more than `smallest` times the
    longest equation.

    Args:
        count: number of equations.
        size: number of unknowns.
        a: left sides (count, size), replaced by the factor.
        smallest: relative threshold of independence.

    Returns:
        The rank, which is the number of independent equations.
    """
    diagonal = at(a, count * size)
    order = at(a, count * size + count)
    rank = 0
    for r in range(count):
        order[r] = r
    least = 0.0
    for r in range(min(count, size)):
        best, largest_square = r, -1.0
        # Pivoting: process the equation with the longest remaining part next.
        for i in range(r, count):
            square = 0.0
            for k in range(r, size):
                square += a[size * i + k] * a[size * i + k]
            if square > largest_square:
                best, largest_square = i, square
        length = sqrt(max(largest_square, 0.0))
        # The first equation is the longest one and defines the scale of the threshold.
        if r == 0:
            least = smallest * length
        if not length > least:
            break
        if best != r:
            order[r], order[best] = order[best], order[r]
            for k in range(size):
                a[size * r + k], a[size * best + k] = a[size * best + k], a[size * r + k]
        row = at(a, size * r)
        diagonal[r] = make_reflection(r, size, 1, length, row)
        for i in range(r + 1, count):
            apply_reflection(r, size, 1, row, 1, at(a, size * i))
        rank += 1
    # Fewer independent equations than equations: least squares by a second reduction.
    if rank < count:
        # Reduce the lower trapezoid (count, rank) to a triangle by reflections of its columns.
        t, corner = at(a, count * size + FACTOR_EXTRA * count), at(a, count * size + 2 * count)
        for i in range(count):
            for k in range(rank):
                t[count * i + k] = a[size * i + k] if k < i else (diagonal[i] if k == i else 0.0)
        for r in range(rank):
            square = 0.0
            for i in range(r, count):
                square += t[count * i + r] * t[count * i + r]
            column = at(t, r)
            corner[r] = make_reflection(r, count, count, sqrt(square), column)
            for k in range(r + 1, rank):
                apply_reflection(r, count, count, column, count, at(t, k))
    return rank


def make_reflection(first: int, end: int, stride: int, length: float, v: Floats) -> float:
    """Compute the Householder vector that maps a vector to a multiple of its entry `first`.

    Args:
        first: index of the entry.
        end: end of the vector.
        stride: distance between the entries of the vector.
        length: norm of the vector from the entry on.
        v: vector, replaced by the Householder vector of norm sqrt(2).

    Returns:
        The value of the entry after the reflection.
    """
    first_entry = v[stride * first]
    # Reflect to the opposite sign of the entry, so that the difference does not cancel.
    value = -length if first_entry > 0.0 else length
    if length > 0.0:
        v[stride * first] = first_entry - value
        # Scale the vector to the squared norm 2, so that the reflection needs no division.
        scale = 1.0 / sqrt(length * (length + abs(first_entry)))
        for k in range(first, end):
            v[stride * k] *= scale
    return value


def apply_reflection(
    first: int, end: int, stride: int, v: Floats, x_stride: int, x: Floats
) -> None:
    """Reflect the vector x by a Householder vector v: x -= (v . x) v.

    Args:
        first: index of the first entry of both.
        end: end of the entries of both vectors.
        stride: distance between the entries of v.
        v: Householder vector of norm sqrt(2).
        x_stride: distance between the entries of x.
        x: vector; changed.
    """
    total = 0.0
    for k in range(first, end):
        total += v[stride * k] * x[x_stride * k]
    for k in range(first, end):
        x[x_stride * k] -= total * v[stride * k]


def solve_minimum_norm(
    count: int, size: int, a: Floats, rank: int, values: Floats, work: Floats, x: Floats
) -> None:
    """Compute the shortest least-squares solution of factorised equations.

    Args:
        count: number of equations.
        size: number of unknowns.
        a: factor from `factorise_equations`.
        rank: number of independent equations.
        values: right sides (count,).
        work: workspace (count,).
        x: filled with the solution (size,).
    """
    diagonal = at(a, count * size)
    order = at(a, count * size + count)
    for i in range(count):
        work[i] = values[int(order[i])]
    # Least squares over all equations, redundant ones included.
    if rank < count:
        t, corner = at(a, count * size + FACTOR_EXTRA * count), at(a, count * size + 2 * count)
        for r in range(rank):
            apply_reflection(r, count, count, at(t, r), 1, work)
        for r in range(rank - 1, -1, -1):
            total = work[r]
            for k in range(r + 1, rank):
                total -= t[count * r + k] * work[k]
            work[r] = total / corner[r]
    else:
        for r in range(rank):
            total = work[r]
            for k in range(r):
                total -= a[size * r + k] * work[k]
            work[r] = total / diagonal[r]
    # Unknowns beyond the rank are zero in the rotated basis, which makes the solution shortest.
    for k in range(size):
        x[k] = work[k] if k < rank else 0.0
    apply_q(size, a, rank, x)


def apply_q(size: int, a: Floats, rank: int, x: Floats) -> None:
    """Transform rotated unknowns back to the unknowns; those from `rank` on are free.

    Args:
        size: number of unknowns.
        a: factor from `factorise_equations`.
        rank: number of independent equations.
        x: rotated unknowns (size,), replaced by the unknowns.
    """
    for r in range(rank - 1, -1, -1):
        apply_reflection(r, size, 1, at(a, size * r), 1, x)


def write_null_space(size: int, a: Floats, rank: int, basis: Floats) -> None:
    """Write an orthonormal basis of the null space of factorised equations, by rows.

    Args:
        size: number of unknowns.
        a: factor from `factorise_equations`.
        rank: number of independent equations.
        basis: filled with the vectors of the basis, one after the other.
    """
    for k in range(size - rank):
        direction = at(basis, size * k)
        for j in range(size):
            direction[j] = 0.0
        direction[rank + k] = 1.0
        apply_q(size, a, rank, direction)


def factorise_cholesky(size: int, a: Floats, smallest: float) -> bool:
    """Factorise a symmetric positive definite matrix (size, size) in place.

    Its lower triangle is used.

    Args:
        size: size of the matrix.
        a: matrix; its lower triangle is replaced by the factor L of L Lᵀ.
        smallest: relative threshold of the pivots.

    Returns:
        Whether each pivot is more than `smallest` times its entry of the matrix.
    """
    for i in range(size):
        row = at(a, size * i)
        entry = a[size * i + i]
        for k in range(i + 1):
            upper_row = at(a, size * k)
            total = row[k]
            for j in range(k):
                total -= row[j] * upper_row[j]
            if k < i:
                row[k] = total / upper_row[k]
            else:
                # Also false for NaN.
                if not total > smallest * entry:
                    return False
                row[i] = sqrt(total)
    return True


def solve_cholesky(size: int, a: Floats, x: Floats) -> None:
    """Solve a linear system in place with the factor of `factorise_cholesky`.

    Args:
        size: size of the matrix.
        a: factor from `factorise_cholesky`.
        x: right side (size,), replaced by the solution.
    """
    for i in range(size):
        total = x[i]
        for k in range(i):
            total -= a[size * i + k] * x[k]
        x[i] = total / a[size * i + i]
    for i in range(size - 1, -1, -1):
        total = x[i]
        for k in range(i + 1, size):
            total -= a[size * k + i] * x[k]
        x[i] = total / a[size * i + i]


MAX_SWEEPS = 60
"""Largest number of sweeps of Jacobi's method."""
JACOBI_TOLERANCE = 1e-32
"""Ratio of the squared entries off and on the diagonal at which Jacobi's method ends."""


def diagonalize(size: int, a: Floats, vectors: Floats) -> None:
    """Compute eigenvalues and eigenvectors of a symmetric matrix.

    Args:
        size: size of the matrix.
        a: matrix (size, size); its diagonal is filled with the eigenvalues.
        vectors: filled with the orthonormal eigenvectors by rows (size, size), in the same order.
    """
    for i in range(size):
        for j in range(size):
            vectors[size * i + j] = 1.0 if i == j else 0.0
    for _ in range(MAX_SWEEPS):
        off_diagonal = on_diagonal = 0.0
        for i in range(size):
            on_diagonal += a[size * i + i] * a[size * i + i]
            for j in range(i):
                off_diagonal += a[size * i + j] * a[size * i + j]
        if not off_diagonal > JACOBI_TOLERANCE * on_diagonal:
            return
        for i in range(size):
            for j in range(i):
                rotate_plane(size, a, vectors, i, j)


def rotate_plane(size: int, a: Floats, vectors: Floats, i: int, j: int) -> None:
    """Rotate the plane of two unknowns so that their common entry vanishes.

    Args:
        size: size of the matrix.
        a: symmetric matrix (size, size); changed.
        vectors: product of all rotations so far, by rows; changed.
        i: first unknown.
        j: second unknown.
    """
    entry = a[size * i + j]
    if entry == 0.0:
        return
    # The smaller of both roots of the equation for the tangent: a rotation by at most 45 degrees,
    # for which the method converges.
    ratio = (a[size * j + j] - a[size * i + i]) / (2.0 * entry)
    tangent = (1.0 if ratio >= 0.0 else -1.0) / (abs(ratio) + sqrt(1.0 + ratio * ratio))
    cosine = 1.0 / sqrt(1.0 + tangent * tangent)
    sine = tangent * cosine
    for k in range(size):
        first_entry, second_entry = a[size * i + k], a[size * j + k]
        a[size * i + k], a[size * j + k] = (
            cosine * first_entry - sine * second_entry,
            sine * first_entry + cosine * second_entry,
        )
    for k in range(size):
        first_entry, second_entry = a[size * k + i], a[size * k + j]
        a[size * k + i], a[size * k + j] = (
            cosine * first_entry - sine * second_entry,
            sine * first_entry + cosine * second_entry,
        )
        first_entry, second_entry = vectors[size * i + k], vectors[size * j + k]
        vectors[size * i + k], vectors[size * j + k] = (
            cosine * first_entry - sine * second_entry,
            sine * first_entry + cosine * second_entry,
        )


def factorise_matrix(size: int, a: Floats, masses: Floats) -> bool:
    """Factorise a matrix (size, size) in place by Gaussian elimination without pivoting.

    Args:
        size: size of the matrix.
        a: matrix (size, size); replaced by its factors.
        masses: mass matrix (size, size).

    Returns:
        Whether each pivot is more than `SMALLEST_PIVOT` times the mass there.
    """
    # The matrix is nearly symmetric and positive definite for small steps, so that pivoting is
    # unnecessary.
    for k in range(size):
        row = at(a, size * k)
        if not row[k] > SMALLEST_PIVOT * masses[size * k + k]:
            return False
        # Store inverse pivots, because divisions are slow and each is used in every solution.
        row[k] = 1.0 / row[k]
        for i in range(k + 1, size):
            lower_row = at(a, size * i)
            if lower_row[k] != 0.0:
                factor = lower_row[k] * row[k]
                lower_row[k] = factor
                for j in range(k + 1, size):
                    lower_row[j] -= factor * row[j]
    return True


def solve_factorised(size: int, a: Floats, x: Floats) -> None:
    """Solve a linear system in place with the factors of `factorise_matrix`.

    Args:
        size: size of the matrix.
        a: factors from `factorise_matrix`.
        x: right side (size,), replaced by the solution.
    """
    for i in range(size):
        x[i] -= dot_range(0, i, at(a, size * i), x)
    for i in range(size - 1, -1, -1):
        row = at(a, size * i)
        x[i] = (x[i] - dot_range(i + 1, size, row, x)) * row[i]


def invert_matrix(size: int, a: Floats) -> None:
    """Invert a small matrix (size, size) in place.

    It is Gauss-Jordan elimination without pivoting, since 1 - c J of the states of a force is near
    the identity for small c.

    Args:
        size: size of the matrix.
        a: matrix; replaced by its inverse.
    """
    for i in range(size):
        pivot = 1.0 / a[size * i + i]
        a[size * i + i] = 1.0
        for k in range(size):
            a[size * i + k] *= pivot
        for j in range(size):
            if j != i:
                factor = a[size * j + i]
                a[size * j + i] = 0.0
                for k in range(size):
                    a[size * j + k] -= factor * a[size * i + k]


def dot_range(first: int, end: int, a: Floats, b: Floats) -> float:
    """Return the scalar product of the entries `first` to `end` of two vectors.

    Args:
        first: first index.
        end: end of the indices.
        a: first vector.
        b: second vector.
    """
    total = 0.0
    for k in range(first, end):
        total += a[k] * b[k]
    return total
