"""Learns the policy's weights from experts in simulated worlds. Not part of a running robot."""
