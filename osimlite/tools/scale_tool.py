"""OpenSim's ScaleTool: a generic model measured against a subject, scaled, and its markers placed."""

from __future__ import annotations

from osimlite.fitting.scale_tool import run_scale
from osimlite.tools.job import Job
from osimlite.tools.outcome import Outcome


def run(job: Job, outcome: Outcome) -> None:
    """Scale the model and place its markers; write models, factors and the pose that the setup names."""
    result = run_scale(job.setup, job.file.parent)
    for name, text in result.texts.items():
        outcome.text(job.result(name), text)
    if result.unknown:
        outcome.warn("unknown classes", result.unknown)
    if result.measured is not None:
        outcome.summary["ratios"] = dict(result.measured.ratios)
        for name, ratio in result.measured.ratios.items():
            outcome.tell(name, f"{ratio:.6g}")
        for note in result.measured.notes:
            outcome.tell("left out", note)
    if result.placed is not None:
        outcome.summary |= result.placed.pose.summary
        for words in result.placed.told():
            outcome.tell("markers", words)
