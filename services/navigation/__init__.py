"""Gets the base to a goal: path on the laser's grid, path following, obstacle stop."""
