"""Pictures of a world by SAPIEN's renderer with a small shader of our own."""
