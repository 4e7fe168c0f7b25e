"""Replacements in words, as of ``osimlite modify --replace muscles=degroote``."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from osimlite.base.text import suggest_or_list
from osimlite.errors import SettingError
from osimlite.fitting.modifying.contact import smooth_contacts
from osimlite.fitting.modifying.operators import apply_operators, replace_paths
from osimlite.fitting.modifying.path_fitting import PathFit, fit_paths
from osimlite.schema.model import Model, check_is_model
from osimlite.schema.tools import processors as p

Change = Callable[[Model, Path], "list[PathFit] | None"]
"""Function that changes a model; files are resolved from a folder."""


def _create_change(operator: Any) -> Change:
    """Return a change that applies an operator."""

    def change(model: Model, folder: Path) -> None:
        apply_operators(model, [operator], folder)

    return change


def _replace_paths_with_polynomials(model: Model, folder: Path) -> list[PathFit]:
    """Replace all paths by polynomials.

    Returns:
        Fit of each path, with its errors.
    """
    fits = fit_paths(model)
    replace_paths(model, [fit.path for fit in fits])
    return fits


def _replace_contacts(model: Model, folder: Path) -> None:
    """Replace Hunt-Crossley contact by smooth contact."""
    smooth_contacts(model)


CHANGES_BY_WORD: dict[str, dict[str, Callable[[], Change]]] = {
    "muscles": {
        "degroote": lambda: _create_change(p.ModOpReplaceMusclesWithDeGrooteFregly2016()),
        "path-actuators": lambda: _create_change(p.ModOpReplaceMusclesWithPathActuators()),
        "none": lambda: _create_change(p.ModOpRemoveMuscles()),
    },
    "tendon": {
        "rigid": lambda: _create_change(p.ModOpIgnoreTendonCompliance()),
        "explicit": lambda: _create_change(p.ModOpTendonComplianceDynamicsModeDGF(mode="explicit")),
        "implicit": lambda: _create_change(p.ModOpTendonComplianceDynamicsModeDGF(mode="implicit")),
    },
    "activation": {"none": lambda: _create_change(p.ModOpIgnoreActivationDynamics())},
    "passive": {"none": lambda: _create_change(p.ModOpIgnorePassiveFiberForcesDGF())},
    "paths": {"polynomial": lambda: _replace_paths_with_polynomials},
    "contact": {"smooth": lambda: _replace_contacts},
}
"""Changes by name of the replaced part and word for its replacement."""


def _parse_welds(value: str) -> Any:
    """Return the operator for ``weld:NAME,NAME``.

    Raises:
        SettingError: the value does not have this form.
    """
    replacement, _, names = value.partition(":")
    if replacement != "weld" or not names:
        raise SettingError(
            f"unknown replacement joints={value}; write joints=weld:NAME, with commas between names"
        )
    return p.ModOpReplaceJointsWithWelds(joint_paths=tuple(names.split(",")))


def _parse_reserves(value: str) -> Any:
    """Return the operator for ``FORCE:BOUND``."""
    force, _, bound_text = value.partition(":")
    optional_properties: dict[str, Any] = (
        {"bound": _parse_number("reserves", bound_text)} if bound_text else {}
    )
    return p.ModOpAddReserves(optimal_force=_parse_number("reserves", force), **optional_properties)


OPERATORS_BY_NAME: dict[str, Callable[[str], Any]] = {
    "joints": _parse_welds,
    "reserves": _parse_reserves,
    "strength": lambda value: p.ModOpScaleMaxIsometricForce(
        scale_factor=_parse_number("strength", value)
    ),
    "width": lambda value: p.ModOpScaleActiveFiberForceCurveWidthDGF(
        scale_factor=_parse_number("width", value)
    ),
    "external-loads": lambda value: p.ModOpAddExternalLoads(filepath=value),
    "paths": lambda value: p.ModOpReplacePathsWithFunctionBasedPaths(paths_file=value),
}
"""Operators of replacements that take a number, a file or names."""


def _parse_number(name: str, text: str) -> float:
    """Return the number of a replacement.

    Raises:
        SettingError: the text is not a positive number.
    """
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 < value < math.inf:
        raise SettingError(f"{name} expects a positive number, found '{text}'")
    return value


def find_change(name: str, value: str) -> Change:
    """Return the change of a replacement.

    Args:
        name: name of the part to replace.
        value: word, number, file or names.

    Raises:
        SettingError: there is no such replacement.
    """
    if (create_change := CHANGES_BY_WORD.get(name, {}).get(value)) is not None:
        return create_change()
    # A word and a file may replace the same part: a file has a suffix.
    if name in OPERATORS_BY_NAME and (name not in CHANGES_BY_WORD or Path(value).suffix):
        return _create_change(OPERATORS_BY_NAME[name](value))
    names = sorted({*CHANGES_BY_WORD, *OPERATORS_BY_NAME})
    if name not in names:
        raise SettingError(f"unknown part '{name}' to replace{suggest_or_list(name, names)}")
    raise SettingError(
        f"{name} cannot be replaced with "
        f"'{value}'{suggest_or_list(value, sorted(CHANGES_BY_WORD[name]))}"
    )


def modify(
    model: Model,
    *operators: p.ModelOperator,
    folder: str | Path = ".",
    replace: Iterable[tuple[str, str]] = (),
    **words: str,
) -> Model:
    """Return a copy of a model with other parts, as OpenSim's ModelProcessor makes it.

    Args:
        model: model to copy; it is not changed.
        operators: OpenSim's operators, such as ``osimlite.ModOpAddReserves(optimal_force=100.0)``,
            applied first.
        folder: folder from which paths start.
        replace: pairs of a name and its replacement, in their order: ``("muscles", "degroote")``,
            ``("tendon", "rigid")``, ``("paths", "polynomial")``, ``("contact", "smooth")``,
            ``("joints", "weld:mtp_r,mtp_l")``, ``("reserves", "100:1")`` (optimal force, bound),
            ``("muscles", "none")``.
        words: further replacements as keywords, such as ``muscles="degroote"``, applied last.

    Raises:
        SettingError: there is no such replacement.
        ModelError: the model lacks a named part.
        UnsupportedError: a part of the model has no replacement.
    """
    check_is_model(model)
    result = model.copy_deep()
    apply_operators(result, operators, folder)
    for name, value in [*replace, *words.items()]:
        find_change(name, value)(result, Path(folder))
    return result
