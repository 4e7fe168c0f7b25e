"""Many simulations of one model: parameter sweeps, gaits, reflexes, and environments for learning."""
