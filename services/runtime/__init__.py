"""Runs nodes: in lockstep in one process, or as processes over Zenoh."""
