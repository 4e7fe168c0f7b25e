"""Functions in the restricted Python of kernels, one for each group of its constructs.

Each takes integers, floats, a vector for its results and a count, as kernels do, and returns an
integer. The tests run them as Python, as C++ and as JavaScript.
"""

from __future__ import annotations

import math
from math import atan2, ceil, copysign, floor, inf, isfinite, isinf, isnan, nan, sqrt
from typing import Any, NamedTuple

from osimlite.mechanics.kernels.layout import STAGE
from osimlite.mechanics.kernels.pointers import Floats, Ints, at

WEIGHTS = 0.5, -2.0, 1e-300, -0.0
CODES = 3, 7, -2
MIXED = 1, 2.5, (3, -4.0)
LARGE = 2**40
LIMIT = -inf


class Point(NamedTuple):
    """Named tuple of a float, an integer and a tuple."""

    size: float
    number: int
    arm: tuple[float, float]
    scale: float = 2.5


class Pair(NamedTuple):
    """Named tuple whose fields have names that are reserved in C++ or JavaScript."""

    new: float
    delete: float


# ------------------------------------------------------------------------------------------------- arithmetic
def divide_and_round(s: Ints, x: Floats, out: Floats, count: int) -> int:
    """Use divisions, remainders and powers of floats and integers of either sign."""
    a, b = x[0], x[1] + 3.25
    out[0], out[1] = a // b, a % b
    out[2], out[3] = a // -b, a % -b
    out[4], out[5] = 7.5 // 2, -7.5 % 2
    k, m = s[0], s[1]
    out[6], out[7] = k // m, k % m
    out[8], out[9] = k // -m, k % -m
    out[10], out[11] = -k // m, -k % 4
    out[12], out[13] = k / m, k * m - (k + m)
    out[14], out[15] = a**2, b**3
    out[16], out[17] = b**-2, 2**-2
    out[18], out[19] = 3**4, k**2
    out[20], out[21] = abs(b) ** 0.5, 2.0**m
    out[22] = a - b - 0.5 - (a - (b - 0.5))
    out[23] = -(a - b) - -b - -2.0
    out[24] = (k & 6) + (k & 1) * 16
    out[25] = k + 0.5 * m
    return LARGE + k // 1


def use_bits(s: Ints, x: Floats, out: Floats, count: int) -> int:
    """Use bits of 64-bit integers, which JavaScript's operators do not support."""
    k, m = s[0], s[1]
    out[0], out[1], out[2] = k & m, k | 8, k ^ 3
    out[3], out[4] = k >> 1, k << m
    out[5] = (k & 6) + (k | 8) * 16 + (k ^ 3) * 256
    out[6] = 1 + (m << 2) & 13
    out[7] = (k > 1) & (m > 1)
    out[8] = (k > 1) | (m > 1)
    s[2] ^= k
    s[2] <<= 2
    s[3] = 0xD2511F53 * (k & 3)
    return ((0xD2511F53 * (count + 0x7FFFFFF0)) >> 32 & 0xFFFFFFFF) ^ k


def round_to_integers(s: Ints, x: Floats, out: Floats, count: int) -> int:
    """Use functions whose results are integers or truth values."""
    a = 1.75 if isnan(x[0]) or isinf(x[0]) else x[0]
    out[0], out[1], out[2] = int(a), floor(a), ceil(a)
    out[3], out[4], out[5] = int(-2.5), floor(-2.5), ceil(-2.5)
    out[6], out[7] = int(s[0]), floor(s[0])
    out[8], out[9], out[10] = isnan(x[0]), isfinite(x[0]), isinf(x[0])
    out[11], out[12], out[13] = bool(x[1]), bool(s[1]), float(s[0])
    out[14], out[15], out[16] = abs(a) + abs(-5), abs(-s[0]), abs(s[0] > 1)
    out[17] = int(s[0] > 2) + (s[0] > 1) * 10 + True
    out[18] = -(s[0] == 2) + float(s[1] > 0)
    return int(a * 4.0)


