"""OpenSim's tools: carry out setup files, and write the files that OpenSim would write.

Each tool is a function ``run_...(job, outcome)``, which :data:`osimlite.tools.registry.TOOLS` lists
by OpenSim's class names. The :class:`~osimlite.tools.job.Job` has the setup. The tool puts its
results into the :class:`~osimlite.tools.outcome.Outcome`, which writes all of them at the end or
none.
"""
