"""Which cells of the network answer for which object (task alignment: Feng et al., TOOD, 2021).

Every object takes the cells inside it that already predict its class and its box best, and asks
of each a score that says how well. So a score tells how well a box fits, and boxes that fit are
kept when overlapping ones are removed. The whole batch is assigned at once with padded objects.
"""

from dataclasses import dataclass

import torch
from torch import Tensor

from services.perception.training.detector.geometry import overlaps

_most_cells = 10
_least_cells = 3
"""Of an object that no prediction overlaps yet: the nearest ones."""
_score_power = 0.5
_overlap_power = 6.0
_never = 1e8


@dataclass(frozen=True)
class Targets:
    """Objects of a batch, padded to the same number G in each picture."""

    boxes: Tensor
    """(B, G, 4) corners x0 y0 x1 y1 [px]."""
    classes: Tensor
    """(B, G) class ids, int64."""
    present: Tensor
    """(B, G) bool, false where padded or ignored."""
    ignored: Tensor
    """(B, G) bool, objects that are neither to be found nor wrong to be found."""


@dataclass(frozen=True)
class Assignment:
    """The cells that answer for an object, K in all."""

    picture: Tensor
    """(K,) index of the picture."""
    cell: Tensor
    """(K,) index of the cell."""
    target: Tensor
    """(K,) index of the object in its picture."""
    score: Tensor
    """(K,) in [0, 1], which the object's class should have at the cell."""


def assign(
    boxes: Tensor, scores: Tensor, targets: Targets, centers: Tensor, sizes: Tensor
) -> Assignment:
    """Assign predicted boxes (B, N, 4, corners) and class scores (B, N, C) to objects."""
    with torch.no_grad():
        allowed = _allowed(targets, centers, sizes)
        overlap = overlaps(targets.boxes[:, :, None], boxes[:, None]) * allowed
        alignment = _own(scores, targets) ** _score_power * overlap**_overlap_power
        chosen = _best(alignment, allowed) | _nearest_of_the_lost(
            overlap, allowed, targets, centers
        )
        # A cell that two objects want goes to the one that it fits better.
        preferred = torch.where(chosen, overlap, -torch.ones_like(overlap))
        chosen &= torch.zeros_like(chosen).scatter_(1, preferred.argmax(1, keepdim=True), True)
        picture, target, cell = torch.nonzero(chosen, as_tuple=True)
        wanted = _wanted(alignment * chosen, overlap * chosen)
        return Assignment(picture, cell, target, wanted[picture, target, cell])


def unjudged(targets: Targets, centers: Tensor, sizes: Tensor) -> Tensor:
    """(B, N): cells on an ignored object, where finding nothing and something are both right."""
    low, high = targets.boxes[..., :2], targets.boxes[..., 2:]
    # Half a cell about it too: small objects hold no cell's centre.
    after = centers > low[:, :, None] - sizes / 2
    before = centers < high[:, :, None] + sizes / 2
    return ((after & before).all(-1) & targets.ignored[..., None]).any(1)


def _allowed(targets: Targets, centers: Tensor, sizes: Tensor) -> Tensor:
    """(B, G, N): cell centre inside the object's box."""
    low, high = targets.boxes[..., :2], targets.boxes[..., 2:]
    inside = ((centers > low[:, :, None]) & (centers < high[:, :, None])).all(-1)
    # Objects smaller than a cell hold no cell centre: there the nearest cells have to do.
    tiny = (high - low).amin(-1)[:, :, None] < 1.5 * sizes[:, 0]
    adjacent = ((centers - ((low + high) / 2)[:, :, None]).abs() < 0.75 * sizes).all(-1)
    return (inside | (adjacent & tiny)) & targets.present[..., None]


def _own(scores: Tensor, targets: Targets) -> Tensor:
    """(B, G, N): score of each object's class at each cell."""
    index = targets.classes[:, :, None].expand(-1, -1, scores.shape[1])
    return torch.gather(scores.transpose(1, 2), 1, index)


def _best(alignment: Tensor, allowed: Tensor) -> Tensor:
    """(B, G, N): of each object the cells that are aligned best, if at all."""
    values, cells = alignment.topk(_most_cells, -1)
    return torch.zeros_like(allowed).scatter_(2, cells, values > 0) & allowed


def _nearest_of_the_lost(
    overlap: Tensor, allowed: Tensor, targets: Targets, centers: Tensor
) -> Tensor:
    """(B, G, N): the nearest cells of objects that nothing overlaps, as when training begins."""
    lost = (overlap.amax(-1) == 0) & targets.present
    middles = (targets.boxes[..., :2] + targets.boxes[..., 2:]) / 2
    distance = (centers - middles[:, :, None]).square().sum(-1) + _never * ~allowed
    cells = distance.topk(_least_cells, -1, largest=False).indices
    return torch.zeros_like(allowed).scatter_(2, cells, True) & allowed & lost[..., None]


def _wanted(alignment: Tensor, overlap: Tensor) -> Tensor:
    """(B, G, N): the best aligned cell is asked for its object's best overlap, others for less."""
    share = alignment / (alignment.amax(-1, keepdim=True) + 1e-12)
    return share * overlap.amax(-1, keepdim=True)
