"""Trains the detector. Needs torch and onnx, which nothing else does (`incognita[train]`).

`train.train_detector` is the entry; `darknet` turns networks of that family into ONNX files.
Reading frames and measuring precision work without torch.
"""
