"""Pictures of cameras and files that are not the robot's own."""
