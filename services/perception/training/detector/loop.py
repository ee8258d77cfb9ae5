"""The optimisation itself: one step, the schedule, and a state that survives interruption."""

import math
from collections.abc import Sequence
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
import torch
from torch import Tensor

from services.perception.detection.picture import input_height, input_width, network_input
from services.perception.errors import DetectorFileError
from services.perception.training.detector.assignment import Targets
from services.perception.training.detector.frames import Frame
from services.perception.training.detector.loss import detection_loss
from services.perception.training.detector.network import DetectorNetwork, cell_grid
from services.perception.training.detector.widening import widen

_final_rate = 5e-5
_warm_up_pictures = 3000
_average_decay = 0.9995
_weight_decay = 0.02
_longest_gradient = 10.0
_steps_a_row = 200
"""Of the table of losses."""
_layout = torch.channels_last
"""Of the pictures, hence of all that follows from them: a fifth faster on a CPU."""


@dataclass(frozen=True)
class Stage:
    """A part of the training in which the network has one width."""

    width: int
    share: float
    """Of all pictures."""
    peak_rate: float


STAGES = (Stage(48, 0.6, 2e-3), Stage(72, 0.4, 1e-3))
"""The second costs 2.3 times as much a picture; see `widening`."""


@dataclass(frozen=True)
class Progress:
    """Where in its schedule a training is."""

    stage: int
    seen: int
    """Pictures of this stage."""
    total: int

    @staticmethod
    def after(pictures_seen: int, total_pictures: int, stages: Sequence[Stage]) -> "Progress":
        """The stage that the next picture belongs to."""
        began = 0
        for number, stage in enumerate(stages):
            total = round(stage.share * total_pictures)
            if pictures_seen < began + total or number == len(stages) - 1:
                return Progress(number, pictures_seen - began, total)
            began += total
        raise ValueError("a training has at least one stage")


