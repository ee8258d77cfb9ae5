"""Store what the weights find in the fixture frame: `python -m tests.data.bless_perception`.

`perception_frame.npz` is a frame of the simulator (a random training scene, level camera, sensor
noise on the depth) with the true places of some of its objects.
"""

import json
from pathlib import Path

import numpy as np

from services.perception.detection.detector import Detector, default_weights
from services.perception.weight_files import file_sha256

DATA = Path(__file__).parent


def main() -> None:
    detector = Detector()
    with np.load(DATA / "perception_frame.npz") as arrays:
        found = detector.detect(arrays["color"])
    expected = {
        "sha256": file_sha256(default_weights),
        "names": [detector.classes[index] for index in found.classes],
        "boxes_px": found.corners_px.round(3).tolist(),
        "scores": found.scores.round(5).tolist(),
    }
    (DATA / "perception_expected.json").write_text(json.dumps(expected, indent=1) + "\n")


if __name__ == "__main__":
    main()
