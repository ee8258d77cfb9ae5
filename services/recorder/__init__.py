"""Writes every message of a run to one file."""
