"""Models and poses that fit measurements: inverse kinematics, scaling, placing of markers.

:mod:`pose_fit <osimlite.fitting.pose_fit>` lays a mechanism and what is measured of it out for the
kernel that finds poses, which is :mod:`osimlite.mechanics.kernels.pose_fit`.
"""
