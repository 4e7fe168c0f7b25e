"""Table of the kernels that are called by their address, and compilation of generated kernels.

Each kernel of the table is compiled when the first model that needs it is prepared, and cached.
Kernels that are generated for types of forces and probes are listed by
:mod:`osimlite.simulation.elements.laws`.
"""

from __future__ import annotations

import linecache
from collections.abc import Callable
from importlib import import_module
from typing import Any

from osimlite.mechanics.kernels import pointers
from osimlite.mechanics.kernels.layout import ITEM, MODEL, OUTCOME, RUN, WORK

LAW_MODULES = {
    "evaluate": "dynamics",
    "equilibrate": "dynamics",
    "run_several": "runs",
    "run_by_reflexes": "walks",
    "hold_several": "walks",
    "walk_several": "walks",
    "merson": "merson",
    "euler2": "euler2",
    "adams": "multistep",
    "bdf": "multistep",
    "rosenbrock": "rosenbrock",
    "fit_frames": "pose_fit",
    "set_controls": "functions",
    "contact_places": "contacts",
    "place_ball": "ball_joint",
    "move_ball": "ball_joint",
    "place_drift": "acceleration_error",
    "move_drift": "acceleration_error",
    "constrained_dynamics": "constrained_dynamics",
    "chain_dynamics": "chain",
    "project": "projection",
    "factorise_law": "linear_algebra",
    "minimum_norm_law": "linear_algebra",
    "prescribe": "constraint_equations",
    "couple": "constraint_equations",
    "bind_bodies": "constraint_equations",
    "amount_by_one": "functions",
    "amount_by_several": "functions",
    "amount_by_arc": "constant_curvature",
    "touch_half_space": "contacts",
    "touch_spheres": "contacts",
    "contact_response": "contacts",
    "smooth_contact_response": "contacts",
    "touch_ellipsoid": "ellipsoid_contacts",
    "touch_ellipsoids": "ellipsoid_contacts",
    "early_return": "ellipsoid_contacts",
    "touch_mesh": "mesh_contacts",
    "function_path": "function_paths",
    "pull_coordinates": "function_paths",
    "function_of_one": "function_paths",
    "polynomial": "function_paths",
    "formula": "function_paths",
    "cable_path": "cable_paths",
    "pull_cable": "cable_paths",
    "wrap_cylinder": "wrap_cylinder",
    "wrap_sphere": "wrapping",
    "wrap_ellipsoid": "wrap_ellipsoid",
    "wrap_torus": "wrap_torus",
    "trace_path": "wrap_curves",
    "trace_geodesics": "geodesic_curves",
    "trace_cable": "geodesic_curves",
    "trace_cylinder": "wrap_curves",
    "trace_sphere": "wrap_curves",
    "trace_ellipsoid": "wrap_curves",
    "trace_torus": "wrap_curves",
    "straight_path": "paths",
    "pull_points": "paths",
    "pull_each": "paths",
    "evaluate_items": "poses",
    "evaluate_states": "poses",
    "push_each_actuator": "poses",
    "least_effort": "effort",
    "wrapped_path": "path_wraps",
    "geodesic_path": "geodesic_paths",
    "inverse": "dynamics",
    "assemble_poses": "assembly",
}
"""Module of each kernel that models call by number; its keys define the order of the numbers."""

# Numbers, not addresses, are stored in records that are written before a kernel is compiled.
LAW_NUMBERS = {name: number for number, name in enumerate(LAW_MODULES)}
"""Index of each kernel's address among the addresses from `layout.MODEL.LAWS` on."""


def load_kernel(name: str) -> Callable[..., Any]:
    """Return the kernel of a name in the table, importing its module."""
    function: Callable[..., Any] = getattr(
        import_module(f"{__package__}.{LAW_MODULES[name]}"), name
    )
    return function


RECORDS = {record.__name__: record for record in (MODEL, ITEM, RUN, WORK, OUTCOME)}
"""Records of the layout that generated kernels refer to."""
PARAMETERS = 'model: "Ints", reals: "Floats", data: "Floats", y: "Floats", f: "Floats"'
"""Parameters that every kernel begins with, as text."""


def compile_text(name: str, module: str, source: str, **scope: Any) -> Callable[..., int]:
    """Return the function that a text defines.

    Args:
        name: name of the function.
        module: name of the module that it belongs to.
        source: text of the function.
        scope: names that the text uses besides the records of the layout.
    """
    namespace = {**RECORDS, "at": pointers.at, "__name__": module, **scope}
    file = f"<kernel {name}>"
    exec(compile(source, file, "exec", dont_inherit=True), namespace)
    # Let tracebacks and `inspect.getsource` show the text as that of a file.
    linecache.cache[file] = (len(source), None, source.splitlines(keepends=True), file)
    return namespace[name]
