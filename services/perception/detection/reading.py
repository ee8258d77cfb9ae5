"""How the file of some network is to be used, or why it cannot be."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from services.perception.detection.class_names import names_in_metadata, read_class_names
from services.perception.detection.layouts import Layout, Question
from services.perception.detection.onnx_file import OnnxFile, Port, read_onnx_file
from services.perception.detection.picture import Preprocessing
from services.perception.detection.sidecar import Sidecar, read_sidecar
from services.perception.errors import DetectorFileError
from services.perception.weight_files import card_path

_CENTRED = Preprocessing(placement="centre")
_BGR_BYTES = Preprocessing(color="bgr", scale=1.0)
_STRETCHED = Preprocessing(placement="stretch")
_usual: dict[Layout, Preprocessing] = {
    Layout.END_TO_END: _CENTRED,
    Layout.CLASS_SCORES: _CENTRED,
    Layout.OBJECTNESS: _BGR_BYTES,
    Layout.CELL_OFFSETS: _BGR_BYTES,
    Layout.MAPS: _BGR_BYTES,
    Layout.CORNERS_AND_SCORES: _STRETCHED,
}
"""What the families that write such layouts were trained with, their size excepted."""

_largest_side = 640
"""Of the input of a network that takes any size, unless its file names another [px]."""
_step = 32
"""Sides of such an input are multiples of this: the coarsest usual stride [px]."""
_whole_numbers = {"QuantizeLinear", "DequantizeLinear", "QLinearConv", "ConvInteger",
                  "MatMulInteger", "DynamicQuantizeLinear", "QLinearMatMul"}  # fmt: skip


@dataclass(frozen=True)
class Reading:
    """What is known of a network before it is run."""

    path: Path
    file: OnnxFile
    sidecar: Sidecar
    classes: tuple[str, ...]
    fixed: tuple[int, int] | None
    """Width and height of the input [px]; None if it follows the picture."""

    @property
    def any_size(self) -> bool:
        """Whether the network takes inputs of any size, whatever size it is usually given."""
        return self.file.inputs[0].shape[2:] == (None, None)

    @property
    def licence(self) -> str:
        """As the sidecar or the file says; "" if neither does."""
        return self.sidecar.licence or self.file.metadata.get("license", "")

    def question(self, width: int, height: int) -> Question:
        """What is known when the layout is to be recognised, for an input of this size [px]."""
        masks_or_joints = self.file.metadata.get("task") in ("segment", "pose")
        return Question(
            width=width,
            height=height,
            classes=len(self.classes),
            more_channels=masks_or_joints or len(self.file.outputs) > 1,
            end_to_end=self.file.metadata.get("end2end") == "True",
            said=self.sidecar.layout,
        )

    def input_size(self, width: int, height: int) -> tuple[int, int]:
        """Width and height of the input for a picture of this size [px]."""
        if self.fixed:
            return self.fixed
        scale = min(1.0, self._largest / max(width, height))
        return _rounded_up(width * scale), _rounded_up(height * scale)

    def preprocessing(self, layout: Layout, boxes_a_cell: int) -> Preprocessing:
        """What the network is shown; its size is still to be set."""
        # Three boxes a cell are of the family that also writes class scores alone.
        usual = _CENTRED if boxes_a_cell > 1 else _usual[layout]
        return self.sidecar.over(usual)

    @property
    def _largest(self) -> int:
        sizes = _literal(self.file.metadata.get("imgsz", ""))
        return max([*sizes, _step]) if sizes else _largest_side


def read_network_file(weights: Path, class_file: Path | None) -> Reading:
    """Read what the file, its sidecar and a list of class names say.

    Raises:
        DetectorFileError: they are malformed, contradict one another, or OpenCV cannot run it.
        MissingWeightsError: our own weights are not what their card describes.
    """
    # A card tells more of what is wrong with weights of our own than their bytes do.
    sidecar, file = read_sidecar(weights), read_onnx_file(weights)
    flaw = _flaw(file)
    if flaw:
        raise DetectorFileError(f"{weights} {flaw}")
    classes = _class_names(weights, file, sidecar, class_file)
    return Reading(weights, file, sidecar, classes, _fixed_size(weights, file.inputs[0], sidecar))


def _flaw(file: OnnxFile) -> str:
    """Why OpenCV cannot run it or should not; "" if it may."""
    if len(file.inputs) != 1 or len(file.inputs[0].shape) != 4:
        inputs = ", ".join(str(port) for port in file.inputs) or "nothing"
        return f"takes {inputs}; usable are networks that take one picture (1, 3, H, W)"
    batch, channels = file.inputs[0].shape[:2]
    if batch not in (1, None) or channels not in (3, None):
        return f"takes {file.inputs[0]}; usable are networks that take a picture (1, 3, H, W)"
    if file.premature:
        return (
            f"uses {file.premature!r} before it is made, as exports in half precision do; "
            "export it in single precision (half=False)"
        )
    if file.operators & _whole_numbers:
        return (
            "is quantised to whole numbers (INT8), which OpenCV runs slower, and not always right; "
            "export it in single precision"
        )
    if file.metadata.get("task", "detect") in ("classify", "obb"):
        return f"was made for the task {file.metadata['task']!r}; usable are networks that detect"
    return ""


def _class_names(
    weights: Path, file: OnnxFile, sidecar: Sidecar, class_file: Path | None
) -> tuple[str, ...]:
    noted = names_in_metadata(file.metadata)
    names = read_class_names(class_file) if class_file else sidecar.classes or noted
    if not names:
        raise DetectorFileError(
            f"{weights} does not say what its classes are called; "
            "give --classes FILE with one name a line, in the order of its outputs"
        )
    if noted and len(noted) != len(names):
        source = class_file or f"the file beside {weights.name}"
        raise DetectorFileError(
            f"{weights} has {len(noted)} classes ({_some(noted)}), {source} names {len(names)}"
        )
    return names


def _fixed_size(weights: Path, port: Port, sidecar: Sidecar) -> tuple[int, int] | None:
    height, width = port.shape[2:]
    for side, own, said in (("width", width, sidecar.width), ("height", height, sidecar.height)):
        if own is not None and said is not None and own != said:
            raise DetectorFileError(
                f"{weights} takes {port}, but the file beside it says that its {side} is {said} px"
            )
    size = width or sidecar.width, height or sidecar.height
    if size[0] is not None and size[1] is not None:
        return size[0], size[1]
    if size != (None, None):
        raise DetectorFileError(
            f"{weights} takes {port}: one side is fixed and one is free; "
            f"say both in {card_path(weights).name} beside it"
        )
    return None


def _rounded_up(side: float) -> int:
    return max(1, -int(-side // _step)) * _step


def _literal(text: str) -> list[int]:
    """A list of whole numbers as exporters write it; empty if it is none."""
    try:
        found: Any = msgspec.json.decode(text.encode())
    except msgspec.DecodeError:
        return []
    sizes: list[Any] = found if isinstance(found, list) else [found]
    return [size for size in sizes if isinstance(size, int)]


def _some(names: tuple[str, ...]) -> str:
    return ", ".join(names[:3]) + (", ..." if len(names) > 3 else "")
