"""To 30509 and 30511: what a component does is switched on, no longer switched off."""

from __future__ import annotations

from osimlite.io.document.upgrade.draft import Draft, having, is_true, plain, step


@step(below=30509)
def switched_on(draft: Draft) -> None:
    """<isDisabled> turns round: appliesForce, isEnforced, enabled."""
    for family, new in (
        ("Force", "appliesForce"),
        ("Constraint", "isEnforced"),
        ("Controller", "enabled"),
    ):
        _turn_round(draft, family, new)


@step(below=30511)
def probes_switched_on(draft: Draft) -> None:
    """<isDisabled> of a probe turns round: enabled."""
    _turn_round(draft, "Probe", "enabled")


def _turn_round(draft: Draft, family: str, new: str) -> None:
    for component, switch in having(draft.every(family), "isDisabled"):
        switch.text = "false" if is_true(plain(switch)) else "true"
        draft.rename(switch, new)
        draft.changed(component)
