"""Trains the detector. Needs torch and onnx, which nothing else does (`incognita[train]`).

`train.train_detector` is the entry; reading frames and measuring precision work without torch.
"""
