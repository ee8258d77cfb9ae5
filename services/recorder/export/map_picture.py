"""One picture of the map from above; up is +y of the map."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image, ImageDraw

from robots.colours import BLUE, GREEN, GREY, ORANGE, class_colour
from schemas.arrays import Floats
from schemas.belief import MapBelief, OccupancyGrid
from schemas.geometry import Pose2
from services.recorder.viewer.ground import grid_colours
from services.recorder.viewer.scene import (
    guess_opacity,
    guessed_rows,
    region_rows,
    seen_opacity,
    seen_rows,
)

if TYPE_CHECKING:
    from services.recorder.export.map_film import Scene

_longest_px = 640
_caption_px = 34
_unknown = (246, 247, 249)
_ink = (30, 34, 42)


@dataclass(frozen=True)
class Window:
    """The part of the map that is drawn."""

    low: tuple[float, ...]
    """Lower left corner x, y [m]."""
    high: tuple[float, ...]
    """Upper right corner [m]."""

    @property
    def scale(self) -> float:
        """Pixels a metre."""
        return _longest_px / max(self.high[0] - self.low[0], self.high[1] - self.low[1])

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the picture [px]."""
        width, height = (
            round(self.scale * (b - a)) for a, b in zip(self.low, self.high, strict=True)
        )
        return width, height

    def pixels(self, points: Floats) -> list[tuple[float, float]]:
        """(N, 2) in the map frame [m] as places in the picture."""
        x = (points[:, 0] - self.low[0]) * self.scale
        y = (self.high[1] - points[:, 1]) * self.scale
        return list(zip(x.tolist(), y.tolist(), strict=True))


def draw_map(window: Window, scene: Scene, seconds: float) -> Image.Image:
    """Everything that the scene holds, with the instruction and the time below."""
    assert scene.belief is not None
    floor = _floor(window, scene.grid)
    _blend(floor, _guesses(window, scene.belief))
    _blend(floor, _seen(window, scene.belief))
    draw = ImageDraw.Draw(floor)
    _draw_names(draw, window, scene.belief)
    _draw_line(draw, window, scene.belief.trajectory[:, :2], BLUE, 2)
    if scene.status is not None:
        _draw_line(draw, window, scene.status.path, ORANGE, 3)
    if scene.goal is not None:
        _draw_goal(draw, window, scene.goal.map_from_goal)
    if scene.odom_from_base is not None:
        _draw_robot(draw, window, scene.belief.map_from_odom @ scene.odom_from_base)
    return _captioned(floor, scene, seconds)


def _floor(window: Window, grid: OccupancyGrid | None) -> Image.Image:
    picture = Image.new("RGB", window.size, _unknown)
    if grid is None:
        return picture
    cells = Image.fromarray(grid_colours(grid)[::-1])
    height = grid.occupancy.shape[0] * grid.resolution
    # From pixels of the picture to cells of the grid, both with row 0 at the top.
    step = 1 / (window.scale * grid.resolution)
    left = (window.low[0] - grid.origin[0]) / grid.resolution
    top = (grid.origin[1] + height - window.high[1]) / grid.resolution
    affine = (step, 0.0, left, 0.0, step, top)
    shown = cells.transform(window.size, Image.Transform.AFFINE, affine)
    picture.paste(shown, mask=shown.getchannel("A"))
    return picture


def _guesses(window: Window, belief: MapBelief) -> Image.Image:
    layer = Image.new("RGBA", window.size)
    for index, name in enumerate(belief.classes):
        rows = guessed_rows(belief, index)
        places = window.pixels(belief.position[rows])
        radii = np.clip(belief.extent[rows, :2].mean(axis=1) / 2, 0.15, 1.0) * window.scale
        opacities = guess_opacity(belief, rows)
        for (x, y), radius, opacity in zip(places, radii.tolist(), opacities.tolist(), strict=True):
            # Each disc over the ones before: PIL's own drawing would replace them.
            _blend_disc(layer, (x, y), radius, (*class_colour(name), round(255 * opacity)))
    return layer


def _blend_disc(
    layer: Image.Image, at: tuple[float, float], radius: float, colour: tuple[int, int, int, int]
) -> None:
    size = 2 * math.ceil(radius) + 1
    disc = Image.new("RGBA", (size, size))
    ImageDraw.Draw(disc).ellipse((0, 0, size - 1, size - 1), fill=colour)
    x, y = round(at[0] - size / 2), round(at[1] - size / 2)
    if -size < x < layer.width and -size < y < layer.height:
        layer.alpha_composite(
            disc.crop((max(0, -x), max(0, -y), size, size)), (max(0, x), max(0, y))
        )


def _blend(picture: Image.Image, layer: Image.Image) -> None:
    picture.paste(layer, mask=layer.getchannel("A"))


def _seen(window: Window, belief: MapBelief) -> Image.Image:
    layer = Image.new("RGBA", window.size)
    draw = ImageDraw.Draw(layer)
    for row in seen_rows(belief):
        tint = class_colour(belief.classes[belief.class_index[row]])
        opacity = 255 if seen_opacity(belief, row) > 0.5 else 64
        draw.rectangle(_box(window, belief, row), fill=(*tint, opacity), outline=(*_ink, 255))
    return layer


def _box(window: Window, belief: MapBelief, row: np.intp) -> tuple[float, float, float, float]:
    half = np.maximum(belief.extent[row, :2] / 2, 0.12)
    low, high = window.pixels(belief.position[row] + np.array([[-1, 1], [1, -1]]) * half)
    return (*low, *high)


def _draw_names(draw: ImageDraw.ImageDraw, window: Window, belief: MapBelief) -> None:
    for row in seen_rows(belief):
        _, top, right, _ = _box(window, belief, row)
        name = belief.classes[belief.class_index[row]]
        draw.text((right + 3, top - 4), name, fill=_ink)
    for row in region_rows(belief):
        (at,) = window.pixels(belief.position[[row]])
        draw.text(at, belief.classes[belief.class_index[row]], fill=_ink, anchor="mm")


def _draw_line(
    draw: ImageDraw.ImageDraw,
    window: Window,
    points: Floats,
    colour: tuple[int, int, int],
    width: int,
) -> None:
    if len(points) > 1:
        draw.line(window.pixels(points), fill=colour, width=width, joint="curve")


def _draw_goal(draw: ImageDraw.ImageDraw, window: Window, goal: Pose2) -> None:
    ((x, y),) = window.pixels(np.array([[goal.x, goal.y]]))
    for radius in (9, 4):
        draw.ellipse((x - radius, y - radius, x + radius, y + radius), outline=GREEN, width=2)


def _draw_robot(draw: ImageDraw.ImageDraw, window: Window, at: Pose2) -> None:
    outline = at.apply(np.array([[0.55, 0.0], [-0.35, 0.33], [-0.2, 0.0], [-0.35, -0.33]]))
    draw.polygon(window.pixels(outline), fill=GREY, outline=_ink)


def _captioned(picture: Image.Image, scene: Scene, seconds: float) -> Image.Image:
    whole = Image.new("RGB", (picture.width, picture.height + _caption_px), (255, 255, 255))
    whole.paste(picture)
    draw = ImageDraw.Draw(whole)
    reason = scene.decision.reason if scene.decision else ""
    draw.text((6, picture.height + 3), f"{seconds:5.1f} s  {scene.text}", fill=_ink)
    draw.text((6, picture.height + 17), reason, fill=GREY)
    return whole
