"""Each class of probes, in the module of its name: `PROBE` declares it."""
