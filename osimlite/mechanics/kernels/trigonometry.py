"""Sine and cosine of one angle at once, for angles of joints.

Source: S. L. Moshier, Methods and Programs for Mathematical Functions, 1989 (the approximations of
the Cephes library); W. J. Cody and W. Waite, Software Manual for the Elementary Functions, 1980
(the reduction). The error is less than one and a half units in the last place.
"""

from __future__ import annotations

from math import cos, floor, sin

QUARTERS = 0.6366197723675814  # 2 / pi
LARGEST = 1e6
# pi / 2 in three parts, of which the first two have few enough digits for exact products.
HIGH, MIDDLE, LOW = 1.5707962512969971, 7.549789415861596e-8, 5.390302858158119e-15


def sine_cosine(angle: float) -> tuple[float, float]:
    """(sin, cos) of an angle in rad."""
    if not abs(angle) < LARGEST:
        return sin(angle), cos(angle)
    quarters = floor(angle * QUARTERS + 0.5)
    z = ((angle - quarters * HIGH) - quarters * MIDDLE) - quarters * LOW
    a = z * z
    s = 1.58962301576546568060e-10 * a - 2.50507477628578072866e-8
    s = (s * a + 2.75573136213857245213e-6) * a - 1.98412698295895385996e-4
    s = (s * a + 8.33333333332211858878e-3) * a - 1.66666666666666307295e-1
    s = z + z * a * s
    c = -1.13585365213876817300e-11 * a + 2.08757008419747316778e-9
    c = (c * a - 2.75573141792967388112e-7) * a + 2.48015872888517045348e-5
    c = (c * a - 1.38888888888730564116e-3) * a + 4.16666666666665929218e-2
    h = 0.5 * a
    t = 1.0 - h
    # What rounding took from t is given back.
    c = t + ((1.0 - t) - h + a * a * c)
    quadrant = int(quarters) & 3
    if quadrant & 1:
        s, c = c, -s
    if quadrant & 2:
        s, c = -s, -c
    return s, c
