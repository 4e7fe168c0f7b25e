"""Eigenvalues and eigenvectors of small symmetric matrices.

The cyclic method of Jacobi (G. H. Golub, C. F. Van Loan, Matrix Computations, 1996, chapter 8.4).
"""

from __future__ import annotations

from math import sqrt

from osimlite.mechanics.kernels.pointers import Floats

MAX_SWEEPS = 60
NEGLIGIBLE = 1e-32
"""Squares of entries off the diagonal that are together this part of those on it are rounding."""


def diagonalize(size: int, a: Floats, vectors: Floats) -> None:
    """Turn a symmetric matrix into a diagonal one by rotations.

    Args: size: of the matrix. a: the matrix (size, size); its eigenvalues are on its diagonal then.
        vectors: filled with the eigenvectors by rows (size, size), orthonormal, in the order of the
        eigenvalues.
    """
    for i in range(size):
        for j in range(size):
            vectors[size * i + j] = 1.0 if i == j else 0.0
    for _ in range(MAX_SWEEPS):
        off = on = 0.0
        for i in range(size):
            on += a[size * i + i] * a[size * i + i]
            for j in range(i):
                off += a[size * i + j] * a[size * i + j]
        if not off > NEGLIGIBLE * on:
            return
        for i in range(size):
            for j in range(i):
                rotate(size, a, vectors, i, j)


def rotate(size: int, a: Floats, vectors: Floats, i: int, j: int) -> None:
    """Turn the plane of two unknowns so that the entry of both is 0."""
    entry = a[size * i + j]
    if entry == 0.0:
        return
    ratio = (a[size * j + j] - a[size * i + i]) / (2.0 * entry)
    tangent = (1.0 if ratio >= 0.0 else -1.0) / (abs(ratio) + sqrt(1.0 + ratio * ratio))
    cosine = 1.0 / sqrt(1.0 + tangent * tangent)
    sine = tangent * cosine
    for k in range(size):
        one, two = a[size * i + k], a[size * j + k]
        a[size * i + k], a[size * j + k] = cosine * one - sine * two, sine * one + cosine * two
    for k in range(size):
        one, two = a[size * k + i], a[size * k + j]
        a[size * k + i], a[size * k + j] = cosine * one - sine * two, sine * one + cosine * two
        one, two = vectors[size * i + k], vectors[size * j + k]
        vectors[size * i + k], vectors[size * j + k] = (
            cosine * one - sine * two,
            sine * one + cosine * two,
        )