class Training:
    """A network, the moving average of its weights, and the optimiser's state."""

    def __init__(
        self, classes: tuple[str, ...], seed: int, stages: Sequence[Stage] = STAGES
    ) -> None:
        self.classes, self.stages, self._seed = classes, tuple(stages), seed
        self.device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
        self._begin(self.stages[0].width)
        self.rng = np.random.default_rng(seed)
        self.pictures_seen = 0
        self.cpu_s = 0.0
        """Processor time that training took so far; kept by who calls `step`."""
        self.losses: list[tuple[int, float]] = []
        """Pictures seen, and the mean loss since the row before."""
        self._recent: list[float] = []
        self._grid = cell_grid(input_height, input_width).to(self.device)

    def step(self, frames: list[Frame], total_pictures: int) -> float:
        """Learn from one batch and return the loss; `total_pictures` is the schedule's length."""
        progress = Progress.after(self.pictures_seen, total_pictures, self.stages)
        stage = self.stages[progress.stage]
        if stage.width != self.network.width:
            self._widen(stage.width)
        for group in self.optimizer.param_groups:
            group["lr"] = learning_rate(progress.seen, progress.total, stage.peak_rate)
        self.network.train()
        pictures = pictures_tensor(frames).to(self.device, memory_format=_layout)
        with torch.autocast(self.device.type, torch.bfloat16, enabled=multiplies_bfloat16()):
            raw = self.network(pictures)
        loss = detection_loss(raw.float(), targets_of(frames, self.device), self._grid)
        self.optimizer.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), _longest_gradient)
        self.optimizer.step()
        self.pictures_seen += len(frames)
        self._update_average(progress.seen // len(frames) + 1)
        return self._noted(float(loss.detach()))

    def _begin(self, width: int) -> None:
        """A network of this width that has learned nothing."""
        torch.manual_seed(self._seed)
        self.network = DetectorNetwork(len(self.classes), width).to(self.device)
        self.average = deepcopy(self.network).eval()
        self.optimizer = torch.optim.AdamW(self.network.parameters(), weight_decay=_weight_decay)

    def _widen(self, width: int) -> None:
        narrow, narrow_average = self.network, self.average
        self._begin(width)
        widen(narrow, self.network)
        widen(narrow_average, self.average)

    def _noted(self, loss: float) -> float:
        self._recent.append(loss)
        if len(self._recent) == _steps_a_row:
            self.losses.append((self.pictures_seen, float(np.mean(self._recent))))
            self._recent = []
        return loss

    def save(self, path: Path) -> None:
        """Write everything that `load` needs; an interruption leaves the old file whole."""
        state = {
            "network": self.network.state_dict(),
            "average": self.average.state_dict(),
            "optimizer": self.optimizer.state_dict(),
            "rng": self.rng.bit_generator.state,
            "pictures_seen": self.pictures_seen,
            "cpu_s": self.cpu_s,
            "losses": self.losses,
            "classes": self.classes,
            "width": self.network.width,
        }
        partial = path.with_suffix(".partial")
        torch.save(state, partial)
        partial.replace(path)

    def load(self, path: Path) -> None:
        """Continue where `save` was called.

        Raises:
            DetectorFileError: it was called for other classes, or for another network.
        """
        state: dict[str, Any] = torch.load(path, map_location=self.device, weights_only=True)
        known = [stage.width for stage in self.stages]
        if state.get("classes") == self.classes and state.get("width") in known:
            self._begin(state["width"])
        mine = {name: value.shape for name, value in self.network.state_dict().items()}
        theirs = {name: value.shape for name, value in state["network"].items()}
        if state.get("classes") != self.classes or mine != theirs:
            raise DetectorFileError(
                f"{path} is of a training of other classes or of another network; "
                "move it away to begin anew"
            )
        self.network.load_state_dict(state["network"])
        self.average.load_state_dict(state["average"])
        self.optimizer.load_state_dict(state["optimizer"])
        self.rng.bit_generator.state = state["rng"]
        self.pictures_seen, self.cpu_s = state["pictures_seen"], state["cpu_s"]
        self.losses = state["losses"]

    def _update_average(self, step: int) -> None:
        # Early on a long memory would hold the random start.
        decay = min(_average_decay, step / (step + 20))
        with torch.no_grad():
            for mean, new in zip(_tensors(self.average), _tensors(self.network), strict=True):
                if mean.dtype.is_floating_point:
                    mean.lerp_(new, 1 - decay)
                else:
                    mean.copy_(new)


def multiplies_bfloat16() -> bool:
    """Whether the device is faster at 16-bit products; training takes 0.6 of the time then."""
    if torch.cuda.is_available():
        return torch.cuda.is_bf16_supported()
    return torch.cpu._is_avx512_bf16_supported()  # pyright: ignore[reportPrivateUsage]


def learning_rate(seen: int, total: int, peak: float) -> float:
    """Linear warm-up to the peak, then half a cosine down to the final rate; counts pictures."""
    if seen < _warm_up_pictures:
        return peak * (seen + 1) / _warm_up_pictures
    done = min((seen - _warm_up_pictures) / max(total - _warm_up_pictures, 1), 1)
    return _final_rate + (peak - _final_rate) * (1 + math.cos(math.pi * done)) / 2


def pictures_tensor(frames: list[Frame]) -> Tensor:
    """Network input (B, 3, H, W), made as at run time."""
    return torch.from_numpy(np.concatenate([network_input(frame.color) for frame in frames]))


def targets_of(frames: list[Frame], device: torch.device) -> Targets:
    """The frames' objects, padded to the same number; at least one column."""
    most = max(1, *(len(frame.classes) for frame in frames))
    boxes = np.zeros((len(frames), most, 4), np.float32)
    classes = np.zeros((len(frames), most), np.int64)
    present, ignored = np.zeros((2, len(frames), most), np.bool_)
    for row, frame in enumerate(frames):
        number = len(frame.classes)
        boxes[row, :number], classes[row, :number] = frame.boxes, frame.classes
        present[row, :number], ignored[row, :number] = ~frame.ignored, frame.ignored
    arrays = (torch.from_numpy(array).to(device) for array in (boxes, classes, present, ignored))
    return Targets(*arrays)


def _tensors(network: DetectorNetwork) -> list[Tensor]:
    return cast(list[Tensor], list(network.state_dict().values()))
