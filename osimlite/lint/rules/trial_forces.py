"""OSIM911 and following: residuals, reserves, tracking errors and muscles of a finished trial."""

from __future__ import annotations

from osimlite.lint.registry import WARNING, FindingCollector, Threshold, rule
from osimlite.lint.trial import CHECKLIST, HICKS, OPENSIM, OSIMLITE, TRIAL, Trial

_BOTH = f"{OPENSIM}; {HICKS}"
RELATIVE_FORCE = Threshold(
    "residual-force-share",
    5.0,
    "%",
    "largest accepted residual force, as a share of the largest external force",
)
FORCE_GOOD = Threshold(
    "residual-force-good",
    10.0,
    "N",
    "a residual force up to this is good",
)
FORCE_BAD = Threshold(
    "residual-force-bad",
    25.0,
    "N",
    "a residual force above this is bad",
)
FORCE_RMS_GOOD = Threshold(
    "residual-force-rms-good",
    5.0,
    "N",
    "a root mean square of a residual force up to this is good",
)
FORCE_RMS_BAD = Threshold(
    "residual-force-rms-bad",
    10.0,
    "N",
    "a root mean square of a residual force above this is bad",
)
RELATIVE_MOMENT = Threshold(
    "residual-moment-share",
    1.0,
    "%",
    "largest accepted residual moment, as a share of the largest external force times the "
    "height of the mass centre",
)
MOMENT_GOOD = Threshold(
    "residual-moment-good",
    50.0,
    "N m",
    "a residual moment up to this is good",
)
MOMENT_BAD = Threshold(
    "residual-moment-bad",
    75.0,
    "N m",
    "a residual moment above this is bad",
)
MOMENT_RMS_GOOD = Threshold(
    "residual-moment-rms-good",
    30.0,
    "N m",
    "a root mean square of a residual moment up to this is good",
)
MOMENT_RMS_BAD = Threshold(
    "residual-moment-rms-bad",
    50.0,
    "N m",
    "a root mean square of a residual moment above this is bad",
)
RESERVE_GOOD = Threshold(
    "reserve-good",
    5.0,
    "%",
    "a reserve actuator up to this share of the moment at its joint is good",
)
RESERVE_BAD = Threshold(
    "reserve-bad",
    10.0,
    "%",
    "a reserve actuator above this share of the moment at its joint is bad",
)
ERROR_GOOD = Threshold(
    "tracking-error-good",
    2.0,
    "deg",
    "a tracking error up to this is good (cm for translations)",
)
ERROR_BAD = Threshold(
    "tracking-error-bad",
    5.0,
    "deg",
    "a tracking error above this is bad (cm for translations)",
)
ERROR_RMS_BAD = Threshold(
    "tracking-error-rms-bad",
    4.0,
    "cm",
    "a root mean square of the tracking error of a translation above this is bad",
)
FULL_GOOD = Threshold(
    "full-activation",
    5.0,
    "%",
    "largest accepted share of the time in which a muscle is fully active",
)
FULL_BAD = Threshold(
    "full-activation-bad",
    25.0,
    "%",
    "a share of the time above this is bad",
)
PASSIVE_GOOD = Threshold(
    "passive-force",
    50.0,
    "%",
    "largest accepted passive force, as a share of the strength of the muscle",
)
PASSIVE_BAD = Threshold("passive-force-bad", 100.0, "%", "a passive force above this is bad")


