"""How a camera picture becomes the network's input: the same in training and at run time."""

import cv2
import numpy as np
from numpy.typing import NDArray

from services.perception.errors import PerceptionError

input_width, input_height = 320, 256
"""Of the network's input [px]; both are multiples of 32."""
padding_value = 114
"""Grey of the rows below the picture."""


def network_input(color: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Blob (1, 3, 256, 320), RGB in [0, 1], of a picture (H <= 256, W <= 320, 3).

    The picture keeps its scale and lies in the upper left corner, so boxes need no conversion.

    Raises:
        PerceptionError: the picture is larger than the network's input.
    """
    height, width = color.shape[:2]
    if height > input_height or width > input_width:
        raise PerceptionError(
            f"a picture of {width}x{height} px does not fit the detector, "
            f"which takes at most {input_width}x{input_height}"
        )
    padded = np.full((input_height, input_width, 3), padding_value, np.uint8)
    padded[:height, :width] = color
    return np.asarray(cv2.dnn.blobFromImage(padded, scalefactor=1 / 255), np.float32)
