"""Tests of reference bands from a user's file, which are drawn behind curves over the gait cycle."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from osimlite.errors import DocumentError, SettingError
from osimlite.io.tables.storage import StoTable
from osimlite.tools.evidence import Steps
from osimlite.view.bands import Band, read_bands
from osimlite.view.panel_groups import Column, group_columns
from osimlite.view.panels import draw_pages
from osimlite.view.table_plots import ColumnNames, plot_tables

pytest.importorskip("matplotlib")

TEXT = "per cent, knee_mean, knee_sd\n0, 5, 2\n50, 20, 3\n100, 5, 2\n"
TIMES = np.linspace(0.0, 2.0, 41)
NO_NAMES = ColumnNames({}, {}, {})


def test_a_band_lies_behind_the_curves_of_its_panel(tmp_path: Path) -> None:
    path = tmp_path / "walking.csv"
    path.write_text(TEXT)
    bands = read_bands(path)
    assert bands["knee"].deviation.tolist() == [2.0, 3.0, 2.0]
    columns = [Column("knee", "deg", np.sin(TIMES)), Column("hip", "deg", np.cos(TIMES))]
    steps = {"r": Steps((0.2, 1.2), (0.8,))}
    panels, _ = group_columns(columns, TIMES, steps=steps)
    panels = [panel._replace(band=bands.get(panel.title)) for panel in panels]
    (figure,) = draw_pages("", panels)
    assert [len(axes.collections) for axes in figure.axes] == [1, 0]
    # A band is defined over the gait cycle, so it is not drawn over time.
    (figure,) = draw_pages(
        "",
        [panel._replace(curves=[c._replace(steps={}) for c in panel.curves]) for panel in panels],
    )
    assert not any(axes.collections for axes in figure.axes)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "has no pair of a mean"),
        ("per cent, knee_mean\n0, 1\n1, 1\n", "'knee_sd' is missing"),
        (TEXT.replace("20", "many"), "expected a number in each cell, found ' ?many'"),
        (TEXT.replace("50", "0"), "increase"),
        (TEXT.replace("50, 20", "50"), "a row has 2 cells, expected one for each of the 3 columns"),
    ],
)
def test_a_file_without_bands_is_an_error(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "walking.csv"
    path.write_text(text)
    with pytest.raises(DocumentError, match=words):
        read_bands(path)


def test_a_band_that_nothing_shows_is_an_error(tmp_path: Path) -> None:
    table = StoTable("angles", TIMES, ("knee",), np.sin(TIMES)[:, None])
    numbers = np.zeros(3)
    band = Band(np.array([0.0, 50.0, 100.0]), numbers, numbers)
    with pytest.raises(SettingError, match="the bands are named hip"):
        plot_tables({"a.sto": table}, tmp_path, NO_NAMES, bands={"hip": band})
    with pytest.raises(SettingError, match="complete gait cycle"):
        plot_tables({"a.sto": table}, tmp_path, NO_NAMES, bands={"knee": band})


def test_the_source_of_a_band_is_named(tmp_path: Path) -> None:
    path = tmp_path / "walking.csv"
    path.write_text(TEXT)
    assert read_bands(path)["knee"].source == "walking.csv"
    path.write_text("# source: Adults,\n# own laboratory\n" + TEXT)
    bands = read_bands(path)
    assert bands["knee"].source == "Adults, own laboratory"
    table = StoTable("", TIMES, ("knee",), np.sin(TIMES)[:, None])
    drawn = []
    plot_tables(
        {"ik.mot": table},
        tmp_path,
        NO_NAMES,
        steps={"r": Steps((0.2, 1.2), (0.8,))},
        bands=bands,
        report=lambda *counts: drawn.append(counts),
    )
    assert drawn == [(1, 1)] and (tmp_path / "ik.png").is_file()
