"""Fits the grounding model's weights to an annotated corpus."""
