"""The classifier of places: plain convolutions, and two linear heads on means of the last map."""

from pathlib import Path

import torch
from torch import Tensor, nn

from services.perception.places.windows import input_height, window_width
from services.perception.training.detector.export import export
from services.perception.training.detector.network import Bottleneck, Context, Convolution

_dropped = 0.2


class PlacesNetwork(nn.Module):
    """Windows (B, 3, 128, 160), RGB in [0, 1], to logits (B, 2, T): here, and ahead.

    Both heads see the mean of the whole map and that of its middle: what is in the middle may be
    another place, and the rest says how much of it is.
    """

    def __init__(self, types: int, width: int = 16) -> None:
        super().__init__()
        w = width
        self.body = nn.Sequential(
            Convolution(3, w, stride=2),
            Convolution(w, 5 * w // 2, stride=2),
            Bottleneck(5 * w // 2),
            Convolution(5 * w // 2, 4 * w, stride=2),
            Bottleneck(4 * w),
            Convolution(4 * w, 7 * w, stride=2),
            Context(7 * w),
            Bottleneck(7 * w),
            Convolution(7 * w, 7 * w, kernel=1),
        )
        self.head = nn.Sequential(nn.Dropout(_dropped), nn.Linear(2 * 7 * w, 2 * types))
        self.types = types

    def forward(self, windows: Tensor) -> Tensor:
        """Logits; calibration turns them into probabilities."""
        maps = self.body(windows)
        columns = maps.shape[-1]
        middle = maps[..., columns // 4 : columns - columns // 4]
        means = torch.cat([maps.mean((2, 3)), middle.mean((2, 3))], 1)
        return self.head(means).view(-1, 2, self.types)


def export_places(network: PlacesNetwork, path: Path) -> None:
    """Write an ONNX file whose weights are stored in half precision."""
    export(network, (input_height, window_width), "window", "logits", path)
