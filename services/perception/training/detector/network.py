"""The detector: a small anchor-free convolutional network for weak processors.

Plain 3x3 convolutions and ReLU train and run several times faster on a CPU than depthwise
separable ones with smooth activations. One 5x5 depthwise block on the coarsest map widens the
receptive field to the whole picture; a top-down pyramid of additions brings it to the finer maps.
"""

from dataclasses import dataclass
from typing import cast

import torch
from torch import Tensor, nn

strides = (8, 16, 32)
"""Of the three output maps [px]."""
bins = 16
"""A box reaches from a cell's centre at most `bins` - 1 strides in each direction."""


class Convolution(nn.Sequential):
    """3x3 or 1x1 convolution, batch normalisation, ReLU."""

    def __init__(
        self, inputs: int, outputs: int, kernel: int = 3, stride: int = 1, groups: int = 1
    ) -> None:
        convolution = nn.Conv2d(
            inputs, outputs, kernel, stride, kernel // 2, groups=groups, bias=False
        )
        norm = nn.BatchNorm2d(outputs, eps=1e-3, momentum=0.03)
        super().__init__(convolution, norm, nn.ReLU(inplace=True))


class Bottleneck(nn.Module):
    """Residual block: 1x1 to half the channels, 3x3 back."""

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.body = nn.Sequential(
            Convolution(channels, channels // 2, kernel=1), Convolution(channels // 2, channels)
        )

    def forward(self, x: Tensor) -> Tensor:
        """Same shape as `x`."""
        return x + self.body(x)


class Context(nn.Module):
    """Residual 5x5 depthwise convolution, mixed by a 1x1."""

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.body = nn.Sequential(
            Convolution(channels, channels, kernel=5, groups=channels),
            Convolution(channels, channels, kernel=1),
        )

    def forward(self, x: Tensor) -> Tensor:
        """Same shape as `x`."""
        return x + self.body(x)


class Pyramid(nn.Module):
    """Adds coarse maps to finer ones, all at `width` channels."""

    def __init__(self, channels: tuple[int, int, int], width: int) -> None:
        super().__init__()
        self.laterals = nn.ModuleList(Convolution(c, width, kernel=1) for c in channels)
        self.smooth = nn.ModuleList(Convolution(width, width) for _ in channels[:-1])

    def forward(self, maps: list[Tensor]) -> list[Tensor]:
        """Maps of strides 8, 16, 32 with `width` channels each."""
        fine, middle, coarse = (lateral(x) for lateral, x in zip(self.laterals, maps, strict=True))
        middle = self.smooth[1](middle + _doubled(coarse))
        fine = self.smooth[0](fine + _doubled(middle))
        return [fine, middle, coarse]


class Head(nn.Module):
    """Distances to the sides of the box, and class logits, of every cell of one map."""

    def __init__(self, width: int, classes: int) -> None:
        super().__init__()
        self.box_branch, self.class_branch = Convolution(width, width), Convolution(width, width)
        self.box = nn.Conv2d(width, 4 * bins, 1)
        self.classes = nn.Conv2d(width, classes, 1)
        # One score in a thousand is of an object, and most boxes are a few strides wide: without
        # this the first steps only unlearn.
        nn.init.constant_(cast(Tensor, self.classes.bias), -6.9)
        with torch.no_grad():
            cast(Tensor, self.box.bias).copy_(-0.4 * torch.arange(bins).float().repeat(4))

    def forward(self, x: Tensor) -> Tensor:
        """(B, H*W, 4 * bins + C)."""
        logits = torch.cat([self.box(self.box_branch(x)), self.classes(self.class_branch(x))], 1)
        return logits.flatten(2).permute(0, 2, 1)


class DetectorNetwork(nn.Module):
    """Pictures (B, 3, H, W), RGB in [0, 1], to raw predictions (B, N, 4 * bins + C).

    H and W are multiples of 32. N counts the cells of the maps of strides 8, 16 and 32, in this
    order, rows first.
    """

    def __init__(self, classes: int, width: int) -> None:
        super().__init__()
        self.width = w = width
        self.stem = nn.Sequential(
            Convolution(3, w // 3, stride=2),
            Convolution(w // 3, 2 * w // 3, stride=2),
            Bottleneck(2 * w // 3),
        )
        self.stage8 = nn.Sequential(
            Convolution(2 * w // 3, w, stride=2), Bottleneck(w), Bottleneck(w)
        )
        self.stage16 = nn.Sequential(
            Convolution(w, 2 * w, stride=2), Bottleneck(2 * w), Bottleneck(2 * w)
        )
        self.stage32 = nn.Sequential(
            Convolution(2 * w, 8 * w // 3, stride=2),
            Context(8 * w // 3),
            Bottleneck(8 * w // 3),
            Bottleneck(8 * w // 3),
        )
        self.pyramid = Pyramid((w, 2 * w, 8 * w // 3), w)
        self.heads = nn.ModuleList(Head(w, classes) for _ in strides)

    def forward(self, pictures: Tensor) -> Tensor:
        """Raw predictions; `decode_corners` turns their first part into pixels."""
        fine = self.stage8(self.stem(pictures))
        middle = self.stage16(fine)
        maps = self.pyramid([fine, middle, self.stage32(middle)])
        return torch.cat([head(x) for head, x in zip(self.heads, maps, strict=True)], 1)


@dataclass(frozen=True)
class Grid:
    """The N cells of all maps of one input size."""

    centers: Tensor
    """(N, 2) as x, y [px]."""
    sizes: Tensor
    """(N, 1) strides [px]."""

    def to(self, device: torch.device) -> "Grid":
        """The same on another device."""
        return Grid(self.centers.to(device), self.sizes.to(device))


def cell_grid(height: int, width: int) -> Grid:
    """All cells of an input, float32.

    In float32 from the start: a grid traced in float64 makes a graph that OpenCV refuses.
    """
    centers, sizes = [], []
    for stride in strides:
        y, x = torch.meshgrid(
            torch.arange(height // stride, dtype=torch.float32),
            torch.arange(width // stride, dtype=torch.float32),
            indexing="ij",
        )
        centers.append((torch.stack([x, y], -1).reshape(-1, 2) + 0.5) * stride)
        sizes.append(torch.full((len(centers[-1]), 1), float(stride)))
    return Grid(torch.cat(centers), torch.cat(sizes))


def split(raw: Tensor) -> tuple[Tensor, Tensor]:
    """Distance logits (B, N, 4, bins) and class logits (B, N, C) of raw predictions."""
    return raw[..., : 4 * bins].unflatten(-1, (4, bins)), raw[..., 4 * bins :]


def decode_corners(distances: Tensor, grid: Grid) -> Tensor:
    """Corner boxes (B, N, 4) [px] of distance logits (B, N, 4, bins).

    A distance is the mean of a distribution over whole strides, which learns finer and surer
    than a single number (Li et al., Generalized Focal Loss, 2020).
    """
    steps = torch.arange(bins, dtype=torch.float32, device=distances.device)
    mean = (distances.softmax(-1) * steps).sum(-1) * grid.sizes
    return torch.cat([grid.centers - mean[..., :2], grid.centers + mean[..., 2:]], -1)


class DecodedNetwork(nn.Module):
    """The network with decoding inside, as it is exported."""

    def __init__(self, network: DetectorNetwork, height: int, width: int) -> None:
        super().__init__()
        self.network = network
        grid = cell_grid(height, width)
        self.register_buffer("centers", grid.centers)
        self.register_buffer("sizes", grid.sizes)

    def forward(self, pictures: Tensor) -> Tensor:
        """(B, N, 4 + C): middle, width and height of the box [px], and class scores."""
        distances, logits = split(self.network(pictures))
        grid = Grid(cast(Tensor, self.centers), cast(Tensor, self.sizes))
        corners = decode_corners(distances, grid)
        low, high = corners[..., :2], corners[..., 2:]
        return torch.cat([(low + high) / 2, high - low, torch.sigmoid(logits)], -1)


def _doubled(x: Tensor) -> Tensor:
    return nn.functional.interpolate(x, scale_factor=2.0, mode="nearest")
