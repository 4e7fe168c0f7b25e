from __future__ import annotations

import warnings

import numpy as np
import pytest

from osimlite.io.tables.storage import StoTable
from osimlite.mechanics.multibody import build_mechanism
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.tools.evidence import Steps
from osimlite.view import panels
from osimlite.view.panel_groups import Column, group_columns, split_sides
from osimlite.view.panels import LIMIT_COLOR, MAX_PANELS, draw_pages, render_png, write_pages
from osimlite.view.table_plots import ColumnNames, describe_columns, make_title, plot_tables
from tests.suite import choose

pytest.importorskip("matplotlib")

TIMES = np.linspace(0.0, 2.0, 41)
NO_NAMES = ColumnNames({}, {}, {})


def wave(shift=0.0):
    return np.sin(3.0 * TIMES + shift)


def panels_of(columns, **options):
    return group_columns(columns, TIMES, **options)


def drawn(panels, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        figures = list(draw_pages("Title", panels, **options))
        for figure in figures:
            figure.canvas.draw() if figure.canvas else None
    return figures


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (["hip_flexion_r", "hip_flexion_l"], [("hip_flexion", "r"), ("hip_flexion", "l")]),
        (["RHip_rz", "LHip_rz"], [("Hip_rz", "r"), ("Hip_rz", "l")]),
        (["R.ASIS_X", "L.ASIS_X"], [("ASIS_X", "r"), ("ASIS_X", "l")]),
        (["knee_r_moment", "knee_l_moment"], [("knee_moment", "r"), ("knee_moment", "l")]),
        (["calcn_r_right_Fx", "calcn_l_left_Fx"], [("calcn_Fx", "r"), ("calcn_Fx", "l")]),
        (["femur_left", "femur_right"], [("femur", "l"), ("femur", "r")]),
        (["soleus_r"], [("soleus", "r")]),
        (["Reserve", "lumbar", "L5"], [("Reserve", ""), ("lumbar", ""), ("L5", "")]),
        (["r"], [("r", "")]),
    ],
)
def test_sides_are_found_in_names(names, expected):
    assert list(split_sides(names).values()) == expected


def test_left_and_right_share_a_panel_of_one_unit():
    columns = [
        Column("knee_angle_r", "deg", wave()),
        Column("knee_angle_l", "deg", wave(1.0)),
        Column("pelvis_tx", "m", TIMES),
        Column("locked", "deg", 0.0 * TIMES + 3.0),
        Column("unknown", "N", np.nan * TIMES),
    ]
    panels, notes = panels_of(columns)
    assert [(panel.title, panel.unit) for panel in panels] == [
        ("knee_angle", "deg"),
        ("pelvis_tx", "m"),
    ]
    assert [curve.side for curve in panels[0].curves] == ["r", "l"]
    assert notes == {"": "Constant: locked 3 deg, unknown (no values)"}
    (figure,) = drawn(panels, notes=notes)
    assert [axes.get_title(loc="left") for axes in figure.axes] == [
        "knee angle (deg)",
        "pelvis tx (m)",
    ]
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["right", "left"]


def test_a_page_has_twelve_panels_and_no_empty_ones():
    panels, _ = panels_of([Column(f"c{k}", "", wave(k)) for k in range(30)])
    figures = drawn(panels)
    assert [len(figure.axes) for figure in figures] == [12, 12, 6]
    assert all(axes.get_lines() for figure in figures for axes in figure.axes)
    assert [figure.get_suptitle() for figure in figures] == [f"Title ({k} of 3)" for k in (1, 2, 3)]


def test_a_group_begins_a_row_if_it_fits_there_only():
    columns = [
        Column("pelvis", "m", wave(), "pelvis"),
        *(Column(f"hip{k}", "deg", wave(k), "hip") for k in range(3)),
        Column("knee", "deg", wave(), "knee"),
    ]
    (figure,) = drawn(panels_of(columns)[0])
    tops = [round(axes.get_position().y1, 6) for axes in figure.axes]
    rows = [sorted({*tops}, reverse=True).index(top) for top in tops]
    # The panel of the knee fills the gap next to the pelvis.
    assert [axes.get_title(loc="left")[:4] for axes in figure.axes] == [
        "pelv",
        "knee",
        "hip0",
        "hip1",
        "hip2",
    ]
    assert rows == [0, 0, 1, 1, 1]


