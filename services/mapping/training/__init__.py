"""Fits what the map believes before it sees: relations, places, densities."""
