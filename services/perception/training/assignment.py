"""Which cells of the network answer for which object (SimOTA: Ge et al., YOLOX, 2021).

Every object takes the cells near its middle that already predict it best; how many it takes
follows from how well they do. The whole batch is assigned at once with padded objects.
"""

from dataclasses import dataclass

import torch
from torch import Tensor

candidate_radius = 2.5
"""Cells whose centre is within this many strides of an object's middle may answer for it."""
_most_cells = 10
_overlap_weight = 3.0
_never = 1e8


@dataclass(frozen=True)
class Targets:
    """Objects of a batch, padded to the same number G in each picture."""

    boxes: Tensor
    """(B, G, 4) corners x0 y0 x1 y1 [px]."""
    classes: Tensor
    """(B, G) class ids, int64."""
    present: Tensor
    """(B, G) bool, false where padded."""


@dataclass(frozen=True)
class Assignment:
    """The cells that answer for an object, K in all."""

    picture: Tensor
    """(K,) index of the picture."""
    cell: Tensor
    """(K,) index of the cell."""
    target: Tensor
    """(K,) index of the object in its picture."""
    overlap: Tensor
    """(K,) IoU of prediction and object."""


def corners(boxes: Tensor) -> Tensor:
    """Corner boxes (..., 4) of centre-and-size boxes (..., 4)."""
    half = boxes[..., 2:] / 2
    return torch.cat([boxes[..., :2] - half, boxes[..., :2] + half], -1)


def overlaps(a: Tensor, b: Tensor) -> Tensor:
    """IoU of corner boxes, broadcast over the leading axes."""
    low, high = torch.maximum(a[..., :2], b[..., :2]), torch.minimum(a[..., 2:], b[..., 2:])
    shared = (high - low).clamp(min=0).prod(-1)
    return shared / (_area(a) + _area(b) - shared + 1e-9)


def assign(
    boxes: Tensor, logits: Tensor, targets: Targets, centers: Tensor, sizes: Tensor
) -> Assignment:
    """Assign predicted boxes (B, N, 4, corners) and logits (B, N, 1 + C) to objects."""
    with torch.no_grad():
        allowed = _allowed(targets, centers, sizes)
        overlap = overlaps(targets.boxes[:, :, None], boxes[:, None]) * allowed
        cost = _class_cost(logits, targets) - _overlap_weight * torch.log(overlap + 1e-8)
        cost = torch.where(allowed, cost, torch.full_like(cost, _never))
        chosen = _cheapest(cost, overlap) & allowed
        # A cell that two objects want goes to the one that it fits better.
        best = torch.zeros_like(chosen).scatter_(1, cost.argmin(1, keepdim=True), True)
        picture, target, cell = torch.nonzero(chosen & best, as_tuple=True)
        return Assignment(picture, cell, target, overlap[picture, target, cell])


def _allowed(targets: Targets, centers: Tensor, sizes: Tensor) -> Tensor:
    """(B, G, N): cell centre inside the object's box and near its middle."""
    low, high = targets.boxes[..., :2], targets.boxes[..., 2:]
    middle = ((low + high) / 2)[:, :, None]
    near = ((centers - middle).abs() < candidate_radius * sizes).all(-1)
    inside = ((centers > low[:, :, None]) & (centers < high[:, :, None])).all(-1)
    # Objects smaller than a cell hold no cell centre: there the nearest cells have to do.
    tiny = (high - low).amin(-1)[:, :, None, None] < 1.5 * sizes
    adjacent = ((centers - middle).abs() < 0.75 * sizes).all(-1, keepdim=True) & tiny
    return ((near & inside) | adjacent[..., 0]) & targets.present[..., None]


def _class_cost(logits: Tensor, targets: Targets) -> Tensor:
    """(B, G, N): cross entropy of each object's class at each cell."""
    probability = (logits[..., :1].sigmoid() * logits[..., 1:].sigmoid()).sqrt()
    probability = probability.clamp(1e-6, 1 - 1e-6)
    others = -torch.log1p(-probability)
    total = others.sum(-1)[:, None]
    index = targets.classes[:, :, None].expand(-1, -1, logits.shape[1])
    own = torch.gather(probability.transpose(1, 2), 1, index)
    return total + torch.log1p(-own) - torch.log(own)


def _cheapest(cost: Tensor, overlap: Tensor) -> Tensor:
    """(B, G, N) bool: the k cheapest cells, k being the sum of the best overlaps."""
    number = overlap.topk(_most_cells, -1).values.sum(-1).int().clamp(min=1)
    values, cells = cost.topk(_most_cells, -1, largest=False)
    rank = torch.arange(_most_cells, device=cost.device)
    taken = (rank < number[..., None]) & (values < _never / 2)
    return torch.zeros_like(overlap, dtype=torch.bool).scatter_(2, cells, taken)


def _area(boxes: Tensor) -> Tensor:
    return (boxes[..., 2:] - boxes[..., :2]).clamp(min=0).prod(-1)
