"""Learning to tell places apart: samples, augmentation, one step, and a state that survives."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn.functional import cross_entropy

from schemas.arrays import Floats, Ints
from services.perception.places.windows import network_input
from services.perception.training.places.frames import PlacePicture
from services.perception.training.places.network import PlacesNetwork

_peak_rate, _final_rate = 2e-3, 2e-5
_warm_up_windows = 2000
_weight_decay = 0.05
_smoothing = 0.05


@dataclass(frozen=True)
class Windows:
    """N windows with their labels; -1 says nothing."""

    pictures: NDArray[np.uint8]
    """(N, 120, 160, 3) RGB."""
    labels: Ints
    """(N, 2) types here and ahead."""

    def __getitem__(self, index: Ints) -> "Windows":
        return Windows(self.pictures[index], self.labels[index])


def windows_in(pictures: list[PlacePicture]) -> Windows:
    """All windows of all pictures."""
    labels = [[(picture.here, int(kind)) for kind in picture.ahead] for picture in pictures]
    return Windows(
        np.concatenate([picture.windows for picture in pictures]),
        np.array(labels, np.int32).reshape(-1, 2),
    )


def even_odds(labels: Ints, types: int) -> Floats:
    """Weights (T,) that make every type count as much as any other; their mean is about 1."""
    count = np.bincount(labels[labels >= 0], minlength=types)
    return count.sum() / (types * np.maximum(count, 1))


def batches(windows: Windows, size: int, rng: np.random.Generator) -> Iterator[Windows]:
    """Augmented windows in random order without end, each once before any comes again."""
    waiting: list[int] = []
    while True:
        while len(waiting) < size:
            waiting += rng.permutation(len(windows.labels)).tolist()
        chosen, waiting = waiting[:size], waiting[size:]
        batch = windows[np.array(chosen, np.int32)]
        pictures = np.array([augmented(picture, rng) for picture in batch.pictures])
        yield Windows(pictures, batch.labels)


def augmented(picture: NDArray[np.uint8], rng: np.random.Generator) -> NDArray[np.uint8]:
    """A window (H, W, 3) mirrored, moved, scaled, recoloured, blurred and made noisy at random."""
    height, width = picture.shape[:2]
    scale = float(np.exp(rng.uniform(-0.1, 0.3)))
    mirror = -1.0 if rng.random() < 0.5 else 1.0
    middle = np.array([width / 2, height / 2])
    linear = np.diag([mirror * scale, scale])
    shift = rng.uniform(-0.06, 0.06, 2) * (width, height)
    moved = cv2.warpAffine(
        picture,
        np.column_stack([linear, middle + shift - linear @ middle]),
        (width, height),
        borderMode=cv2.BORDER_REPLICATE,
    )
    if rng.random() < 0.2:
        moved = cv2.blur(moved, (3, 3))
    tint = np.exp(rng.normal(0, 0.08, 3)) * np.exp(rng.normal(0, 0.25))
    light = (np.asarray(moved, np.float32) / 255) ** np.exp(rng.normal(0, 0.2)) * tint
    noise = rng.normal(0, rng.uniform(0, 0.03), light.shape)
    return (np.clip(light + noise, 0, 1) * 255).astype(np.uint8)


class PlacesTraining:
    """A network and the optimiser's state.

    Args:
        types: number of types T.
        seed: of every random choice.
        weights: (2, T) of the types, here and ahead.
    """

    def __init__(self, types: int, seed: int, weights: Floats) -> None:
        torch.manual_seed(seed)
        self.network = PlacesNetwork(types)
        self.optimizer = torch.optim.AdamW(self.network.parameters(), weight_decay=_weight_decay)
        self.rng = np.random.default_rng(seed)
        self.windows_seen = 0
        self._weights = torch.from_numpy(weights.astype(np.float32))

    def step(self, batch: Windows, total: int) -> float:
        """Learn from one batch and return the loss; `total` windows are the schedule's length."""
        for group in self.optimizer.param_groups:
            group["lr"] = learning_rate(self.windows_seen, total)
        self.network.train()
        loss = self._loss(self.network(windows_tensor(batch)), batch.labels)
        self.optimizer.zero_grad()
        loss.backward()
        self.optimizer.step()
        self.windows_seen += len(batch.labels)
        return float(loss.detach())

    def _loss(self, logits: Tensor, labels: Ints) -> Tensor:
        wanted = torch.from_numpy(labels.astype(np.int64))
        terms = [
            cross_entropy(
                logits[:, head],
                wanted[:, head],
                weight=self._weights[head],
                ignore_index=-1,
                label_smoothing=_smoothing,
            )
            for head in range(2)
            if (labels[:, head] >= 0).any()
        ]
        return torch.stack(terms).sum()

    def save(self, path: Path) -> None:
        """Write everything that `load` needs; an interruption leaves the old file whole."""
        state = {
            "network": self.network.state_dict(),
            "optimizer": self.optimizer.state_dict(),
            "rng": self.rng.bit_generator.state,
            "windows_seen": self.windows_seen,
        }
        partial = path.with_suffix(".partial")
        torch.save(state, partial)
        partial.replace(path)

    def load(self, path: Path) -> None:
        """Continue where `save` was called."""
        state: dict[str, Any] = torch.load(path, weights_only=True)
        self.network.load_state_dict(state["network"])
        self.optimizer.load_state_dict(state["optimizer"])
        self.rng.bit_generator.state = state["rng"]
        self.windows_seen = state["windows_seen"]


def learning_rate(seen: int, total: int) -> float:
    """Linear warm-up, then half a cosine down to the final rate."""
    if seen < _warm_up_windows:
        return _peak_rate * (seen + 1) / _warm_up_windows
    done = min((seen - _warm_up_windows) / max(total - _warm_up_windows, 1), 1)
    return _final_rate + (_peak_rate - _final_rate) * (1 + math.cos(math.pi * done)) / 2


def windows_tensor(batch: Windows) -> Tensor:
    """Network input (B, 3, H, W), made as at run time."""
    return torch.from_numpy(np.concatenate([network_input(one) for one in batch.pictures]))
