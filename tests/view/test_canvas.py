from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from osimlite.view.canvas import Canvas

RED, GREEN, WHITE = (np.array(color, dtype=float) for color in ((1, 0, 0), (0, 1, 0), (1, 1, 1)))


def triangle(*corners, color=RED):
    return np.array([corners], dtype=float), np.tile(color, (1, 3, 1))


def red(canvas: Canvas) -> np.ndarray:
    picture = canvas.to_pixels().astype(int)
    return (picture[:, :, 0] == 255) & (picture[:, :, 1] == 0)


corner = st.tuples(st.floats(-30.0, 60.0), st.floats(-30.0, 60.0))


@given(corner, corner, corner)
def test_the_pixels_of_a_triangle_are_those_whose_middles_are_inside(a, b, c):
    canvas = Canvas(24, 16, WHITE)
    canvas.draw_opaque(*triangle((*a, 0), (*b, 0), (*c, 0)))
    drawn = red(canvas)
    y, x = np.mgrid[:16, :24] + 0.5
    away = []
    for (sx, sy), (ex, ey) in ((a, b), (b, c), (c, a)):
        size = float(np.hypot(ex - sx, ey - sy))
        away.append(((ex - sx) * (y - sy) - (ey - sy) * (x - sx)) / (size or 1.0))
    inside = (np.min(away, axis=0) > 0.0) | (np.max(away, axis=0) < 0.0)
    # Pixels on an edge may or may not be drawn.
    clear = np.abs(away).min(axis=0) > 1e-6
    assert (drawn == inside)[clear].all()


def test_the_nearest_is_seen_whatever_comes_first():
    near, far = ((0, 0, 2), (16, 0, 2), (0, 16, 2)), ((0, 0, 1), (16, 0, 1), (0, 16, 1))
    for order in ((near, far), (far, near)):
        canvas = Canvas(8, 8, WHITE)
        for corners in order:
            canvas.draw_opaque(*triangle(*corners, color=RED if corners is near else GREEN))
        assert red(canvas).all()


def test_what_crosses_is_seen_on_its_own_side():
    canvas = Canvas(20, 20, WHITE)
    places = np.array(
        [((0, 0, 1), (20, 0, -1), (0, 40, 1)), ((0, 0, 0), (40, 0, 0), (0, 40, 0))], dtype=float
    )
    canvas.draw_opaque(places, np.array((np.tile(RED, (3, 1)), np.tile(GREEN, (3, 1)))))
    seen = red(canvas)
    assert seen[0, 2] and not seen[0, 17]


def test_glass_lets_shine_through_from_the_back_to_the_front():
    canvas = Canvas(8, 8, WHITE)
    corners = np.array(((0, 0), (32, 0), (0, 32)), dtype=float)
    places = np.array([np.column_stack((corners, np.full(3, depth))) for depth in (2.0, 1.0, -5.0)])
    canvas.draw_opaque(*triangle((0, 0, 0), (32, 0, 0), (0, 32, 0), color=WHITE))
    colors = np.array([np.tile(color, (3, 1)) for color in (RED, GREEN, GREEN)])
    canvas.draw_translucent(places, colors, np.array((0.5, 0.5, 1.0)))
    # The colour is half green over half red over white; what is behind the opaque white surface is
    # hidden.
    assert np.abs(canvas.to_pixels()[4, 4].astype(int) - (191, 128, 64)).max() <= 1


def test_colours_run_from_corner_to_corner():
    canvas = Canvas(10, 1, WHITE)
    colors = np.array([[(0.0, 0, 0), (1.0, 0, 0), (0.0, 0, 0)]])
    canvas.draw_opaque(np.array([[(0, 0.5, 0), (10, 0.5, 0), (0, 0.6, 0)]], dtype=float), colors)
    row = canvas.to_pixels()[0, :, 0].astype(int)
    assert (np.diff(row) > 20).all()


def test_nothing_is_drawn_for_what_has_no_place():
    canvas = Canvas(8, 8, WHITE)
    canvas.draw_opaque(*triangle((np.nan, 0, 0), (8, 0, 0), (0, 8, 0)))
    canvas.draw_opaque(*triangle((100, 0, 0), (120, 0, 0), (100, 8, 0)))
    canvas.draw_translucent(np.zeros((0, 3, 3)), np.zeros((0, 3, 3)), np.zeros(0))
    assert (canvas.to_pixels() == 255).all()
