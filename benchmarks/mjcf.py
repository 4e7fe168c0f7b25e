"""Accuracy of MuJoCo models: osimlite's translation and published translations of the same models.

    python benchmarks/mjcf.py [FOLDER]

FOLDER contains clones of the repositories with the published models; missing ones are skipped:

    git clone https://github.com/MyoHub/myoconverter
    git clone https://github.com/aikkala/O2MConverter
    git clone https://github.com/MyoHub/myo_sim
    git clone https://github.com/opensim-org/opensim-models

The published files are older than MuJoCo 4, which interprets side sites differently: install MuJoCo
3 for this comparison.

Each translation is compared with the OpenSim model in the same random poses. The columns are the
processor time of the translation (s), the errors of muscle lengths (mm) and of moment arms (mm),
the error of the muscle force as a fraction of the maximum isometric force, the number of muscles
whose fiber length is wrong by more than 10 %, and the greatest factor by which one is wrong.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import mujoco
import numpy as np

import osimlite
from osimlite.translate.mjcf.check import Check, check_mjcf
from osimlite.translate.mjcf.draft import Fit, Version

MYOCONVERTER = "myoconverter/models"
O2MCONVERTER = "O2MConverter/models"
MYO_SIM = "myo_sim"
OPENSIM_MODELS = "opensim-models/Models"

TRANSLATIONS = {
    f"{MYOCONVERTER}/osim/Arm26/arm26.osim": [
        f"{MYOCONVERTER}/mjc/Arm26/arm26_cvt3.xml",
        f"{MYO_SIM}/elbow/myoelbow_2dof6muscles.xml",
    ],
    f"{MYOCONVERTER}/osim/Gait10dof18musc/gait10dof18musc.osim": [
        f"{MYOCONVERTER}/mjc/Gait10dof18musc/gait10dof18musc_cvt3.xml",
        f"{O2MCONVERTER}/converted/gait10dof18musc_converted/gait10dof18musc_converted.xml",
    ],
    f"{MYOCONVERTER}/osim/Leg6Dof9Musc/leg6dof9musc.osim": [
        f"{MYOCONVERTER}/mjc/Leg6Dof9Musc/leg6dof9musc_cvt3.xml",
        f"{O2MCONVERTER}/converted/leg6dof9musc_converted/leg6dof9musc_converted.xml",
    ],
    f"{MYOCONVERTER}/osim/Gait2354Simbody/gait2354.osim": [
        f"{MYOCONVERTER}/mjc/Gait2354Simbody/gait2354_cvt3.xml"
    ],
    f"{O2MCONVERTER}/opensim/Gait2392_Simbody/gait2392_millard2012muscle.osim": [
        f"{O2MCONVERTER}/converted/gait2392_millard2012muscle_converted/gait2392_millard2012muscle_converted.xml"
    ],
    f"{OPENSIM_MODELS}/Rajagopal/Rajagopal2016.osim": [f"{MYO_SIM}/leg/myolegs.xml"],
}
"""OpenSim models, and the published MuJoCo models made from them."""

FITS: tuple[Fit, ...] = ("none", "wraps", "force")
"""Values of osimlite's option `--fit`: nothing, wrap surfaces, or also muscle forces are fitted."""

HEADINGS = (
    f"{'':24} {'s':>5} {'length, mm':>16} {'moment arm, mm':>24} {'force':>6} {'fiber':>8} {'worst':>6}\n"
    f"{'':24} {'':>5} {'median':>8}{'worst':>8} {'mean':>8}{'90 %':>8}{'worst':>8} {'/ Fmax':>6} {'> 10 %':>8} {'x':>6}"
)


def format_row(name: str, seconds: float | None, check: Check) -> str:
    """Return one line of the table.

    Args:
        name: name of the translation.
        seconds: processor time of the translation (s), None if it is published.
        check: root mean square errors of each muscle, and of each muscle and coordinate.
    """
    lengths = np.array([muscle.length.rms for muscle in check.muscles]) * 1e3
    arms = np.array([error.rms for muscle in check.muscles for error in muscle.arms.values()]) * 1e3
    forces = [muscle.force.rms for muscle in check.muscles if muscle.force]
    force = np.median(forces) if forces else np.nan
    fibers = np.array([muscle.fiber for muscle in check.muscles if muscle.fiber])
    wrong = np.abs(fibers - 1.0) > 0.1
    # A fiber may be too long or too short by a factor; both count alike.
    worst = max([*fibers, *(1.0 / np.abs(fibers))], default=1.0)
    time_cell = "" if seconds is None else f"{seconds:.1f}"
    return (
        f"{name:24} {time_cell:>5} {np.median(lengths):8.3f}{lengths.max():8.2f} "
        f"{arms.mean():8.3f}{np.percentile(arms, 90):8.2f}{arms.max():8.2f} "
        f"{force:6.3f} {f'{wrong.sum()} of {len(wrong)}':>8} {worst:6.2f}"
    )


def write_loadable_copy(file: Path) -> Path:
    """Write a copy of a MuJoCo file next to it, without attributes that MuJoCo no longer reads."""
    copy = file.with_name(f"{file.stem}_now.xml")
    text = file.read_text(encoding="utf-8")
    # The attribute only selects contacts, which are not compared here.
    for word in ("all", "predefined", "dynamic"):
        text = text.replace(f'collision="{word}"', "")
    copy.write_text(text, encoding="utf-8")
    return copy


def print_own_translations(model: osimlite.Model, version: Version) -> None:
    """Translate a model with each fit, and print one line for each."""
    # All translations go into one folder: the later ones overwrite the earlier.
    with TemporaryDirectory() as folder:
        for fit in FITS:
            # Processor time, because other work on the machine counts little then.
            start = time.process_time()
            translation = osimlite.to_mjcf(model, mujoco=version, visuals=False, fit=fit)
            seconds = time.process_time() - start
            check = check_mjcf(model, translation.write(folder)[0])
            print(format_row(f"  osimlite --fit {fit}", seconds, check), flush=True)


def print_published_translation(model: osimlite.Model, base: Path, file: str) -> None:
    """Print one line for a published translation.

    Args:
        model: OpenSim model.
        base: folder with the clones.
        file: path of the MuJoCo model in it; its first folder is the name of the repository.
    """
    repository = file.partition("/")[0]
    check = check_mjcf(model, write_loadable_copy(base / file))
    print(format_row(f"  {repository}", None, check), flush=True)


def main(base: Path) -> None:
    """Print the table of all models that are present."""
    version: Version = 4 if mujoco.__version__ >= "4" else 3
    print(f"MuJoCo {mujoco.__version__}\n{HEADINGS}")
    for file, published in TRANSLATIONS.items():
        # The clone of this repository may be missing.
        if not (base / file).exists():
            continue
        model = osimlite.read(base / file)
        print(Path(file).stem)
        print_own_translations(model, version)
        for translation in published:
            if (base / translation).exists():
                print_published_translation(model, base, translation)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