def draw_groups(sizes):
    """Draw groups of columns that are named "a", "b" and so on.

    Args:
        sizes: number of columns of each group.

    Returns:
        Titles of the panels, one text per row.
    """
    columns = [
        Column(f"{name}{k}", "deg", wave(k), name)
        for name, size in zip("abcdefghi", sizes, strict=False)
        for k in range(size)
    ]
    rows = {}
    for figure in drawn(panels_of(columns)[0]):
        for axes in figure.axes:
            top = id(figure), round(axes.get_position().y1, 6)
            rows.setdefault(top, []).append(axes.get_title(loc="left")[:2])
    return [" ".join(row) for row in rows.values()]


def test_small_groups_fill_gaps_near_their_place():
    expected = ["a0 a1 c0", "b0 b1 d0", "e0 e1 f0", "g0 g1 g2"]
    assert draw_groups((2, 2, 1, 1, 2, 1, 3)) == expected


def test_groups_that_would_leave_a_column_empty_are_divided():
    assert draw_groups((2, 2, 2, 1, 2)) == ["a0 a1 b0", "b1 c0 c1", "d0 e0 e1"]


def test_constants_are_named_on_the_pages_of_their_section():
    columns = [
        Column("a", "", wave(), section="activations"),
        Column("b", "", 0.0 * TIMES, section="activations"),
        Column("a", "m", wave(), section="lengths"),
        Column("c", "m", 0.0 * TIMES, section="speeds"),
    ]
    panels, notes = panels_of(columns)
    assert [figure.get_supxlabel() for figure in drawn(panels, notes=notes)] == [
        "Constant: b 0",
        "Constant: c 0 m",
    ]


def test_sections_have_their_own_pages():
    columns = [
        Column("a", "", wave(), section="activations"),
        Column("a", "m", wave(), section="lengths"),
    ]
    figures = drawn(panels_of(columns)[0])
    assert [figure.get_suptitle() for figure in figures] == ["Title: activations", "Title: lengths"]


def test_nothing_that_changes_is_no_picture(tmp_path):
    panels, notes = panels_of([Column("still", "m", 0.0 * TIMES)])
    assert drawn(panels, notes=notes) == []
    assert write_pages(draw_pages("", panels), tmp_path, "still") == []
    assert list(tmp_path.iterdir()) == []


def test_complete_cycles_of_both_feet_are_drawn_in_per_cent():
    steps = {"r": Steps((0.2, 1.2), (0.8,)), "l": Steps((0.7, 1.7), ())}
    columns = [Column("knee_r", "deg", wave()), Column("knee_l", "deg", wave(1.5))]
    (figure,) = drawn(panels_of(columns, steps=steps)[0])
    (axes,) = figure.axes
    assert axes.get_xlabel() == "gait cycle (%)"
    right, left = axes.get_lines()
    assert right.get_xdata()[[0, -1]].tolist() == [0.0, 100.0]
    assert right.get_ydata()[0] == pytest.approx(np.interp(0.2, TIMES, wave()))
    assert left.get_ydata()[-1] == pytest.approx(np.interp(1.7, TIMES, wave(1.5)))


def test_incomplete_cycles_are_drawn_over_time_with_lines_at_strikes():
    steps = {"r": Steps((0.2, 1.2), ()), "l": Steps((0.7,), ())}
    columns = [Column("knee_r", "deg", wave()), Column("knee_l", "deg", wave(1.5))]
    (figure,) = drawn(panels_of(columns, steps=steps)[0])
    (axes,) = figure.axes
    assert axes.get_xlabel() == "time (s)"
    at = [line.get_xdata()[0] for line in axes.get_lines() if len(line.get_xdata()) == 2]
    assert sorted(at) == [0.2, 0.7, 1.2]


def test_a_curve_that_lies_on_another_is_dashed():
    columns = [Column("knee_r", "deg", wave()), Column("knee_l", "deg", wave() + 1e-6)]
    (figure,) = drawn(panels_of(columns)[0])
    assert [line.is_dashed() for line in figure.axes[0].get_lines()] == [False, True]


@pytest.mark.parametrize("shift", [0.0, 3.0, -1e3])
def test_titles_are_where_matplotlib_puts_them(monkeypatch, shift):
    columns = [
        Column(f"c{power}", "m", 10.0**power * (wave() + shift))
        for power in range(-8, 9, choose(4, 2))
    ]
    found, _ = panels_of(columns)
    quick = [render_png(figure) for figure in draw_pages("Title", found)]
    monkeypatch.setattr(panels, "find_title_height", lambda _: None)
    assert quick == [render_png(figure) for figure in draw_pages("Title", found)]