def compare(s: Ints, x: Floats, out: Floats, count: int) -> int:
    """Use comparisons, chained comparisons, membership, and `and` and `or` of truth values and numbers."""
    a, b = x[0], x[1]
    k = s[0]
    out[0], out[1], out[2], out[3] = a < b, a <= b, a == b, a != b
    out[4] = 0.0 < a < 2.0 <= b
    out[5] = -1.0 <= a * b < 3.0
    out[6], out[7] = k in (1, 2, s[1]), k not in (3, 5)
    out[9] = not a < b
    out[10] = (a > 0.0) == (b > 0.0)
    out[11] = (a > 0.0 and b > 0.0) or (a < 0.0 and not b < 0.0)
    out[12], out[13] = a and b, a or b
    out[14], out[15] = k and a, k or a
    out[16] = k and s[1] and 5
    out[17] = a * 0.0 or b or 7.0
    if a:
        out[18] = 1.0
    if not b:
        out[19] = 1.0
    if k:
        out[20] = 1.0
    elif a > 0.0 or b:
        out[21] = 1.0
    else:
        out[22] = 1.0
    out[23] = 1.0 if a else 2.0
    out[24] = min(a, b)
    out[25] = max(a, b)
    out[26] = min(b, a)
    out[27] = max(b, a)
    out[28] = min(1.0, a, b, 0.5)
    out[29] = max(a, k)
    out[30] = min(k, s[1], 3)
    return k == s[1]


def choose(s: Ints, x: Floats, out: Floats, count: int) -> int:
    """Use nested conditional expressions of numbers and tuples."""
    a, b = x[0], x[1]
    out[0] = a if a > b else b if b > 0.0 else -1.0
    out[1] = (a if a > 0.0 else 1) + (2 if b > 0.0 else 0.5)
    low, high = (a, b) if a <= b else (b, 2)
    out[2], out[3] = low, high
    pair = (1, a) if a > 0.0 else (b, 2)
    out[4], out[5] = pair
    inner = ((1.0, 2.0), s[0]) if b > 0.0 else ((a, b), 3)
    (out[6], out[7]), out[8] = inner
    return s[0] if a > 0.0 else -s[0] if b > 0.0 else 7


# ---------------------------------------------------------------------------------------------------- tuples
def make_point(size: float, number: int) -> Point:
    """Return a named tuple from one of two return statements; the second one uses a default."""
    if number > 1:
        return Point(size, number, (1, size), 3)
    return Point(size, number, (size, 2.0))


def sum_items(a: float, b: float, c: float, d: float = 0.25) -> float:
    """Return a weighted sum; the last argument has a default."""
    return a + 10.0 * b + 100.0 * c + 1000.0 * d


def first_two(point: tuple[float, ...], weight: float) -> tuple[float, float]:
    """Return the first two items of a tuple, times a weight."""
    return weight * point[0], weight * point[1]


def use_tuples(s: Ints, x: Floats, out: Floats, count: int) -> int:
    """Use tuples, named tuples, constants, and their items."""
    a, b = x[0], x[1]
    triple = (a, b, 2.0)
    out[0], out[1], out[2] = triple
    a, b = b, a
    out[3], out[4] = a, b
    out[5] = triple[0] + triple[-1] + triple[1 - 1]
    for k in range(3):
        out[6 + k] = triple[k] * WEIGHTS[k] + CODES[k]
    point = make_point(a, s[0])
    out[9], out[10], out[11], out[12] = point.size, point.number, point.arm[0], point.scale
    size, number, (left, right), scale = point
    out[13] = size + number + left + right + scale
    out[14] = sum_items(*triple)
    out[15] = sum_items(*first_two(triple, 2.0), 5.0, *(1.0,))
    c = d = a + 1.0
    c += 1.0
    out[16], out[17] = c, d
    (e, f), g = (a, b), 5
    out[18] = e + f + g
    longer = (*triple, *first_two(point.arm, 3.0), 9.0)
    out[19] = longer[3] + longer[5]
    pair = Pair(a, 2.0)
    out[20] = pair.new - pair.delete
    nested = MIXED
    out[21] = nested[2][1] + nested[0]
    _, out[22] = first_two((4, 5.0), 0.5)
    v = x[2], x[3]
    v = first_two(v, 2.0)
    out[23] = v[0] - v[1]
    return CODES[2] + STAGE.FORCE


