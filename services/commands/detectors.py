"""The options that put other networks before the robot's camera."""

from collections.abc import Sequence
from pathlib import Path

from schemas.errors import UserError
from services.commands.output import say


def chosen(
    detectors: Sequence[Path], class_files: Sequence[Path]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The files as a run's settings name them, tried out, and what they were taken for told.

    Raises:
        UserError: a file cannot be used, or class files are given without networks.
    """
    if not detectors:
        if class_files:
            raise UserError("--classes FILE goes with --detector FILE.onnx, which is not given")
        return (), ()
    from services.perception.detection.bank import user_detectors

    # Services run in folders of their own.
    weights = tuple(str(path.resolve()) for path in detectors)
    names = tuple(str(path.resolve()) for path in class_files)
    for detector in user_detectors(weights, names):
        say(f"detector {detector.description}")
    return weights, names