def test_a_picture_is_drawn_once(monkeypatch):
    (figure,) = draw_pages("Title", panels_of([Column("c", "m", wave())])[0])
    count = 0

    def draw(renderer):
        nonlocal count
        count += 1
        return type(figure).draw(figure, renderer)

    monkeypatch.setattr(figure, "draw", draw)
    render_png(figure)
    assert count == 1


def table(name, columns, **options):
    return StoTable(name, TIMES, tuple(columns), np.column_stack(list(columns.values())), **options)


@pytest.mark.parametrize(
    ("name", "label", "unit", "words"),
    [
        ("Coordinates", "RHip_rz", "deg", "RHip_rz"),
        ("Coordinates", "Pelvis_tx", "m", "Pelvis_tx"),
        ("Speeds", "RHip_rz", "deg/s", "RHip_rz"),
        ("walk", "/jointset/RHip/RHip_rz/value", "deg", "RHip_rz"),
        ("walk", "/jointset/RHip/RHip_rz/speed", "deg/s", "RHip_rz"),
        ("walk", "/forceset/soleus_r/activation", "0–1", "soleus_r"),
        ("walk", "/forceset/soleus_r/fiber_length", "m", "soleus_r"),
        ("walk", "soleus_r.fiber_length", "m", "soleus_r"),
        ("Inverse Dynamics Generalized Forces", "RHip_rz_moment", "N·m", "RHip_rz"),
        ("Inverse Dynamics Generalized Forces", "Pelvis_tx_force", "N", "Pelvis_tx"),
        ("Positions", "femur_r_X", "m", "femur_r X"),
        ("Positions", "femur_r_Ox", "deg", "femur_r Ox"),
        ("Accelerations", "femur_r_X", "m/s²", "femur_r X"),
        ("JointReaction", "knee_on_tibia_in_tibia_fx", "N", "knee_on_tibia_in_tibia fx"),
        ("ModelForces", "Foot.Shank.force.X", "N", "Foot.Shank force.X"),
        ("ModelForces", "calcn_r_right_Fx", "N", "calcn_r_right Fx"),
        ("ActuatorForces", "RHip_rz", "N·m", "RHip_rz"),
        ("ActuatorForces", "whatever", "N or N·m", "whatever"),
        ("ActuatorPowers", "soleus_r", "W", "soleus_r"),
        ("MomentArm_knee_angle_r", "soleus_r", "m", "soleus_r"),
        ("FiberForce", "soleus_r", "N", "soleus_r"),
        ("MuscleActuatorPower", "soleus_r", "W", "soleus_r"),
        ("PennationAngle", "soleus_r", "deg", "soleus_r"),
        ("NormalizedFiberLength", "soleus_r", "× optimal length", "soleus_r"),
        ("NormFiberVelocity", "soleus_r", "× maximal speed", "soleus_r"),
        ("PointVelocity", "state_0", "m/s", "state_0"),
        ("something else", "a", "", "a"),
    ],
)
def test_columns_have_the_units_of_their_tables(name, label, unit, words):
    names = ColumnNames.from_model(None, build_mechanism(dynamic_walker()))
    (column,) = describe_columns(table(name, {label: wave()}), names)
    assert (column.unit, column.name) == (unit, words)


def test_activations_and_controls_have_units() -> None:
    names = ColumnNames({}, {"soleus_r": "N", "lumbar": "N·m"}, {"soleus_r": "tibia – calcn"})
    values = {"soleus_r": 0.2 + 0.1 * wave(), "lumbar": wave(), "unknown": wave()}
    columns = describe_columns(table("Static Optimization", values), names)
    assert [column.unit for column in columns] == ["0–1", "× optimal force", ""]
    (figure,) = drawn(panels_of(columns)[0])
    # The axis of activations ends at 1, so that small activations look small.
    lowest, highest = figure.axes[0].get_ylim()
    assert lowest <= 0.0 and 1.0 <= highest < 1.1
    constant = describe_columns(table("Static Optimization", {"soleus_r": 0.5 + 0 * TIMES}), names)
    assert panels_of(constant)[1] == {"": "Constant: soleus_r 0.5"}


