from __future__ import annotations

import dataclasses
import sys

import numpy as np
import pytest

from osimlite.errors import MissingDependency, OsimliteError
from osimlite.mechanics.multibody import build_mechanism
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.simulation import simulate
from osimlite.view import plot_simulation
from osimlite.view.panels import make_figure
from osimlite.view.plots import STORED, compute_energies, draw_figures, draw_lines
from tests.view.motions import Recorded, stroll

pytest.importorskip("matplotlib")


def walker():
    return build_mechanism(dynamic_walker())


def drawn(name, motion=None, mechanism="walker"):
    """Return the figure of a name with its final layout.

    Args:
        name: name of the figure.
        motion: motion to draw; the stroll of the walker by default.
        mechanism: mechanism of the motion; the walker by default.
    """
    figures = dict(
        draw_figures(motion or stroll(), walker() if mechanism == "walker" else mechanism)
    )
    return laid_out(figures[name])


def laid_out(figure):
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    FigureCanvasAgg(figure).draw()
    return figure


def lines(panel):
    return {line.get_label(): line for line in panel.get_lines()}


def test_pictures_are_written(tmp_path):
    paths = plot_simulation(stroll(), tmp_path / "a" / "b", mechanism=walker())
    assert [path.name for path in paths] == [
        "coordinates.png",
        "contact_forces.png",
        "other_forces.png",
        "energy.png",
    ]
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in paths)
    assert sorted(path.name for path in (tmp_path / "a" / "b").iterdir()) == sorted(
        path.name for path in paths
    )


def test_the_mechanism_of_the_trajectory_will_do(tmp_path):
    motion = stroll()
    motion.mechanism = walker()
    assert len(plot_simulation(motion, tmp_path)) == 4


def test_names_are_drawn_as_they_are(tmp_path):
    motion = stroll()
    motion.coordinates = [f"{name} $x^{{_$ \u4e16\x9b" for name in motion.coordinates]
    assert plot_simulation(motion, tmp_path)


def titles(figure):
    return [panel.get_title(loc="left") for panel in figure.axes]


def notes(figure):
    return figure.get_supxlabel()


def test_angles_are_in_degrees_and_lengths_in_metres():
    figure = drawn("coordinates.png")
    assert titles(figure) == ["Pelvis tx (m)"]
    (lengths,) = figure.axes
    assert lengths.get_xlabel() == "time (s)"
    assert lengths.get_lines()[0].get_ydata()[-1] == pytest.approx(0.5)
    assert "platform_rz -10 deg" in notes(figure) and "RHip_rz 30 deg" in notes(figure)


def test_many_coordinates_are_shared_out_to_pages():
    names = tuple(f"c{k}" for k in range(16))
    times = np.linspace(0.0, 1.0, 5)
    values = np.add.outer(times, np.arange(16.0))
    motion = Recorded(times, names, values, np.zeros((5, 16)))
    pages = dict(draw_figures(motion, None))
    assert {name: len(page.axes) for name, page in pages.items()} == {
        "coordinates.png": 9,
        "coordinates-2.png": 7,
    }


def test_a_line_that_lies_on_another_lets_it_through():
    panel, across = make_figure("", (4.0, 3.0)).subplots(), np.linspace(0.0, 1.0, 5)
    gone = np.full(5, np.nan)
    draw_lines(
        panel,
        across,
        {"one": across, "same": across + 1e-5, "other": across**2, "gone": gone, "too": gone},
    )
    assert [line.is_dashed() for line in panel.get_lines()] == [False, True, False, False, True]


def test_no_legend_covers_data_and_all_is_on_the_sheet():
    motion, legends = stroll(), 0
    for _, figure in draw_figures(motion, walker()):
        sheet = laid_out(figure).bbox
        for panel in figure.axes:
            legend = panel.get_legend()
            if legend is not None:
                legends += 1
                box = legend.get_window_extent()
                assert not box.overlaps(panel.get_window_extent())
                assert box.x1 <= sheet.x1 + 1
            for text in (*panel.texts, panel.xaxis.label, panel.yaxis.label):
                if text.get_text():
                    box = text.get_window_extent()
                    assert box.x0 >= 0 and box.y0 >= 0 and box.x1 <= sheet.x1
    assert legends


def test_contact_forces_are_sizes_of_what_acts():
    above, below = drawn("contact_forces.png").axes
    assert set(lines(above)) == {"RFootForce on RightShank"}
    assert lines(above)["RFootForce on RightShank"].get_ydata().max() == pytest.approx(100.0)
    assert above.get_ylabel() == "force (N)"
    assert "never in contact: LFootForce" in [text.get_text() for text in below.texts]
    (bars,) = below.collections
    assert np.ptp(bars.get_paths()[0].vertices[:, 0]) == pytest.approx(0.18, abs=0.011)


