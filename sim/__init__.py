"""A robot made of SAPIEN: worlds, physics and sensors behind the same protocol as hardware."""
