"""Loading of MJCF files by MuJoCo's own compiler."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from osimlite.base.records import dataclass
from osimlite.base.require import require
from osimlite.errors import DocumentError, MissingFileError, UnsupportedError
from osimlite.translate.mjcf.warnings import collect_warnings

LARGEST_FILE = 50_000_000
"""Size (bytes) up to which a file is given to MuJoCo."""
LARGEST_NUMBER = 1e12
"""Absolute value that no number of a mechanism exceeds."""
CHECKED_ARRAYS = (
    "qpos0", "body_pos", "body_ipos", "body_mass", "body_inertia", "jnt_pos", "jnt_axis", "jnt_range", "jnt_stiffness",
    "dof_damping", "dof_armature", "geom_pos", "geom_size", "geom_solref", "site_pos", "eq_data", "tendon_stiffness",
    "tendon_damping", "tendon_lengthspring", "wrap_prm", "actuator_gear", "actuator_gainprm", "actuator_biasprm",
    "actuator_dynprm", "actuator_lengthrange", "key_qpos",
)  # fmt: skip
"""Arrays of a compiled model whose numbers are checked."""
AXIS_TOLERANCE = 1e-6
"""Difference from 1 of the length of a compiled joint axis, which MuJoCo normalizes."""
TRIAL_SECONDS = 600
"""Time after which the trial compilation in another process ends."""


@dataclass(frozen=True, eq=False)
class MjcfSource:
    """A compiled MJCF file.

    Attributes:
        path: path of the MJCF file.
        mujoco: MuJoCo's module.
        model: compiled model (``MjModel``).
        major: first number of the version of MuJoCo that compiled it.
        warnings: warnings of MuJoCo's compiler about the file.
    """

    path: Path
    mujoco: Any
    model: Any
    major: int
    warnings: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Name of the model, or of the file where the model has none."""
        # The first text among the names is that of the model.
        text = bytes(self.model.names).split(b"\0", 1)[0].decode("utf-8", "replace")
        return self.path.stem if text in ("", "MuJoCo Model") else text

    def name_of(self, kind: str, index: int) -> str:
        """Return the name of an object, or its kind and index where it has none.

        Args:
            kind: type of the object in lower case, such as "body", "joint", "geom", "site".
            index: number of the object among those of its kind.
        """
        name = self.mujoco.mj_id2name(
            self.model, getattr(self.mujoco.mjtObj, f"mjOBJ_{kind.upper()}"), index
        )
        return name or f"{kind}_{index}"

    def path_of(self, kind: str, index: int) -> str:
        """Return the name by which `fidelity.json` calls an object: ``/joint/elbow_flexion``."""
        return f"/{kind}/{self.name_of(kind, index)}"


def load_mjcf(path: Path) -> MjcfSource:
    """Compile an MJCF file.

    MuJoCo's parser can end the process on a damaged file, so the file is first compiled in another
    process.

    Args:
        path: path of the file (.xml).

    Returns:
        Compiled model, with MuJoCo's module, version and warnings.

    Raises:
        MissingDependency: MuJoCo is not installed.
        MissingFileError: there is no such file.
        DocumentError: MuJoCo rejects the file.
        UnsupportedError: the model has no body, or is larger than osimlite accepts.
    """  # noqa: DOC501 - a function makes the error, which is named
    mujoco: Any = require("mujoco", extra="mujoco", purpose="conversion from MJCF")
    if not path.is_file():
        raise MissingFileError("the file does not exist; name an MJCF file (.xml)", file=str(path))
    if path.stat().st_size > LARGEST_FILE:
        raise DocumentError(
            f"the file has more than {LARGEST_FILE / 1e6:g} MB, which is more than osimlite reads",
            file=str(path),
        )
    _try_in_another_process(path)
    with collect_warnings(mujoco) as warnings:
        try:
            model = mujoco.MjModel.from_xml_path(str(path))
        except Exception as error:  # MuJoCo raises ValueError, and others for lack of memory
            raise _explain_failure(path, str(error)) from error
    if model.nbody < 2:
        raise UnsupportedError(
            "the MJCF file has no bodies besides the world; there is nothing to convert",
            file=str(path),
        )
    _require_plausible_numbers(path, model)
    major = int(mujoco.__version__.split(".")[0])
    return MjcfSource(path, mujoco, model, major, tuple(dict.fromkeys(warnings)))


