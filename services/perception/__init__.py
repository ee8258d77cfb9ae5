"""Finds objects in camera pictures and says where they stand.

The network runs in OpenCV alone; torch is needed to train it and for nothing else.
"""
