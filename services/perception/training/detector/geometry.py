"""How well boxes fit, for the loss."""

import math

import torch
from torch import Tensor

_tiny = 1e-7


def overlaps(a: Tensor, b: Tensor) -> Tensor:
    """IoU of corner boxes, broadcast over the leading axes."""
    low, high = torch.maximum(a[..., :2], b[..., :2]), torch.minimum(a[..., 2:], b[..., 2:])
    shared = (high - low).clamp(min=0).prod(-1)
    return shared / (_area(a) + _area(b) - shared + _tiny)


def complete_overlap(a: Tensor, b: Tensor) -> Tensor:
    """CIoU of corner boxes (K, 4) and true ones (Zheng et al., 2020).

    IoU, less the distance of the middles in diagonals of the common hull, less a measure of how
    different the proportions are; so boxes that do not meet still learn where to go.
    """
    overlap = overlaps(a, b)
    hull = torch.maximum(a[:, 2:], b[:, 2:]) - torch.minimum(a[:, :2], b[:, :2])
    apart = (a[:, :2] + a[:, 2:] - b[:, :2] - b[:, 2:]).square().sum(-1) / 4
    skew = (_slant(a) - _slant(b)).square() * (4 / math.pi**2)
    with torch.no_grad():
        weight = skew / (1 - overlap + skew + _tiny)
    return overlap - apart / (hull.square().sum(-1) + _tiny) - weight * skew


def _slant(boxes: Tensor) -> Tensor:
    """Angle of the diagonal, a bounded measure of width to height."""
    sides = (boxes[:, 2:] - boxes[:, :2]).clamp(min=_tiny)
    return torch.atan(sides[:, 0] / sides[:, 1])


def _area(boxes: Tensor) -> Tensor:
    return (boxes[..., 2:] - boxes[..., :2]).clamp(min=0).prod(-1)