def test_other_forces_leave_out_what_never_acts():
    figure = drawn("other_forces.png")
    assert titles(figure) == ["KneeLimitTorque (N or N·m)"]
    assert notes(figure) == "Constant: LKneeLimitTorque 0 N or N·m"


def test_long_notes_leave_the_panels_their_width():
    motion = stroll()
    motion.forces |= {
        f"a_muscle_that_rests_{index}": np.zeros(len(motion.times)) for index in range(60)
    }
    figure = drawn("other_forces.png", motion)
    (panel,), sheet = figure.axes, figure.bbox
    assert notes(figure).endswith("and 49 more")
    assert panel.get_window_extent().width > 0.6 * sheet.width
    box = figure._supxlabel.get_window_extent()
    assert box.x1 <= sheet.x1 and box.y0 >= 0 and box.y1 < panel.xaxis.label.get_window_extent().y0


def test_states_of_a_kind_share_pages_and_probes_have_theirs():
    waves = np.sin(np.arange(12.0))
    states = {
        f"/forceset/m{index}/{kind}": index + waves
        for index in range(9)
        for kind in ("activation", "fiber_length")
    }
    motion = stroll(12)
    motion.auxiliary = states
    motion.probes = {"work": np.arange(12.0)}
    figures = dict(draw_figures(motion, walker()))
    (panel,) = laid_out(figures["probes.png"]).axes
    assert panel.get_lines()[0].get_ydata().tolist() == list(range(12))
    figure = laid_out(figures["states.png"])
    assert figure.get_suptitle() == "States: activations"
    assert titles(figure) == [f"m{index} (0–1)" for index in range(9)]
    figure = laid_out(figures["states-2.png"])
    assert titles(figure)[8] == "m8 (m)"
    assert figure.axes[8].get_lines()[0].get_ydata() == pytest.approx(8.0 + waves)


def test_energy_is_that_of_the_mechanism():
    motion, mechanism = stroll(1001), walker()
    times, parts = compute_energies(motion, mechanism)
    assert len(times) == 400 and times[-1] == motion.times[-1]
    at = 200
    q, u = motion.values[0].copy(), motion.speeds[0]
    q[mechanism.coordinate_index("Pelvis_tx")] = times[at]
    assert parts["kinetic"][at] == pytest.approx(mechanism.kinetic_energy(q, u), rel=1e-12)
    # 5 kg slide down a slope of 10 degrees.
    fall = -5.0 * 9.80665 * times[at] * np.sin(np.radians(10))
    height = parts["potential of gravity"]
    assert height[at] - height[0] == pytest.approx(fall, rel=1e-9)
    assert height[at] == mechanism.potential_energy(q)


def test_energy_of_a_simulation_has_what_contacts_store():
    trajectory = simulate(dynamic_walker(), 0.1)
    (panel,) = dict(draw_figures(trajectory, trajectory.mechanism))["energy.png"].axes
    result = lines(panel)
    assert set(result) == {"kinetic", "potential of gravity", STORED, "sum"}
    stored, total = (trajectory.energy[part] for part in ("stored", "total"))
    assert result[STORED].get_ydata() == pytest.approx(stored) and stored[0] > 1.0
    assert result["sum"].get_ydata() == pytest.approx(total)
    # The summary of the simulation states the same energies.
    said = trajectory.summary["energy_J"]
    assert result["sum"].get_ydata()[[0, -1]] == pytest.approx(
        [said["start"]["total"], said["end"]["total"]]
    )
    assert [text.get_text() for text in panel.texts] == [
        "gravity: zero at the origin of the ground"
    ]


def test_a_motion_without_forces_has_no_pictures_of_forces(tmp_path):
    motion = dataclasses.replace(stroll(), forces={})
    names = [path.name for path in plot_simulation(motion, tmp_path, mechanism=walker())]
    assert names == ["coordinates.png", "energy.png"]


def test_failures_are_said_in_a_sentence(tmp_path, monkeypatch):
    motion = stroll()
    empty = Recorded(motion.times[:0], motion.coordinates, motion.values[:0], motion.speeds[:0])
    with pytest.raises(OsimliteError, match="no rows"):
        plot_simulation(empty, tmp_path)
    (tmp_path / "taken").write_text("")
    with pytest.raises(OsimliteError, match="cannot make a folder here"):
        plot_simulation(motion, tmp_path / "taken")
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(MissingDependency, match=r"osimlite\[plot\]"):
        plot_simulation(motion, tmp_path)


def test_drawing_reports_how_many_plots_are_done(tmp_path):
    from osimlite.base.progress import listen_to_progress

    reports = []
    trajectory = simulate(dynamic_walker(), to=0.05)
    with listen_to_progress(lambda *report: reports.append(report)):
        plot_simulation(trajectory, tmp_path)
    drawn = [report for report in reports if report[0] == "drawing"]
    assert [report[1:] for report in drawn] == [(k, 6, " plots") for k in range(1, 7)]
