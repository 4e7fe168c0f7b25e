"""Picture of a basin of attraction."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from osimlite.base.files import write_atomically
from osimlite.studies.gait.basin import Basin
from osimlite.view.lettering import plain_lettering
from osimlite.view.panels import make_figure, render_png


def draw_basin(basin: Basin, path: str | Path, *, title: str = "Steps before the fall") -> Path:
    """Draw the number of steps over the grid of initial states, and mark the cycle.

    Args:
        basin: basin to draw.
        path: PNG file to write.
        title: title of the picture.

    Returns:
        Path of the file.

    Raises:
        MissingDependency: matplotlib is not installed.
        OsimliteError: the file cannot be written.
    """
    with plain_lettering():
        return _draw_panels(basin, Path(path), title)


def _draw_panels(basin: Basin, path: Path, title: str) -> Path:
    """Draw the numbers of steps over the initial states.

    Returns:
        Path of the PNG file.
    """
    figure = make_figure("", (6.4, 5.2))
    axes = figure.subplots()
    half_pixel = [float(axis.values[1] - axis.values[0]) / 2.0 for axis in (basin.x, basin.y)]
    x, y = basin.x.values, basin.y.values
    # Each initial state is the centre of a pixel.
    extent = (
        x[0] - half_pixel[0],
        x[-1] + half_pixel[0],
        y[0] - half_pixel[1],
        y[-1] + half_pixel[1],
    )
    image = axes.imshow(
        basin.steps,
        origin="lower",
        extent=extent,
        aspect="auto",
        cmap="viridis",
        vmin=0,
        vmax=basin.target_steps,
    )
    axes.plot(*basin.center, marker="o", mfc="#d55e00", mec="white", ms=8)
    axes.annotate(
        "cycle",
        basin.center,
        (8, 6),
        textcoords="offset points",
        color="black",
        fontsize=10,
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 1.5},
    )
    axes.set_xlabel(basin.x.label)
    axes.set_ylabel(basin.y.label)
    axes.set_title(
        f"{title}: {100.0 * basin.part:.0f} % of {basin.steps.size} starts walk",
        loc="left",
        fontsize=11,
    )
    bar = figure.colorbar(image, ax=axes)
    bar.set_label(f"steps, {basin.target_steps} or more count as walking")
    bar.set_ticks(np.linspace(0, basin.target_steps, 5).round().astype(int))
    write_atomically(path, render_png(figure))
    return path
