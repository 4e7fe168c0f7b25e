"""Tests of muscles as tubes with fibers and tendons, in pictures, films and the page."""

from __future__ import annotations

from importlib.resources import files

import numpy as np
import pytest

import osimlite
from osimlite.mechanics.multibody import build_mechanism
from osimlite.view import ModelView, animate
from osimlite.view.collect import build_scene
from osimlite.view.kernels import kernels_text, program_data
from osimlite.view.motion import activity_color
from osimlite.view.scene import Line, LinePoint
from osimlite.view.tubes import (
    FIBER_STEPS,
    LONGEST_TENDON,
    MORE_RINGS,
    RING,
    ROUND_CORNERS,
    TENDON,
    build_tube,
    lay_tube,
)
from tests.view.motions import Recorded

THIN = 0.0035
BENT = np.array(((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.25, 0.1, 0.02), (0.3, 0.3, 0.0)))
STRAIGHT = np.array(((0.0, 0.0, 0.0), (0.4, 0.0, 0.0)))


def make_line(thick: float = 0.0, tendon: float = 0.0) -> Line:
    course = LinePoint(-1, np.zeros(3)), LinePoint(-1, np.ones(3))
    return Line("/muscle", "paths", course, (1.0, 0.0, 0.0), THIN, fibers=thick, tendon=tendon)


def lay(corners: np.ndarray, thick: float, tendon: float) -> np.ndarray:
    """Return the rings (n, RING.SIZE) of a tube along a polyline.

    Args:
        corners: corners of the polyline (m, 3).
        thick: radius of the belly (m).
        tendon: length of the tendon (m).
    """
    numbers = np.full((len(corners) + MORE_RINGS) * RING.SIZE, np.nan)
    count = lay_tube(corners.ravel(), len(corners), THIN, thick, tendon, 1.0, numbers)
    return numbers[: count * RING.SIZE].reshape(-1, RING.SIZE)


@pytest.mark.parametrize("corners", [BENT, STRAIGHT, BENT[[0, 0, 1, 1, 2, 3, 3]]])
@pytest.mark.parametrize(("thick", "tendon"), [(0.0, 0.0), (0.02, 0.0), (0.02, 0.2), (0.02, 9.0)])
def test_a_tube_is_closed_and_turned_outwards(corners, thick, tendon):
    surface, is_tendon = build_tube(make_line(thick, tendon), corners)
    a, b, c = (surface.points[surface.triangles[:, index]] for index in range(3))
    areas = np.cross(b - a, c - a)
    length = np.linalg.norm(np.diff(corners, axis=0), axis=1).sum()
    volume = np.einsum("ij,ij->i", a, areas).sum() / 6.0
    assert np.linalg.norm(areas.sum(axis=0)) < 1e-12
    # A prism with ten sides has less volume than a cylinder, and bends reduce it further.
    assert volume > 0.8 * np.pi * THIN**2 * length
    assert np.linalg.norm(surface.normals, axis=1) == pytest.approx(1.0)
    assert is_tendon.any() == (thick > 0.0 and tendon > 0.0)


@pytest.mark.parametrize("corners", [BENT, STRAIGHT])
@pytest.mark.parametrize("tendon", [0.0, 0.1, 9.0])
def test_fibers_are_between_the_halves_of_the_tendon(corners, tendon):
    rings = lay(corners, 0.02, tendon)
    length = np.linalg.norm(np.diff(corners, axis=0), axis=1).sum()
    middles, radii = rings[:, RING.CENTER : RING.CENTER + 3], rings[:, RING.RADIUS]
    places = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(middles, axis=0), axis=1)))
    # Three rings round off each end.
    places = (places - places[3])[3:-3]
    is_fiber, radii = rings[3:-3, RING.FIBERS] == 1.0, radii[3:-3]
    half = min(0.5 * tendon, LONGEST_TENDON * length)
    assert places[-1] == pytest.approx(length)
    assert places[is_fiber][[0, -1]] == pytest.approx((half, length - half))
    assert radii.max() == pytest.approx(0.02) and radii[~is_fiber] == pytest.approx(THIN)
    assert places[radii.argmax()] == pytest.approx(0.5 * length)
    # Each corner of the polyline is the centre of a ring, in the same order.
    rows = [np.linalg.norm(middles - corner, axis=1).argmin() for corner in corners]
    assert rows == sorted(rows)
    assert np.linalg.norm(middles[rows] - corners, axis=1).max() < 1e-12
    assert is_fiber.sum() >= FIBER_STEPS + 1


def test_a_path_without_corners_or_length_is_no_error():
    assert len(lay(np.zeros((0, 3)), 0.02, 0.1)) == 0
    assert np.isfinite(build_tube(make_line(0.02, 0.1), np.zeros((3, 3)))[0].points).all()


