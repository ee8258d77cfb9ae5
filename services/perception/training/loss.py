"""What the network is trained to make small."""

import torch
from torch import Tensor
from torch.nn.functional import binary_cross_entropy_with_logits, one_hot

from services.perception.training.assignment import Targets, assign, corners
from services.perception.training.network import decode_boxes

box_weight = 5.0


def detection_loss(raw: Tensor, targets: Targets, centers: Tensor, sizes: Tensor) -> Tensor:
    """Loss of raw predictions (B, N, 5 + C), a scalar per answering cell.

    Generalised IoU of the boxes (Rezatofighi et al., 2019), cross entropy of objectness over all
    cells, and cross entropy of the classes with the overlap as target, so that class scores also
    tell how well a box fits.
    """
    boxes, logits = corners(decode_boxes(raw, centers, sizes)), raw[..., 4:]
    found = assign(boxes.detach(), logits.detach(), targets, centers, sizes)
    number = max(len(found.cell), 1)
    objectness = torch.zeros_like(logits[..., 0])
    objectness[found.picture, found.cell] = 1.0
    loss = binary_cross_entropy_with_logits(logits[..., 0], objectness, reduction="sum")
    wanted = targets.boxes[found.picture, found.target]
    loss = (
        loss
        + box_weight * (1 - generalised_overlap(boxes[found.picture, found.cell], wanted)).sum()
    )
    labels = one_hot(targets.classes[found.picture, found.target], logits.shape[-1] - 1)
    loss = loss + binary_cross_entropy_with_logits(
        logits[found.picture, found.cell, 1:], labels * found.overlap[:, None], reduction="sum"
    )
    return loss / number


def generalised_overlap(a: Tensor, b: Tensor) -> Tensor:
    """GIoU in (-1, 1] of corner boxes (K, 4): IoU less the empty part of their common hull."""
    shared = (torch.minimum(a[:, 2:], b[:, 2:]) - torch.maximum(a[:, :2], b[:, :2])).clamp(min=0)
    inner = shared.prod(-1)
    union = (a[:, 2:] - a[:, :2]).prod(-1) + (b[:, 2:] - b[:, :2]).prod(-1) - inner
    hull = (torch.maximum(a[:, 2:], b[:, 2:]) - torch.minimum(a[:, :2], b[:, :2])).prod(-1)
    return inner / (union + 1e-9) - (hull - union) / (hull + 1e-9)