@rule(
    "OSIM911", "residual-force", severity=WARNING, about=TRIAL,
    thresholds=(RELATIVE_FORCE, FORCE_GOOD, FORCE_BAD, FORCE_RMS_GOOD, FORCE_RMS_BAD),
)  # fmt: skip
def report_residual_force(trial: Trial, report: FindingCollector) -> None:
    """A residual force is large.

    Checks the forces at the joint to ground, which are ideally zero: those of inverse dynamics, and
    of the residual actuators of RRA, CMC and StaticOptimization. OpenSim's best practices
    (https://opensimconfluence.atlassian.net/wiki/spaces/OpenSim/pages/53087686) call a peak good up
    to 10 N, and bad above 25 N. They call a root mean square good up to 5 N, and bad above 10 N.
    Hicks and others advise peaks of at most 5 % of the largest external force (2015, Is my model
    good enough?, https://doi.org/10.1115/1.4029304). A peak that exceeds one of the two limits, but
    not both, is okay. Residuals of inverse dynamics are an info if the trial has RRA or CMC, too.

    Motion, masses and measured loads contradict each other. The residual force, instead of the
    muscles, makes up for the difference.

    ```trial
    - peak of FY of RRA: 61 N, with loads of 850 N
    + peak of FY of RRA: 8.1 N, with loads of 850 N
    ```
    """
    advice = "check masses and mass centres, the filter, and that the loads agree with the motion in time"
    trial.judge(report, [FORCE_GOOD, RELATIVE_FORCE, FORCE_BAD], _BOTH, advice, "peak")
    trial.judge(report, [FORCE_RMS_GOOD, FORCE_RMS_BAD], OPENSIM, advice, "rms")


@rule(
    "OSIM912", "residual-moment", severity=WARNING, about=TRIAL,
    thresholds=(RELATIVE_MOMENT, MOMENT_GOOD, MOMENT_BAD, MOMENT_RMS_GOOD, MOMENT_RMS_BAD),
)  # fmt: skip
def report_residual_moment(trial: Trial, report: FindingCollector) -> None:
    """A residual moment is large.

    Checks the moments at the joint to ground, as OSIM911 checks the forces. OpenSim's best
    practices (https://opensimconfluence.atlassian.net/wiki/spaces/OpenSim/pages/53087686) call a
    peak good up to 50 N m, and bad above 75 N m. They call a root mean square good up to 30 N m,
    and bad above 50 N m. Hicks and others advise a much lower limit (2015, Is my model good
    enough?, https://doi.org/10.1115/1.4029304): 1 % of the largest external force times the height
    of the mass centre. A peak between this limit and OpenSim's is okay.

    Most of the mass is in the trunk, and its mass centre is hard to measure. A residual moment
    shows that this mass centre is wrong, or that the loads act in another place.

    ```trial
    - peak of MZ of RRA: 96 N m, with loads times height of 800 N m
    + peak of MZ of RRA: 6 N m, with loads times height of 800 N m
    ```
    """
    advice = (
        "check the mass centre of the trunk (RRA adjusts it), and the points at which the loads act"
    )
    trial.judge(report, [RELATIVE_MOMENT, MOMENT_GOOD, MOMENT_BAD], _BOTH, advice, "peak")
    trial.judge(report, [MOMENT_RMS_GOOD, MOMENT_RMS_BAD], OPENSIM, advice, "rms")


@rule(
    "OSIM913",
    "reserve-moment",
    severity=WARNING,
    thresholds=(RESERVE_GOOD, RESERVE_BAD),
    about=TRIAL,
)
def report_reserve_moment(trial: Trial, report: FindingCollector) -> None:
    """Reserve actuators replace muscles.

    Compares the reserve actuators of CMC and StaticOptimization with the joint moments of the
    motion: peak with peak, and root mean square with root mean square. Only coordinates that muscles
    cross are checked. Up to 5 % is good (Hicks and others 2015, Is my model good enough?,
    https://doi.org/10.1115/1.4029304), and more than 10 % is bad (OpenSim's checklist,
    https://simtk-confluence.stanford.edu:8443/plugins/viewsource/viewpagesrc.action?pageId=3376337).
    Moments below 1 N m are not checked.

    The muscles at this joint are too weak for the motion, or their paths are wrong. The computed
    forces of all these muscles are too small.

    ```trial
    - peak of the reserve of 'ankle_angle_r' relative to its joint moment: 34 %
    + peak of the reserve of 'ankle_angle_r' relative to its joint moment: 2 %
    ```
    """
    advice = (
        "check strengths and paths of the muscles at this joint, passive forces of their "
        "antagonists, and the joint moment"
    )
    for kind in ("peak", "rms"):
        trial.judge(report, [RESERVE_GOOD, RESERVE_BAD], f"{HICKS}; {CHECKLIST}", advice, kind)


