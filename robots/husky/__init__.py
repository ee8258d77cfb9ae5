"""Clearpath Husky A200 with an RGB-D camera on a mast and a planar range finder."""
