"""Chooses where to go, and when to stop, over the whole distribution of maps."""
