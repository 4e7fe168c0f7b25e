"""OpenSim's tools: setup files are run, and what OpenSim would write is written.

A tool is one module with the name of its class in lower case (``inverse_dynamics_tool.py``,
``imu_placer.py``), which is how it is found. It has a function ``run(job, outcome)``: what is to be
done is a :class:`~osimlite.tools.job.Job`, what came out goes into an
:class:`~osimlite.tools.outcome.Outcome`, and is written when all of it is there.
"""
