"""Husky with a UR5 arm on its deck, a parallel gripper and a second camera on the wrist."""
