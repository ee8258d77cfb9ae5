"""Textured objects made by our own code; no model files are read or written."""
