"""PyBullet in a world of its own: mass matrix, bias, fixed steps and the window."""
