"""What of the camera's pictures matters now: to which instruction, where, and how often."""