# ----------------------------------------------------------------------------------------------------- loops
def repeat(s: Ints, x: Floats, out: Floats, count: int) -> int:
    """Use loops over ranges and tuples that end early, skip rounds, change their variable and use it afterwards."""
    total = x[0]
    for k in range(count):
        k = 2 * k
        if k > 8:
            break
        total += k
    for k in range(count, 0, -1):
        for _ in (1.0, 2.0):
            if k == 2:
                continue
            total -= 0.25 * k
    for k in range(1, 10, 3):
        total += k
    out[0], out[1] = total, k
    step = 2 if count % 2 else -2
    for k in range(3, -4 + 20 * (step > 0), step):
        out[2] += k
    for weight in (1, x[1], 0.5):
        out[3] += weight * weight
    n = 0
    while n < count and not (n == 3 and count > 5):
        n += 1
        if n == 2:
            continue
        out[4] += n
    while True:
        n -= 1
        if n < -2:
            break
    before = -1.0
    for k in range(4):
        if k > 0:
            out[5] += before
        before = k * 1.5
    stop = count
    for k in range(stop):
        stop = 0
        out[6] += k
    for k in range(0):
        out[7] = k
    return n


def leave(s: Ints, x: Floats, out: Floats, count: int) -> int:
    """Return from within loops and branches, and use variables that only one branch sets."""
    for k in range(count):
        if x[k % 4] > 1.0:
            found = k
            if found > 1:
                return found
            out[0] = found
        else:
            other = x[k % 4]
            out[1] += other
    if count > 3:
        last = 1
        out[3] = 1.0
    else:
        last = 2.5  # type: ignore[assignment]
    out[2] = last
    while True:
        count += 1
        if count > 6:
            return -count


def widen(value: float, count: int) -> float:
    """Change the type of an argument from integer to float within a loop."""
    for _ in range(count):
        value = value / 2
    return value


def half_or_none(value: float) -> float:
    """Compute a number that is an integer for an integer, and a float for a float."""
    return value * 3 - 1


def apply(function: Any, a: float, b: float) -> float:
    """Call a function that is an argument."""
    return function(a, b) + 1.0


def add(a: float, b: float) -> float:
    """Return a sum."""
    return a + b


def subtract(a: float, b: float) -> float:
    """Return a difference."""
    return a - b


def specialise(s: Ints, x: Floats, out: Floats, count: int) -> int:
    """Use functions with arguments of different types, and functions as arguments."""
    out[0], out[1] = widen(s[0], 1), widen(x[0], 2)
    out[2], out[3] = half_or_none(s[0]), half_or_none(x[0])
    out[4], out[5] = apply(add, x[0], 2.0), apply(subtract, x[0], s[0])
    total = 0
    for k in range(count):
        total = total + x[k % 4] if k else 3
    out[6] = total
    double, new, this, var, temporary_1, f = 1.5, 2, x[0], x[1], s[0], 0.5
    out[7] = double * new - this * var + temporary_1 * f
    return half_or_none(s[1])  # type: ignore[return-value]


# --------------------------------------------------------------------------------------- order of evaluation
def push(v: Floats, k: int) -> float:
    """Count in v[0], and return the count times k."""
    v[0] += 1.0
    return v[0] * k


def push_two(v: Floats) -> tuple[float, float]:
    """Count in v[0], and return the count and its double."""
    v[0] += 1.0
    return v[0], 2.0 * v[0]


def mix(a: float, b: float, c: float) -> float:
    """Return a number that depends on the order of the arguments."""
    return a - 3.0 * b + 7.0 * c


