"""The verb that shows what perception sees in pictures from outside."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

from schemas.errors import UserError
from services.commands.detectors import chosen
from services.commands.output import print_json, print_table, say

if TYPE_CHECKING:
    from schemas.perception import Fiducials, SceneObservation
    from schemas.sensing import RgbdFrame
    from services.perception.detection.bank import FindsObjects
    from services.perception.detection.boxes import Boxes


def look(
    camera: str,
    robot: str = "husky",
    calibration: Path | None = None,
    fov_deg: float | None = None,
    tags: Path | None = None,
    frames: int | None = None,
    width: int = 320,
    detector: tuple[Path, ...] = (),
    classes: tuple[Path, ...] = (),
    out: Path | None = None,
    json: bool = False,
) -> int:
    """What is seen in pictures of a camera or from files: objects, kinds of places and tags.

    Args:
        camera: number of a camera, /dev/videoN, an rtsp:// or http:// address, a video, a picture,
            or a folder of pictures.
        robot: whose kinds of places are told apart.
        calibration: JSON file with the camera's lens: width, height, fx, fy, cx, cy, and optionally
            distortion.
        fov_deg: horizontal angle that the camera sees where there is no such file, else 60.
        tags: JSON file that says which AprilTag hangs in which place.
        frames: end after so many pictures; by default at the end, or at Ctrl-C.
        width: pictures with more columns are made smaller.
        detector: ONNX files of other networks that find objects; several work as one.
        classes: a file with the class names of each, where they do not say them themselves.
        out: folder for the pictures with what was found drawn in.
        json: one JSON document on stdout.
    """
    if calibration is not None and fov_deg is not None:
        raise UserError("--calibration and --fov-deg; allowed: one of them")
    if fov_deg is not None and not 1 <= fov_deg < 179:
        raise UserError(f"--fov-deg {fov_deg:g}; allowed: 1 to 179 degrees")
    looker = _looker(robot, tags, *chosen(detector, classes))
    seen: list[dict[str, Any]] = []
    for number, frame in enumerate(_frames(camera, calibration, fov_deg or 60.0, width, frames)):
        found = looker.look(frame)
        seen.append(found.summary)
        if out is not None:
            _write(out / f"{number:06d}.png", found.drawn(frame))
        if not json:
            _print(number, found.summary)
    if json:
        print_json({"camera": camera, "frames": seen})
    if out is not None:
        say(f"look: wrote {len(seen)} pictures to {out}")
    return 0


@dataclass(frozen=True)
class _Looker:
    """Everything that looks at a frame."""

    detector: "FindsObjects"
    scenes: "Callable[[RgbdFrame], tuple[Fiducials, SceneObservation | None]]"
    """Tags, and kinds of places for robots that have words for them."""

    def look(self, frame: "RgbdFrame") -> "_Found":
        boxes = self.detector.detect(frame.color)
        names = [self.detector.classes[index] for index in boxes.classes.tolist()]
        fiducials, scene = self.scenes(frame)
        return _Found(boxes, names, scene, fiducials)


@dataclass(frozen=True)
class _Found:
    """What one frame shows."""

    boxes: "Boxes"
    names: list[str]
    scene: "SceneObservation | None"
    fiducials: "Fiducials"

    @property
    def summary(self) -> dict[str, Any]:
        corners = self.boxes.corners_px.round(1).tolist()
        scores = self.boxes.scores.round(3).tolist()
        return {
            "objects": [
                {"class": name, "score": score, "box_px": box}
                for name, score, box in zip(self.names, scores, corners, strict=True)
            ],
            "place": self._place(),
            "tags": [
                {"id": number, "position_base_m": position}
                for number, position in zip(
                    self.fiducials.ids.tolist(),
                    self.fiducials.positions_base.round(3).tolist(),
                    strict=True,
                )
            ],
        }

    def _place(self) -> dict[str, float]:
        """Probability of every type of the place that the camera is in."""
        if self.scene is None:
            return {}
        row = self.scene.probabilities[0].round(3).tolist()
        return dict(zip(self.scene.types, row, strict=True))

    def drawn(self, frame: "RgbdFrame") -> Any:
        from services.perception.drawing import draw_boxes, draw_line, draw_outlines

        picture = frame.color.copy()
        labels = [f"{n} {s:.2f}" for n, s in zip(self.names, self.boxes.scores, strict=True)]
        draw_boxes(picture, self.boxes.corners_px, labels)
        tags = [f"tag {number}" for number in self.fiducials.ids.tolist()]
        draw_outlines(picture, self.fiducials.corners_px, tags)
        if place := self._place():
            best = max(place, key=lambda name: place[name])
            draw_line(picture, f"{best} {place[best]:.2f}", (4, 14))
        return picture


def _looker(
    robot: str, tags: Path | None, detectors: tuple[str, ...], detector_classes: tuple[str, ...]
) -> _Looker:
    from robots.catalogue import get_robot
    from robots.tags import place_types, tag_table
    from schemas.run import RunConfig
    from services.perception.detection.bank import detector_of
    from services.perception.fiducials import TagReader, fiducials_in
    from services.perception.places.classifier import PlaceClassifier, scene_in

    spec = get_robot(robot)
    types = place_types(spec)
    run = RunConfig(
        robot=robot,
        tags=str(tags) if tags else "",
        detectors=detectors,
        detector_classes=detector_classes,
    )
    table = tag_table(run, spec)
    reader, classifier = TagReader(), PlaceClassifier() if types else None

    def scenes(frame: "RgbdFrame") -> "tuple[Fiducials, SceneObservation | None]":
        place = scene_in(frame, classifier, types) if classifier else None
        return fiducials_in(frame, reader, table.side_m), place

    return _Looker(detector_of(run), scenes)


def _frames(
    camera: str, calibration: Path | None, fov_deg: float, width: int, most: int | None
) -> "Iterator[RgbdFrame]":
    """Frames without depth, seen level from a metre above the ground."""
    from schemas.geometry import Pose3
    from services.perception.camera.lens import Framing, read_lens, supposed_lens
    from services.perception.camera.source import open_source

    source = open_source(camera)
    lens = read_lens(calibration) if calibration else None
    ahead = Pose3((0.0, 0.0, 1.0), (0.5, -0.5, 0.5, -0.5))
    try:
        for number in count():
            if most is not None and number >= most:
                return
            picture = source.picture()
            if picture is None:
                return
            high, wide = picture.shape[:2]
            fitting = lens or supposed_lens(wide, high, math.radians(fov_deg))
            yield Framing(fitting, ahead, width).frame(picture, number)
    finally:
        source.close()


def _write(path: Path, picture: Any) -> None:
    from services.perception.drawing import write_png

    path.parent.mkdir(parents=True, exist_ok=True)
    if not write_png(str(path), picture):
        raise UserError(f"cannot write {path}")


def _print(number: int, summary: dict[str, Any]) -> None:
    place = summary["place"]
    best = max(place, key=lambda name: place[name]) if place else ""
    print(f"picture {number}: {f'{best} {place[best]:.2f}' if best else 'no kind of place'}")
    rows = [(one["class"], one["score"], one["box_px"]) for one in summary["objects"]]
    rows += [(f"tag {one['id']}", "", one["position_base_m"]) for one in summary["tags"]]
    if rows:
        print_table(("what", "score", "box [px] or place [m]"), rows)
