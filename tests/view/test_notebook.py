"""Tests of the output in notebooks, as HTML and in a browser."""

from __future__ import annotations

import base64
import gzip
import re
import subprocess
import sys
import time
from html import escape, unescape
from pathlib import Path

import osimlite
from osimlite.lint.diagnostic import Finding, Report, Severity
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.schema.model import Model
from osimlite.view import notebook


def page_in(html: str) -> str:
    """Unpack the page that an output contains."""
    (packed,) = re.findall(r'atob\("([^"]+)"\)', unescape(html))
    return gzip.decompress(base64.b64decode(packed)).decode()


def test_a_model_shows_its_tree_and_itself():
    model = dynamic_walker()
    html = model._repr_html_()
    assert (
        f"{sum(not model.tree().is_internal(item) for item in model.components())} components"
        in html
    )
    assert "RightThigh <i>Body</i>" in html and "sandbox='allow-scripts'" in html
    assert "three.js" in page_in(html)
    # The notebook has nothing to load.
    assert not re.search(r"(?:src|href)=", html)


def test_only_models_show_themselves_so():
    assert not hasattr(dynamic_walker().body_set, "_repr_html_")


def test_names_are_text():
    model = Model(name="<script>alert(1)</script>")
    html = model._repr_html_()
    assert "<script>alert" not in html and "&lt;script&gt;alert" in html


def test_a_model_with_a_wrong_reference_is_shown_without_that_part(fixtures: Path):
    model = osimlite.read(fixtures / "lint" / "OSIM303" / "fail-01-example.osim")
    html = model._repr_html_()
    assert "not shown: /markerset/asis: " in html and "no picture:" not in html


def test_a_page_too_large_is_left_out(monkeypatch):
    monkeypatch.setattr(notebook, "MAX_BYTES", 1000)
    html = dynamic_walker()._repr_html_()
    assert "too large" in html and len(html) < 30_000


def test_meshes_are_found_beside_the_file(tmp_path: Path):
    source = dynamic_walker()
    source.body_set.objects[0].attach(osimlite.Mesh(name="mesh", mesh_file="cube.obj"))
    osimlite.write(source, tmp_path / "model.osim")
    (tmp_path / "cube.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert "not shown" not in osimlite.read(tmp_path / "model.osim")._repr_html_()
    assert "not shown" in source._repr_html_()


def test_findings_are_a_table_the_worst_first():
    result = [
        Finding("OSIM508", "limit", Severity.INFO, "a < b"),
        Finding("OSIM101", "x", Severity.ERROR, "no", "f", 3),
    ]
    html = Report(result)._repr_html_()
    assert html.index("OSIM101") < html.index("OSIM508")
    assert "1 error, 0 warnings, 1 remark" in html and "f:3" in html and "a &lt; b" in html
    many = Report(result * 200)._repr_html_()
    assert "and 200 more" in many and many.count("<tr>") == notebook.MAX_ROWS + 1


def test_findings_and_trees_need_no_arrays():
    code = """
import sys
sys.modules["numpy"] = None
import osimlite
from osimlite.lint import Report
print(Report()._repr_html_(), osimlite.Model(name="bare")._repr_html_())
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "0 errors" in done.stdout and "<b>bare</b>" in done.stdout
    assert "no picture: the picture needs numpy" in done.stdout


def test_paths_are_a_table_of_lengths_and_moment_arms():
    model = osimlite.Model(name="arm")
    bone = model.add(osimlite.Body(name="bone", mass=1.0))
    joint = osimlite.PinJoint(name="elbow", coordinates=[osimlite.Coordinate(name="flexion")])
    model.add(joint.between(model.ground, bone))
    path = osimlite.GeometryPath()
    for name, frame, place in (
        ("a", model.ground, (0.05, 0.0, 0.0)),
        ("b", bone, (0.0, -0.12, 0.0)),
    ):
        path.path_point_set.objects.append(
            osimlite.PathPoint(name=name, socket_parent_frame=frame, location=place)
        )
    model.add(
        osimlite.PathSpring(name="spring", geometry_path=path, resting_length=0.1, stiffness=1.0)
    )
    html = osimlite.paths(model)._repr_html_()
    # 0.13 m is the hypotenuse of 0.05 and 0.12 m; the moment arm follows from the area of the
    # triangle.
    assert "<td style='text-align:left'>0.13</td>" in html and "flexion 0.04615" in html


def test_a_motion_has_a_heading_and_a_table_of_its_columns():
    motion = osimlite.simulate(dynamic_walker(), to=0.01)
    html = motion._repr_html_().partition("<iframe")[0]
    assert html.startswith(f"<details><summary>{escape(motion.heading)}</summary><table>")
    # The table has one row per coordinate below its head.
    assert html.count("<tr>") == 1 + len(motion.coordinates)
    assert "<td>rad</td>" in html and "smallest" in html


def test_a_motion_is_played_in_a_frame_without_rights(open_page, tmp_path: Path):
    (tmp_path / "page.html").write_text(
        "<!doctype html>" + osimlite.simulate(dynamic_walker(), to=0.1)._repr_html_()
    )
    page = open_page(tmp_path / "page.html", waits=False)
    frame = page.page.frame_locator("iframe")
    frame.locator("#play").click(timeout=30_000)
    inner = page.page.frames[1]
    assert inner.evaluate("window.origin") == "null"
    end = time.monotonic() + 30.0
    while inner.evaluate("window.osimlite.viewer.time") == 0.0:
        assert time.monotonic() < end, "the motion does not play"
        page.page.wait_for_timeout(50)
    assert [
        url for url in page.asked if not url.startswith(("file:", "data:", "blob:", "about:"))
    ] == []
