"""Learns how large things are behind what is seen of them."""
