"""A wider network that says what a narrow one says, to go on learning from there.

Net2Net (Chen, Goodfellow and Shlens, 2016): steps of a narrow network are several times cheaper,
and most of what is to be learned does not need the width. The channels that are added see
everything, but nothing that was there before listens to them until training makes it.
"""

import torch
from torch import Tensor

from services.perception.training.detector.network import DetectorNetwork


def widen(narrow: DetectorNetwork, wide: DetectorNetwork) -> None:
    """Give `wide`, freshly made, what `narrow` has learned; both say the same then."""
    old = narrow.state_dict()
    with torch.no_grad():
        for name, tensor in wide.state_dict().items():
            _take_over(tensor, old[name])


def _take_over(new: Tensor, old: Tensor) -> None:
    if new.dim() == 0:
        new.copy_(old)
        return
    outputs = old.shape[0]
    if new.dim() > 1:
        inputs = old.shape[1]
        new[:outputs, inputs:] = 0.0
        new[:outputs, :inputs] = old
    else:
        new[:outputs] = old