def _require_plausible_numbers(path: Path, model: Any) -> None:
    """Raise an error for numbers that no mechanism has.

    Raises:
        DocumentError: a number is not finite or is larger than `LARGEST_NUMBER`, or a joint axis is
            not a unit vector.
    """
    for name in CHECKED_ARRAYS:
        values = np.asarray(getattr(model, name), dtype=float)
        # `not <=` refuses NaN as well.
        if not np.all(np.abs(values) <= LARGEST_NUMBER):
            raise DocumentError(
                f"the compiled model has a number in '{name}' that is not finite, or is larger than "
                f"{LARGEST_NUMBER:g}",
                file=str(path),
            )
    has_axis = np.asarray(model.jnt_type) >= 2  # slides and hinges
    lengths = np.linalg.norm(np.asarray(model.jnt_axis), axis=1)
    if np.any(np.abs(lengths[has_axis] - 1.0) > AXIS_TOLERANCE):
        raise DocumentError("a joint has an axis without a direction", file=str(path))


def _try_in_another_process(path: Path) -> None:
    """Raise an error if MuJoCo rejects the file, or crashes on it.

    Raises:
        DocumentError: MuJoCo rejects the file, crashes on it, or does not finish in time.
    """  # noqa: DOC501 - a function makes the error, which is named
    code = (
        "import sys, mujoco\n"
        "mujoco.set_mju_user_warning(lambda text: None)\n"
        "try:\n"
        "    mujoco.MjModel.from_xml_path(sys.argv[1])\n"
        "except Exception as error:\n"
        "    sys.stderr.write('MJCF:' + str(error)); sys.exit(3)\n"
    )
    # Nothing is imported from the current folder, which may hold anything.
    environment = {**os.environ, "PYTHONSAFEPATH": "1", "PYTHONIOENCODING": "utf-8"}
    try:
        with TemporaryDirectory() as folder:
            completed = subprocess.run(
                [sys.executable, "-c", code, str(path.absolute())],
                capture_output=True,
                timeout=TRIAL_SECONDS,
                check=False,
                env=environment,
                cwd=folder,
            )
    except subprocess.TimeoutExpired as error:
        raise DocumentError(
            f"MuJoCo did not compile the file within {TRIAL_SECONDS} s", file=str(path)
        ) from error
    if completed.returncode == 3:
        text = completed.stderr.decode("utf-8", "replace")
        raise _explain_failure(path, text.rpartition("MJCF:")[2])
    if completed.returncode < 0:
        raise DocumentError(
            f"MuJoCo crashed while it compiled the file (signal {-completed.returncode})",
            file=str(path),
        )


def _explain_failure(path: Path, message: str) -> DocumentError:
    """Return an error with MuJoCo's own message on one line."""
    # The position goes into the error, where editors find it.
    line = re.search(r"line (\d+)", message)
    text = re.sub(r"\s*\n\s*", "; ", message.strip()) or "it gives no reason"
    text = text.removeprefix("XML Error: ").removeprefix("Error: ")
    # MuJoCo gives elements of included files the line 0.
    text = text.removesuffix(", line 0")
    hint = ""
    if "opening file" in text:
        hint = "; included files and meshes must be where the file names them"
    elif "mujocoinclude" in text:
        hint = "; this file is a part of other files: convert the file that includes it"
    return DocumentError(
        f"MuJoCo rejects the file: {text}{hint}",
        file=str(path),
        line=(int(line[1]) or None) if line else None,
    )
