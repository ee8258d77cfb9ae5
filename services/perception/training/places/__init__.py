"""Trains and judges the classifier of places. Needs torch, in part."""
