"""What the network is trained to make small."""

import torch
from torch import Tensor
from torch.nn.functional import binary_cross_entropy_with_logits

from services.perception.training.detector.assignment import Assignment, Targets, assign, unjudged
from services.perception.training.detector.geometry import complete_overlap
from services.perception.training.detector.network import Grid, bins, decode_corners, split

box_weight = 7.5
class_weight = 0.5
distance_weight = 1.5


def detection_loss(raw: Tensor, targets: Targets, grid: Grid) -> Tensor:
    """Loss of raw predictions (B, N, 4 * bins + C), a scalar per unit of score asked for.

    Complete IoU of the boxes, cross entropy of the class scores over all cells, and cross entropy
    of the distance distributions; cells that should be surer of their object count for more.
    """
    distances, logits = split(raw)
    boxes = decode_corners(distances, grid)
    found = assign(boxes.detach(), logits.detach().sigmoid(), targets, grid.centers, grid.sizes)
    total = found.score.sum().clamp(min=1.0)
    wanted = targets.boxes[found.picture, found.target]
    misfit = 1 - complete_overlap(boxes[found.picture, found.cell], wanted)
    spread = _distance_loss(distances[found.picture, found.cell], wanted, found, grid)
    of_boxes = ((box_weight * misfit + distance_weight * spread) * found.score).sum()
    return (of_boxes + class_weight * _class_loss(logits, targets, found, grid)) / total


def _class_loss(logits: Tensor, targets: Targets, found: Assignment, grid: Grid) -> Tensor:
    wanted = torch.zeros_like(logits)
    classes = targets.classes[found.picture, found.target]
    wanted[found.picture, found.cell, classes] = found.score.to(wanted.dtype)
    judged = ~unjudged(targets, grid.centers, grid.sizes)
    judged[found.picture, found.cell] = True
    entropy = binary_cross_entropy_with_logits(logits, wanted, reduction="none")
    return (entropy * judged[..., None]).sum()


def _distance_loss(distances: Tensor, wanted: Tensor, found: Assignment, grid: Grid) -> Tensor:
    """(K,) cross entropy of distances (K, 4, bins) to the sides (Li et al., 2020).

    A true distance lies between two bins, which share its probability.
    """
    centers, sizes = grid.centers[found.cell], grid.sizes[found.cell]
    true = torch.cat([centers - wanted[:, :2], wanted[:, 2:] - centers], -1) / sizes
    true = true.clamp(0, bins - 1.01)
    low = true.long()
    upper = true - low
    logs = distances.log_softmax(-1)
    at_low = logs.gather(-1, low[..., None])[..., 0]
    at_high = logs.gather(-1, low[..., None] + 1)[..., 0]
    return -(at_low * (1 - upper) + at_high * upper).mean(-1)
