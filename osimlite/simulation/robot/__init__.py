"""The neutral robot: a mechanism as links and one-axis joints, which engines and robot formats are made from."""
