"""What a person says about a network, in a JSON file of the same name beside it.

Everything may be left out; what is said goes before what the network's file says and before what
is usual for its layout:

    {"classes": ["cone", "hydrant"], "width": 320, "height": 256, "color": "rgb",
     "scale": 0.00392157, "placement": "centre", "fill": 114, "layout": "class_scores",
     "threshold": 0.3, "licence": "Apache-2.0"}
"""

from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta, Struct

from services.perception.detection.calibration import Calibration
from services.perception.detection.card import DetectorCard, is_card, read_card
from services.perception.detection.layouts import Layout
from services.perception.detection.picture import ColorOrder, Placement, Preprocessing
from services.perception.errors import DetectorFileError
from services.perception.weight_files import card_path

Side = Annotated[int, Meta(ge=32, le=4096)]


class Sidecar(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What is said; None and empty where nothing is."""

    classes: tuple[str, ...] = ()
    width: Side | None = None
    """Of the input [px]."""
    height: Side | None = None
    color: ColorOrder | None = None
    scale: Annotated[float, Meta(gt=0)] | None = None
    placement: Placement | None = None
    fill: Annotated[int, Meta(ge=0, le=255)] | None = None
    layout: Layout | None = None
    threshold: Annotated[float, Meta(gt=0, lt=1)] | None = None
    """Least score of a box."""
    licence: str = ""
    calibration: Calibration = Calibration()

    def over(self, usual: Preprocessing) -> Preprocessing:
        """The usual preprocessing, changed by what is said."""
        fields = {name: getattr(self, name) for name in Preprocessing.__struct_fields__}
        said = {name: value for name, value in fields.items() if value is not None}
        return msgspec.structs.replace(usual, **said)


def read_sidecar(weights: Path) -> Sidecar:
    """What is said about the weights; of our own, what their card says.

    Raises:
        DetectorFileError: the file is malformed.
        MissingWeightsError: it is a card, of other weights.
    """
    path = card_path(weights)
    if not path.is_file():
        return Sidecar()
    if is_card(path):
        return _of_card(read_card(weights))
    try:
        return msgspec.json.decode(path.read_bytes(), type=Sidecar)
    except msgspec.DecodeError as error:
        allowed = ", ".join(Sidecar.__struct_fields__)
        raise DetectorFileError(f"{path}: {error}; allowed are {allowed}") from error


def _of_card(card: DetectorCard) -> Sidecar:
    shown = {name: getattr(card.preprocessing, name) for name in Preprocessing.__struct_fields__}
    return Sidecar(
        classes=card.classes,
        threshold=card.threshold,
        licence=card.licence,
        calibration=card.calibration,
        **shown,
    )
