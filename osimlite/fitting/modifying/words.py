"""Replacements in words, as ``osimlite modify --replace`` takes them: ``muscles=degroote``, ``reserves=100:1``."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from osimlite.base.text import suggest_or_list
from osimlite.errors import SettingError
from osimlite.fitting.modifying.contact import smooth_contacts
from osimlite.fitting.modifying.operators import apply, put_paths
from osimlite.fitting.modifying.path_fitting import Fitted, fit_paths
from osimlite.schema.model import Model, expect_model
from osimlite.schema.tools import processors as p

Change = Callable[[Model, Path], "list[Fitted] | None"]


def _operator(operator: Any) -> Change:
    def change(model: Model, folder: Path) -> None:
        apply(model, [operator], folder)

    return change


def _fit(model: Model, folder: Path) -> list[Fitted]:
    fitted = fit_paths(model)
    put_paths(model, [item.path for item in fitted])
    return fitted


def _smooth(model: Model, folder: Path) -> None:
    smooth_contacts(model)


CHOICES: dict[str, dict[str, Callable[[], Change]]] = {
    "muscles": {
        "degroote": lambda: _operator(p.ModOpReplaceMusclesWithDeGrooteFregly2016()),
        "path-actuators": lambda: _operator(p.ModOpReplaceMusclesWithPathActuators()),
        "none": lambda: _operator(p.ModOpRemoveMuscles()),
    },
    "tendon": {
        "rigid": lambda: _operator(p.ModOpIgnoreTendonCompliance()),
        "explicit": lambda: _operator(p.ModOpTendonComplianceDynamicsModeDGF(mode="explicit")),
        "implicit": lambda: _operator(p.ModOpTendonComplianceDynamicsModeDGF(mode="implicit")),
    },
    "activation": {"none": lambda: _operator(p.ModOpIgnoreActivationDynamics())},
    "passive": {"none": lambda: _operator(p.ModOpIgnorePassiveFiberForcesDGF())},
    "paths": {"polynomial": lambda: _fit},
    "contact": {"smooth": lambda: _smooth},
}
"""What a name may be replaced with by a word."""


def _welds(value: str) -> Any:
    kind, _, names = value.partition(":")
    if kind != "weld" or not names:
        raise SettingError(f"joints={value} is none; say joints=weld:NAME, or several with commas")
    return p.ModOpReplaceJointsWithWelds(joint_paths=tuple(names.split(",")))


def _reserves(value: str) -> Any:
    force, _, bound = value.partition(":")
    given: dict[str, Any] = {"bound": _number("reserves", bound)} if bound else {}
    return p.ModOpAddReserves(optimal_force=_number("reserves", force), **given)


GIVEN: dict[str, Callable[[str], Any]] = {
    "joints": _welds,
    "reserves": _reserves,
    "strength": lambda value: p.ModOpScaleMaxIsometricForce(
        scale_factor=_number("strength", value)
    ),
    "width": lambda value: p.ModOpScaleActiveFiberForceCurveWidthDGF(
        scale_factor=_number("width", value)
    ),
    "external-loads": lambda value: p.ModOpAddExternalLoads(filepath=value),
    "paths": lambda value: p.ModOpReplacePathsWithFunctionBasedPaths(paths_file=value),
}
"""What is given a number, a file or names: the operator for it."""


def _number(name: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise SettingError(f"{name} takes a number, not '{text}'") from None


def change_of(name: str, value: str) -> Change:
    """What a replacement does.

    Raises:
        SettingError: there is none.
    """
    if (made := CHOICES.get(name, {}).get(value)) is not None:
        return made()
    if name in GIVEN and (name not in CHOICES or Path(value).suffix):
        return _operator(GIVEN[name](value))
    names = sorted({*CHOICES, *GIVEN})
    if name not in names:
        raise SettingError(
            f"nothing is called '{name}' that could be replaced{suggest_or_list(name, names)}"
        )
    raise SettingError(
        f"{name} cannot be replaced with '{value}'{suggest_or_list(value, sorted(CHOICES[name]))}"
    )


def modify(
    model: Model,
    *operators: p.ModelOperator,
    folder: str | Path = ".",
    replace: Iterable[tuple[str, str]] = (),
    **words: str,
) -> Model:
    """A copy of a model with smoother, stiffer or other parts, as OpenSim's ModelProcessor makes it.

    Args: model: that stays as it is. operators: OpenSim's, such as
        ``osimlite.ModOpAddReserves(optimal_force=100.0)``, applied first. folder: where files are
        that are named. replace: pairs of a name and what takes its place, in their order:
        ``("muscles", "degroote")``, ``("tendon", "rigid")``, ``("paths", "polynomial")``,
        ``("contact", "smooth")``, ``("joints", "weld:mtp_r,mtp_l")``, ``("reserves", "100:1")``
        (optimal force, bound), ``("muscles", "none")``. words: the same by keyword.

    Raises:
        SettingError: there is no such replacement.
        ModelError: something is named that is not there.
        UnsupportedError: a part of the model has nothing that could take its place.
    """
    expect_model(model)
    result = model.copy_deep()
    apply(result, operators, folder)
    for name, value in [*replace, *words.items()]:
        change_of(name, value)(result, Path(folder))
    return result
