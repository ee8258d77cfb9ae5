"""Trains and judges the detector. Needs torch, in part."""
