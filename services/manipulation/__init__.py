"""Moves the arm: inverse kinematics, motions without collision, grasps, and looks into boxes."""