@rule(
    "OSIM914",
    "tracking-error",
    severity=WARNING,
    thresholds=(ERROR_GOOD, ERROR_BAD, ERROR_RMS_BAD),
    about=TRIAL,
)
def report_tracking_error(trial: Trial, report: FindingCollector) -> None:
    """RRA or CMC does not follow its motion.

    Checks the errors that both tools write (`_pErr.sto`). OpenSim's best practices
    (https://opensimconfluence.atlassian.net/wiki/spaces/OpenSim/pages/53087686) call errors good up
    to 2 degrees or 2 cm, and bad above 5 degrees or 5 cm. A root mean square of translations is bad
    above 4 cm.

    The computed forces belong to another motion than that of the subject.

    ```trial
    - peak of the error of 'pelvis_tx': 7.4 cm
    + peak of the error of 'pelvis_tx': 1.1 cm
    ```
    """
    advice = "give the task of this coordinate more weight, or its actuator more strength"
    trial.judge(report, [ERROR_GOOD, ERROR_BAD], OPENSIM, advice, "peak")
    trial.judge(report, [ERROR_GOOD, ERROR_BAD], OPENSIM, advice, "rms")
    trial.judge(report, [ERROR_GOOD, ERROR_RMS_BAD], OPENSIM, advice, "rms-translation")


@rule("OSIM915", "full-activation", severity=WARNING, thresholds=(FULL_GOOD, FULL_BAD), about=TRIAL)
def report_full_activation(trial: Trial, report: FindingCollector) -> None:
    """A muscle is fully active for a long time.

    Checks the activations of StaticOptimization and CMC for values of 0.99 and more.

    Other muscles and reserve actuators must replace a saturated muscle; in daily life no muscle is
    fully active for long. OpenSim's best practices
    (https://opensimconfluence.atlassian.net/wiki/spaces/OpenSim/pages/53087686) recommend to compare
    activations with measurements, and give no limit: this limit is osimlite's.

    ```trial
    - share of the time that 'tib_ant_r' is fully active: 40 %
    + share of the time that 'tib_ant_r' is fully active: 0 %
    ```
    """
    advice = "check its max_isometric_force, its fiber length in this pose, and its antagonists"
    trial.judge(report, [FULL_GOOD, FULL_BAD], OSIMLITE, advice, "share")


@rule(
    "OSIM916",
    "passive-force",
    severity=WARNING,
    thresholds=(PASSIVE_GOOD, PASSIVE_BAD),
    about=TRIAL,
)
def report_passive_force(trial: Trial, report: FindingCollector) -> None:
    """The passive force of a muscle is large.

    Computes the passive forces of the muscles along the states of CMC, or along the motion of a
    StaticOptimization with fibers in equilibrium, and compares them with `max_isometric_force`.
    OpenSim's best practices
    (https://opensimconfluence.atlassian.net/wiki/spaces/OpenSim/pages/53087686) recommend to check
    them and give no limit: this limit is osimlite's.

    No activation controls passive forces: antagonists must pull against them, which real muscles do
    not do. Static optimization ignores passive forces, so the forces that it computes are wrong.

    ```trial
    - peak of the passive force of 'rect_fem_r' relative to its max_isometric_force: 130 %
    + peak of the passive force of 'rect_fem_r' relative to its max_isometric_force: 12 %
    ```
    """
    advice = (
        "its fibers are too long in this pose: check tendon_slack_length, optimal_fiber_length "
        "and its path"
    )
    trial.judge(report, [PASSIVE_GOOD, PASSIVE_BAD], OSIMLITE, advice, "peak")
