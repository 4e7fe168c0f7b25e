"""What osimlite makes of models for MuJoCo beside what others have published, in the same random poses.

Give a folder with clones of the repositories of the others; those that are not there are left out:

    git clone https://github.com/MyoHub/myoconverter
    git clone https://github.com/aikkala/O2MConverter
    git clone https://github.com/MyoHub/myo_sim
    git clone https://github.com/opensim-org/opensim-models

Their files are older than MuJoCo 4, which gives side sites another meaning: compare with MuJoCo 3
installed. Seconds are of processors, not of the clock.
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
from osimlite.translate.mjcf.draft import Version

MYO, O2M, SIM, OPENSIM = (
    "myoconverter/models",
    "O2MConverter/models",
    "myo_sim",
    "opensim-models/Models",
)
FILES = {
    f"{MYO}/osim/Arm26/arm26.osim": [
        f"{MYO}/mjc/Arm26/arm26_cvt3.xml",
        f"{SIM}/elbow/myoelbow_2dof6muscles.xml",
    ],
    f"{MYO}/osim/Gait10dof18musc/gait10dof18musc.osim": [
        f"{MYO}/mjc/Gait10dof18musc/gait10dof18musc_cvt3.xml",
        f"{O2M}/converted/gait10dof18musc_converted/gait10dof18musc_converted.xml",
    ],
    f"{MYO}/osim/Leg6Dof9Musc/leg6dof9musc.osim": [
        f"{MYO}/mjc/Leg6Dof9Musc/leg6dof9musc_cvt3.xml",
        f"{O2M}/converted/leg6dof9musc_converted/leg6dof9musc_converted.xml",
    ],
    f"{MYO}/osim/Gait2354Simbody/gait2354.osim": [f"{MYO}/mjc/Gait2354Simbody/gait2354_cvt3.xml"],
    f"{O2M}/opensim/Gait2392_Simbody/gait2392_millard2012muscle.osim": [
        f"{O2M}/converted/gait2392_millard2012muscle_converted/gait2392_millard2012muscle_converted.xml"
    ],
    f"{OPENSIM}/Rajagopal/Rajagopal2016.osim": [f"{SIM}/leg/myolegs.xml"],
}
"""Models, and the files that others have made of them."""

HEAD = f"{'':24} {'s':>5} {'length, mm':>16} {'moment arm, mm':>24} {'force':>6} {'fiber':>8} {'worst':>6}"
UNDER = f"{'':24} {'':>5} {'median':>8}{'worst':>8} {'mean':>8}{'90 %':>8}{'worst':>8} {'/ Fmax':>6} {'> 10 %':>8} {'x':>6}"


def row(name: str, seconds: float | None, check: Check) -> str:
    """One line of the table: root mean squares of each muscle, or of each muscle and coordinate."""
    lengths = np.array([muscle.length.rms for muscle in check.muscles]) * 1e3
    arms = np.array([error.rms for muscle in check.muscles for error in muscle.arms.values()]) * 1e3
    forces = [muscle.force.rms for muscle in check.muscles if muscle.force]
    fibers = np.array([muscle.fiber for muscle in check.muscles if muscle.fiber])
    off, worst = np.abs(fibers - 1.0) > 0.1, max([*fibers, *(1.0 / np.abs(fibers))], default=1.0)
    took = "" if seconds is None else f"{seconds:.1f}"
    return (
        f"{name:24} {took:>5} {np.median(lengths):8.3f}{lengths.max():8.2f} "
        f"{arms.mean():8.3f}{np.percentile(arms, 90):8.2f}{arms.max():8.2f} "
        f"{np.median(forces) if forces else np.nan:6.3f} {f'{off.sum()} of {len(off)}':>8} {worst:6.2f}"
    )


def loadable(file: Path) -> Path:
    """The file without what MuJoCo reads no more, beside it."""
    found = file.with_name(f"{file.stem}_now.xml")
    text = file.read_text(encoding="utf-8")
    for word in ("all", "predefined", "dynamic"):
        text = text.replace(f'collision="{word}"', "")
    found.write_text(text, encoding="utf-8")
    return found


def main(base: Path) -> None:
    """Print the table."""
    version: Version = 4 if mujoco.__version__ >= "4" else 3
    print(f"MuJoCo {mujoco.__version__}\n{HEAD}\n{UNDER}")
    for osim, others in FILES.items():
        if not (base / osim).exists():
            continue
        model = osimlite.read(base / osim)
        print(Path(osim).stem)
        with TemporaryDirectory() as folder:
            for fit in ("none", "wraps", "force"):
                start = time.process_time()
                made = osimlite.to_mjcf(model, mujoco=version, visuals=False, fit=fit)
                seconds = time.process_time() - start
                print(
                    row(
                        f"  osimlite --fit {fit}", seconds, check_mjcf(model, made.write(folder)[0])
                    ),
                    flush=True,
                )
        for other in others:
            if (base / other).exists():
                print(
                    row(
                        f"  {other.partition('/')[0]}",
                        None,
                        check_mjcf(model, loadable(base / other)),
                    ),
                    flush=True,
                )


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
