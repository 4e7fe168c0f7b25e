"""From mechanism to motion: time steppers, engines, trajectories."""