@pytest.mark.parametrize(
    ("file_stem", "title"),
    [
        ("so_StaticOptimization_activation", "SO, activations"),
        ("StaticOptimization_activation", "Activations"),
        ("walk_1_BodyKinematics_pos_global", "Walk 1, positions of bodies"),
        ("so_Kinematics_q", "SO, coordinates"),
        ("so_PointKinematics_knee_pos", "SO, position of knee"),
        (
            "so_MuscleAnalysis_MomentArm_knee_angle_r",
            "SO, moment arms about knee angle r",
        ),
        ("so_MuscleAnalysis_NormFiberVelocity", "SO, normalized fiber velocity"),
        ("MuscleAnalysis_PennationAngle", "Pennation angle"),
        ("so_JointReaction_ReactionLoads", "SO, loads at joints"),
        ("ik", "IK"),
        ("walk_states", "Walk states"),
    ],
)
def test_titles_name_the_quantity_of_a_table(file_stem: str, title: str) -> None:
    assert make_title(file_stem) == title


def test_angles_are_in_degrees_whatever_the_table_has():
    names = ColumnNames.from_model(None, build_mechanism(dynamic_walker()))
    for in_degrees, factor in ((True, 1.0), (False, np.degrees(1.0))):
        item = table("Coordinates", {"RHip_rz": wave()}, in_degrees=in_degrees)
        (column,) = describe_columns(item, names)
        assert column.values == pytest.approx(factor * wave())


def test_muscles_are_grouped_by_the_bodies_that_they_join():
    from osimlite.models.source import make_model

    names = ColumnNames.from_model(make_model("jumper"))
    assert names.regions["soleus_r"] == "tibia – foot" == names.regions["soleus_l"]
    assert names.units["soleus_r"] == "N"


def test_tables_are_written_as_pages(tmp_path):
    many = {f"m{k}": wave(k) for k in range(MAX_PANELS + 1)}
    tables = {"walk.v1_states.sto": table("walk", many), "still.sto": table("x", {"a": 0 * TIMES})}
    done = []
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        written = plot_tables(
            tables, tmp_path, NO_NAMES, report=lambda *counts: done.append(counts)
        )
    assert [path.name for path in written] == ["walk.v1_states.png", "walk.v1_states-2.png"]
    assert done == [(1, 2), (2, 2)]
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in written)


def test_results_draw_themselves(tmp_path):
    from osimlite.simulation import simulate

    pages = simulate(dynamic_walker(), 0.05).plot(tmp_path)
    assert "coordinates.png" in dict(pages) and (tmp_path / "coordinates.png").is_file()
    assert pages._repr_html_().count("<img ") == len(pages) == len(pages.figures)
    item = table("Coordinates", {"a_r": wave(), "a_l": wave(1.0)}, file="x/walk.mot")
    assert repr(item.plot()) == "Pages: walk.png"
    assert "nothing changes" in repr(table("x", {"a": 0 * TIMES}).plot())


def test_rounding_errors_of_a_constant_moment_arm_do_not_show():
    from osimlite.view.muscle_plots import widen_constant_range
    from osimlite.view.panels import make_figure

    place = make_figure("", (4.0, 3.0)).subplots()
    place.plot(TIMES, 0.042 + 1e-17 * wave())
    widen_constant_range(place)
    low, high = place.get_ylim()
    assert high - low > 0.008


def test_limits_near_the_curves_are_lines() -> None:
    times = np.linspace(0.0, 1.0, 11)
    columns = [
        Column("soleus_r", "", times, limits=(0.01, 1.0)),
        Column("vastus_r", "N", 10.0 * times, limits=(5000.0,)),
    ]
    panels, _ = group_columns(columns, times)
    (figure,) = draw_pages("", panels)
    drawn = [
        [line.get_ydata()[0] for line in axes.lines if line.get_color() == LIMIT_COLOR]
        for axes in figure.axes
    ]
    # A distant limit is not drawn, because it would flatten the curve.
    assert drawn == [[0.01, 1.0], []]


def test_the_last_number_of_the_abscissa_is_inside_the_picture():
    items, _ = panels_of([Column(name, "deg", wave()) for name in "abc"])
    (figure,) = drawn(items)
    width = figure.bbox.width
    for axes in figure.axes:
        for label in axes.get_xticklabels():
            assert label.get_window_extent().x1 <= width