@pytest.fixture(scope="module")
def jumper() -> osimlite.Model:
    from osimlite.models.jumper import jumper as build_jumper

    return build_jumper()


def test_the_page_has_the_same_rings(jumper, chromium):
    scene = build_scene(jumper, build_mechanism(jumper))
    program = program_data(scene.polylines, scene.mechanism.constraints)
    corners = scene.compute_poses(scene.mechanism.values({})).lines
    tubes = [
        [points.ravel().tolist(), len(points), line.radius, line.fibers, line.tendon, 1.0]
        for line, points in zip(scene.lines, corners, strict=True)
    ]
    page = chromium.new_page()
    script = files("osimlite.view").joinpath("web", "mechanism.js").read_text(encoding="utf-8")
    page.evaluate(f"() => {{ {kernels_text(program)}\n{script} }}")
    rings = page.evaluate(
        """([tubes, size, more]) => tubes.map((tube) => {
          const rings = new Float64Array(size * (tube[1] + more));
          return [...rings.subarray(0, size * window.osimlite.kernels.lay_tube(...tube, rings))];
        })""",
        [tubes, program["tubes"]["size"], program["tubes"]["more"]],
    )
    page.close()
    assert any(line.fibers for line in scene.lines)
    for line, points, found in zip(scene.lines, corners, rings, strict=True):
        numbers = np.zeros((len(points) + MORE_RINGS) * RING.SIZE)
        count = lay_tube(
            points.ravel().tolist(),
            len(points),
            line.radius,
            line.fibers,
            line.tendon,
            1.0,
            numbers,
        )
        assert found == pytest.approx(numbers[: count * RING.SIZE], abs=1e-12)


def count_pixels(picture: np.ndarray, color: tuple[float, ...]) -> int:
    """Return the number of pixels with the hue of a colour, in light or shade."""
    pixels = picture.reshape(-1, 3).astype(float)
    direction = np.array(color) / np.linalg.norm(color)
    sizes = np.maximum(np.linalg.norm(pixels, axis=1), 1e-9)
    return int(((pixels @ direction / sizes > 0.999) & (sizes > 60.0)).sum())


def active_motion(model: osimlite.Model, level: float) -> Recorded:
    mechanism = build_mechanism(model)
    q = np.tile(mechanism.values({}), (2, 1))
    names = [line.path for line in build_scene(model, mechanism).lines if line.layer == "paths"]
    levels = {f"{name}/activation": np.full(2, level) for name in names}
    return Recorded(
        np.array((0.0, 0.04)), mechanism.coordinate_names, q, np.zeros_like(q), {}, levels
    )


@pytest.mark.parametrize("level", [0.0, 0.5])
def test_pictures_show_tendons_and_fibers_by_activation(jumper, level, tmp_path):
    image = pytest.importorskip("PIL.Image")
    shown = ModelView.from_model(jumper, motion=active_motion(jumper, level))
    picture = np.asarray(image.open(shown.write_picture(tmp_path / "a.png", (500, 500))))
    assert count_pixels(picture, TENDON) > 100
    assert count_pixels(picture, activity_color(level)) > 300
    assert count_pixels(picture, activity_color(1.0 - level)) < 10 or level == 0.5


def test_films_show_them_too(jumper, tmp_path):
    image = pytest.importorskip("PIL.Image")
    path = animate(jumper, active_motion(jumper, 1.0), tmp_path / "a.gif", size=(500, 500))
    with image.open(path) as film:
        picture = np.asarray(film.convert("RGB"))
    assert count_pixels(picture, TENDON) > 100
    assert count_pixels(picture, activity_color(1.0)) > 300


def test_strong_muscles_are_drawn_thicker(jumper, tmp_path):
    image = pytest.importorskip("PIL.Image")
    areas = []
    for factor in (1.0, 9.0):
        model = jumper.copy_deep()
        for muscle in (part for part in model.walk() if hasattr(part, "max_isometric_force")):
            muscle.max_isometric_force = 500.0 * factor
        shown = ModelView.from_model(model, motion=active_motion(model, 1.0))
        picture = np.asarray(image.open(shown.write_picture(tmp_path / "a.png", (500, 500))))
        areas.append(count_pixels(picture, activity_color(1.0)))
    # The radius, and with it the area in the picture, grows with the square root of the force: by
    # 3.
    assert 2.0 < areas[1] / areas[0] < 3.5


def test_corners_of_rings_are_on_the_circle():
    rings = lay(BENT, 0.02, 0.1)
    surface, _ = build_tube(make_line(0.02, 0.1), BENT)
    points = surface.points.reshape(len(rings), ROUND_CORNERS, 3)
    distances = np.linalg.norm(points - rings[:, None, :3], axis=2)
    assert distances == pytest.approx(
        np.repeat(rings[:, RING.RADIUS, None], ROUND_CORNERS, axis=1), abs=1e-15
    )
