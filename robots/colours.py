"""Colours by class: Okabe and Ito's, which colour-blind eyes tell apart."""

import zlib

Rgb = tuple[int, int, int]

ORANGE: Rgb = (230, 159, 0)
SKY: Rgb = (86, 180, 233)
GREEN: Rgb = (0, 158, 115)
BLUE: Rgb = (0, 114, 178)
VERMILLION: Rgb = (213, 94, 0)
PURPLE: Rgb = (204, 121, 167)
GREY: Rgb = (110, 116, 128)

_of_class: dict[str, Rgb] = {
    "hydrant": VERMILLION,
    "cone": ORANGE,
    "barrel": BLUE,
    "tree": GREEN,
    "car": PURPLE,
    "building": SKY,
    "wall": GREY,
    "robot": GREY,
    "unknown": GREY,
}
_cycle = (ORANGE, SKY, GREEN, BLUE, VERMILLION, PURPLE)


def class_colour(name: str) -> Rgb:
    """Colour of an object class; the same on every page, in every log and in every run."""
    return _of_class.get(name) or _cycle[zlib.crc32(name.encode()) % len(_cycle)]
