"""Models and poses that fit measurements: inverse kinematics, scaling, placement of markers.

:mod:`pose_fit <osimlite.fitting.pose_fit>` packs a mechanism and its measurements for the kernel
that computes poses, :mod:`osimlite.mechanics.kernels.pose_fit`.
"""