def keep_order(s: Ints, x: Floats, out: Floats, count: int) -> int:
    """Call functions that write memory, as operands and arguments next to others that read or write it."""
    w = at(out, 20)
    w[0] = x[0]
    out[0] = mix(push(w, 1), w[0], push(w, 2))
    out[1] = push(w, 1) - push(w, 2) * w[0]
    out[2] = w[0] + push(w, 3) + w[0]
    out[3], out[4] = w[0], push(w, 1)
    a, b = push(w, 1), w[0]
    out[5] = a * 10.0 - b
    out[6] = mix(*push_two(w), w[0])
    out[7] = mix(w[0], *push_two(w))
    out[8] = push(w, 1) < w[0] <= push(w, 1)
    out[9] = push(w, 1) > 1e9 and push(w, 1)
    out[10] = x[1] > 0.0 or push(w, 1) > 0.0
    out[11] = push(w, 2) if w[0] > 5.0 else push(w, 3)
    out[12] = max(w[0], push(w, -1), w[0])
    w[0] += push(w, 1)
    w[0] = w[0] - push(w, 1) * w[0]
    out[13] = (push(w, 1), w[0])[1]
    out[14] = x[2] < push(w, 1) * 0.0 + w[0] < 1e9
    v = at(out, 24)
    v[0] = 0.0
    v[1 + int(v[0])] = push(v, 5)
    v[3] = mix(w[0], mix(w[0], push(w, 1), 1.0), w[0])
    while push(w, 1) < w[0] + 1.0 and push(v, 1) < 4.0:
        v[4] += w[0]
    for k in range(int(push(v, 1)) % 4, int(push(v, 1)) % 7 + 2):
        v[5] += k
    _ = push(v, 1)
    push(v, 1)
    return int(v[0])


def move_pointers(s: Ints, x: Floats, out: Floats, count: int) -> int:
    """Use vectors from an offset, assignments to their items, and integers that are stored."""
    rest = at(out, 2)
    rest[0], rest[1] = x[1], rest[0]
    inner = at(rest, s[1])
    inner[0] = 4.0
    inner[0] -= x[0]
    inner[0] *= 2.0
    inner[0] /= 4
    inner[1] = 7.5
    inner[1] //= 2.0
    inner[2] = 7.5
    inner[2] %= 2.0
    inner[3] = 3
    inner[3] **= 2
    s[2] = s[0] + 1
    s[2] += 5
    s[3] = s[2] // 2
    s[3] *= 8
    which = rest if x[0] > 0.0 else at(rest, 1)
    which[8] = 1.0
    counts = at(s, 1)
    return counts[0] + counts[1]


def evaluate_mathematics(s: Ints, x: Floats, out: Floats, count: int) -> int:
    """Use mathematical functions whose results are exact, with the sign of zero."""
    a = x[0] if isfinite(x[0]) else 0.5
    out[0], out[1] = sqrt(abs(a)), copysign(2.0, a)
    out[2], out[3] = copysign(a, -0.0), atan2(a, -0.0)
    out[4], out[5] = abs(-0.0), 0.0 * -1.0
    out[6], out[7] = LIMIT, nan
    out[8], out[9] = math.pi, 1e-320
    out[10] = 0.1 + 0.2 + a
    return 0


def compute_series(s: Ints, x: Floats, out: Floats, count: int) -> int:
    """Use functions of `math` with and without a counterpart in JavaScript."""
    a = x[0] if isfinite(x[0]) else 0.5
    b = max(-0.9, min(0.9, a))
    out[0], out[1], out[2] = math.erf(a), math.erfc(a), math.radians(a)
    out[3], out[4], out[5] = math.sin(a), math.cos(a), math.tan(b)
    out[6], out[7], out[8] = math.asin(b), math.acos(b), math.atan(a)
    out[9], out[10], out[11] = math.exp(b), math.log(b + 1.0), math.sinh(b)
    out[12], out[13], out[14] = math.cosh(b), math.tanh(a), math.fabs(a)
    out[15], out[16], out[17] = math.erf(3.0 * b), math.erfc(5.0 * b), math.erfc(30.0)
    return 0


EXACT = (
    divide_and_round, round_to_integers, compare, choose, use_tuples, repeat, leave, specialise, keep_order,
    move_pointers, evaluate_mathematics,
)  # fmt: skip
"""Functions whose results have the same bits everywhere, except for the sign of zero in JavaScript."""

INPUTS = [
    ((2, 3, 0, 0), (0.5, -1.25, 2.0, 0.75), 0),
    ((-7, 2, 0, 0), (-0.0, 0.0, 1.5, -3.0), 1),
    ((5, 1, 0, 0), (1.5, 2.5, 0.25, 1.25), 5),
    ((0, 2, 0, 0), (2.0, 2.0, 2.0, 2.0), 4),
    ((1, 3, 0, 0), (nan, 1.0, 0.5, -1.0), 7),
    ((3, 2, 0, 0), (-1.75, nan, 1.0, 0.0), 2),
    ((2, 1, 0, 0), (1e-310, -4.0, 3.5, 1e300), 3),
]
"""Integers, floats and count of each call."""
