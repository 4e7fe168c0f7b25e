"""osimlite: build, check, translate and simulate OpenSim models without OpenSim.

Everything public is here: ``read``, ``read_document``, ``classes_in``, ``write``, ``to_text``,
``read_b3d``, ``validate``, ``mechanism``, ``paths``, ``muscle_curves``, ``to_urdf``, ``to_mjcf``,
``from_mjcf``, ``simulate``, ``Feedback``, ``inverse_kinematics``, ``FrameSolver``, ``scale``,
``fit``, ``kinematics``, ``inverse_dynamics``, ``static_optimization``, ``casadi``, ``tangents``,
``linearize``, ``sensitivity``, ``modify``, ``run``, ``check_trial``, ``report``, the errors, and
every component class under OpenSim's own name (``osimlite.PinJoint``). Names are imported when
first used, so that importing osimlite costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from osimlite.derivatives.functions import casadi as casadi
    from osimlite.derivatives.linear import linearize as linearize
    from osimlite.derivatives.sensitivity import sensitivity as sensitivity
    from osimlite.derivatives.tangents import tangents as tangents
    from osimlite.errors import OsimliteError as OsimliteError
    from osimlite.fitting.frame_solver import FrameSolver as FrameSolver
    from osimlite.fitting.inverse_kinematics import inverse_kinematics as inverse_kinematics
    from osimlite.fitting.modifying.words import modify as modify
    from osimlite.fitting.person import fit as fit
    from osimlite.fitting.scale_tool import scale as scale
    from osimlite.io.b3d.reader import read_b3d as read_b3d
    from osimlite.io.document.plugins import classes_in as classes_in
    from osimlite.io.document.printer import to_text as to_text
    from osimlite.io.document.printer import write as write
    from osimlite.io.document.reader import read as read
    from osimlite.io.document.reader import read_any as read_document
    from osimlite.io.document.reader import read_text as read_text
    from osimlite.lint import validate as validate
    from osimlite.mechanics.multibody import build_mechanism as mechanism
    from osimlite.schema.model import Model as Model
    from osimlite.simulation import simulate as simulate
    from osimlite.simulation.inverse_dynamics import inverse_dynamics as inverse_dynamics
    from osimlite.simulation.inverse_dynamics import kinematics as kinematics
    from osimlite.simulation.muscle_curves import muscle_curves as muscle_curves
    from osimlite.simulation.muscle_forces import static_optimization as static_optimization
    from osimlite.simulation.paths import paths as paths
    from osimlite.studies.reflexes.feedback import Feedback as Feedback
    from osimlite.tools.report import report as report
    from osimlite.tools.running import run as run
    from osimlite.tools.trials.check import check_trial as check_trial
    from osimlite.translate import from_mjcf as from_mjcf
    from osimlite.translate import to_mjcf as to_mjcf
    from osimlite.translate import to_urdf as to_urdf

    # When the program runs, `__getattr__` makes the list, of the component classes too.
    __all__ = [
        "Feedback",
        "FrameSolver",
        "Model",
        "OsimliteError",
        "casadi",
        "check_trial",
        "classes_in",
        "fit",
        "from_mjcf",
        "inverse_dynamics",
        "inverse_kinematics",
        "kinematics",
        "linearize",
        "mechanism",
        "modify",
        "muscle_curves",
        "paths",
        "read",
        "read_b3d",
        "read_document",
        "read_text",
        "report",
        "run",
        "scale",
        "sensitivity",
        "simulate",
        "static_optimization",
        "tangents",
        "to_mjcf",
        "to_text",
        "to_urdf",
        "validate",
        "write",
    ]

FUNCTIONS = {
    "casadi": "osimlite.derivatives.functions",
    "classes_in": "osimlite.io.document.plugins",
    "read": "osimlite.io.document.reader",
    "read_b3d": "osimlite.io.b3d.reader",
    "read_document": "osimlite.io.document.reader:read_any",
    "read_text": "osimlite.io.document.reader",
    "write": "osimlite.io.document.printer",
    "to_text": "osimlite.io.document.printer",
    "validate": "osimlite.lint",
    "Feedback": "osimlite.studies.reflexes.feedback",
    "FrameSolver": "osimlite.fitting.frame_solver",
    "inverse_kinematics": "osimlite.fitting.inverse_kinematics",
    "fit": "osimlite.fitting.person",
    "scale": "osimlite.fitting.scale_tool",
    "linearize": "osimlite.derivatives.linear",
    "tangents": "osimlite.derivatives.tangents",
    "sensitivity": "osimlite.derivatives.sensitivity",
    "modify": "osimlite.fitting.modifying.words",
    "mechanism": "osimlite.mechanics.multibody:build_mechanism",
    "from_mjcf": "osimlite.translate",
    "to_mjcf": "osimlite.translate",
    "to_urdf": "osimlite.translate",
    "muscle_curves": "osimlite.simulation.muscle_curves",
    "paths": "osimlite.simulation.paths",
    "report": "osimlite.tools.report",
    "run": "osimlite.tools.running",
    "check_trial": "osimlite.tools.trials.check",
    "inverse_dynamics": "osimlite.simulation.inverse_dynamics",
    "kinematics": "osimlite.simulation.inverse_dynamics",
    "simulate": "osimlite.simulation",
    "static_optimization": "osimlite.simulation.muscle_forces",
    "OsimliteError": "osimlite.errors",
}


def __getattr__(name: str) -> Any:
    if name == "__all__":
        from osimlite.schema.registry import MODULES

        return sorted({*FUNCTIONS, *MODULES})
    module, _, inner = FUNCTIONS.get(name, "").partition(":")
    if not module and not name.startswith("_"):
        from osimlite.schema.registry import MODULES

        module = MODULES.get(name, "")
    if not module:
        suggestion = ""
        if not name.startswith("_"):
            from importlib.util import find_spec

            if name.isidentifier() and find_spec(f"{__name__}.{name}"):
                return import_module(f"{__name__}.{name}")
            from osimlite.base.text import suggest_name
            from osimlite.schema.registry import MODULES

            suggestion = suggest_name(name, [*FUNCTIONS, *MODULES])
        raise AttributeError(f"module 'osimlite' has no attribute '{name}'{suggestion}")
    return getattr(import_module(module), inner or name)


def __dir__() -> list[str]:
    from osimlite.schema.registry import MODULES

    return sorted({*globals(), *FUNCTIONS, *MODULES} - {"FUNCTIONS"})
