"""Tests of muscles of old formats in MuJoCo: their velocity follows from time_scale."""

from __future__ import annotations

import pytest

import osimlite
from osimlite.io.document.reader import read_text
from tests.lint.verdict_cases import path_of, small_model


def translate(kind: str, **properties: float):
    """Return the actuator of a muscle, and its records."""
    inside = "".join(f"<{name}>{value}</{name}>" for name, value in properties.items())
    muscle = (
        f'<{kind} name="t">{path_of(("/ground", "0 0.1 0"), ("/bodyset/a", "0 0 0"))}{inside}'
        "<optimal_fiber_length>0.1</optimal_fiber_length>"
        f"<tendon_slack_length>0.25</tendon_slack_length></{kind}>"
    )
    result = osimlite.to_mjcf(read_text(small_model(forces=muscle)))
    (line,) = [line for line in result.text.splitlines() if "<general" in line]
    return line, str(result.fidelity)


KINDS = ["Schutte1993Muscle_Deprecated", "Delp1990Muscle_Deprecated"]


@pytest.mark.parametrize("kind", KINDS)
def test_the_velocity_that_the_class_never_uses_changes_nothing(kind: str):
    lines = {translate(kind, max_contraction_velocity=velocity)[0] for velocity in (0.0, 3.0, 10.0)}
    assert len(lines) == 1


@pytest.mark.parametrize("kind", KINDS)
def test_the_time_scale_sets_velocity_and_activation(kind: str):
    slow, fast = (translate(kind, time_scale=scale)[0] for scale in (0.2, 0.1))
    assert slow != fast and 'dyntype="muscle"' in slow

    def numbers(line: str, name: str) -> list[float]:
        return [float(word) for word in line.split(f'{name}="')[1].split('"')[0].split()]

    assert numbers(slow, "dynprm")[0] == pytest.approx(2.0 * numbers(fast, "dynprm")[0])
    assert numbers(slow, "gainprm")[6] == pytest.approx(0.5 * numbers(fast, "gainprm")[6])
