"""Draws the factor graph of a sentence as the paper draws its correspondence graphs (sec:nlu).

Every phrase of the tree is a white box λ, its true symbols a coloured box γ above it, and between
them a black square, the factor, which also depends on the symbols of the child phrases.
"""

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from schemas.errors import UserError
from services.grounding.explanation import PhraseReading
from services.grounding.tree import Phrase, Word
from services.grounding.understanding import UNKNOWN, Annotation, Intent, Understanding

FORMATS = ("png", "svg", "pdf")
LINES = 6
"""Symbols written at one phrase; how many more there are is said below them."""
ALTERNATIVES = 5
"""Readings listed of each kind."""

Point = tuple[float, float]

_character, _line = 0.068, 0.137
"""Size of a character of the font [inch]."""
_margin, _gap, _pad = 0.12, 0.15, 0.03
_label_room, _rank_gap, _word_room = 0.4, 0.4, 0.9
"""From symbols down to their phrase, from a phrase to its children's symbols, for words [inch]."""
_dots = 150
"""Per inch."""
_font: dict[str, Any] = {"family": "monospace", "fontsize": 8}
_factor_colour, _word_colour = "black", "0.75"
_paper = {"boxstyle": "round,pad=0.1", "fc": "white", "ec": "white"}
_phrase_box = {"boxstyle": "round,pad=0.25", "fc": "white", "ec": "black"}
_symbol_box = {"boxstyle": "round,pad=0.3", "fc": "#dcebf7", "ec": "#33658a"}


class DrawingError(UserError):
    """The file's suffix names no format that can be drawn."""


@dataclass(frozen=True)
class Box:
    """One phrase with its symbols, or a word; lengths in inches."""

    label: str
    lines: tuple[str, ...]
    """Symbols above the label, none above a word."""
    children: "tuple[Box, ...]"
    is_word: bool = False

    @cached_property
    def width(self) -> float:
        """Room for itself and for everything below it."""
        own = _character * max(len(line) for line in (self.label, *self.lines)) + _gap + _margin
        return max(own, sum(child.width for child in self.children))

    def ranks(self) -> list[float]:
        """Height of the symbols of each rank of phrases, this one's first."""
        below = [child.ranks() for child in self.children if not child.is_word]
        deepest = max((len(ranks) for ranks in below), default=0)
        tallest = [max(r[at] for r in below if len(r) > at) for at in range(deepest)]
        return [_line * len(self.lines) + _margin, *tallest]


def draw(understanding: Understanding, readings: Sequence[PhraseReading], path: Path) -> None:
    """Writes the picture of a sentence.

    Args:
        understanding: whose readings are listed below the graph.
        readings: of every phrase of the best tree, parents first; none for a refused text.
        path: where to; the suffix says the format.

    Raises:
        DrawingError: the suffix is none of `FORMATS`.
    """
    check_format(path)
    notes = _notes(understanding)
    below = _line * (len(notes) + 1)
    width = _character * max(len(line) for line in notes) + 2 * _margin
    if readings:
        root = _box(readings[0].phrase, iter(readings))
        ranks = root.ranks()
        width = max(width, root.width + 2 * _margin)
        height = below + _word_room + sum(ranks) + len(ranks) * (_rank_gap + _label_room)
        figure, axes = _page(width, height)
        _draw_phrase(axes, root, 0.5 * (width - root.width), _levels(height, ranks), below)
    else:
        figure, axes = _page(width, below)
    _write(axes, (_margin, below - _line), "\n".join(notes), ha="left", va="top")
    path.parent.mkdir(parents=True, exist_ok=True)
    with warnings.catch_warnings():
        # Letters that the font lacks are drawn as boxes; that is answer enough.
        warnings.filterwarnings("ignore", message="Glyph .* missing from font")
        figure.savefig(path, dpi=_dots)


def check_format(path: Path) -> None:
    """Raises `DrawingError` if the suffix of a file names no format that can be drawn."""
    if path.suffix.lstrip(".").lower() not in FORMATS:
        raise DrawingError(f"cannot draw {path.name!r}; allowed suffixes: {', '.join(FORMATS)}")


def _page(width: float, height: float) -> tuple[Figure, Axes]:
    figure = Figure(figsize=(width, height))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(0.0, width), ylim=(0.0, height))
    axes.axis("off")
    return figure, axes


def _notes(understanding: Understanding) -> list[str]:
    """The readings of the whole sentence and what else there is to say, line by line."""
    lines = [f"“{_shortened(understanding.text)}”"]
    if understanding.parse:
        partial = ", fragments only" if understanding.partial else ""
        lines.append(f"parse {understanding.parse_probability:.3f}{partial}")
    lines += ["", "annotations", *map(_said, understanding.annotations[:ALTERNATIVES])]
    lines += ["", "behaviors", *map(_asked, understanding.intents[:ALTERNATIVES])]
    lines.append(f"  {understanding.statement_mass:.3f}  nothing is to be done")
    lines.append(f"  {understanding.other_mass:.3f}  readings left out")
    if understanding.unknown_words:
        lines += ["", f"unknown words: {', '.join(understanding.unknown_words)}"]
    if understanding.question:
        lines += ["", understanding.question]
    return [_printable(line) for line in lines]


def _shortened(text: str) -> str:
    return text if len(text) <= 100 else f"{text[:99]}…"


def _printable(text: str) -> str:
    """What a font can show; a dollar sign would begin a formula."""
    shown = "".join(letter if letter.isprintable() else "�" for letter in text)
    return shown.replace("$", r"\$")


def _said(one: Annotation) -> str:
    facts = [f"{relation}({figure}, {mark})" for relation, figure, mark in one.relations]
    return f"  {one.probability:.3f}  {', '.join([*one.objects, *facts]) or 'nothing'}"


def _asked(one: Intent) -> str:
    place = "" if one.relation == UNKNOWN else f", {one.relation} {one.landmark}"
    nearest = ", comparative" if one.comparative else ""
    mode = "" if one.mode == UNKNOWN else f", {one.mode}"
    return f"  {one.probability:.3f}  {one.action}({one.object}){place}{nearest}{mode}"


def _symbol_lines(reading: PhraseReading) -> list[str]:
    shown = [f"{p:.2f} {name}" for name, p in reading.symbols[:LINES]]
    more = len(reading.symbols) - LINES
    return [*shown, f"and {more} more"] if more > 0 else shown or ["nothing true"]


def _box(node: Phrase, readings: Iterator[PhraseReading]) -> Box:
    lines = _symbol_lines(next(readings))
    children = tuple(
        Box(_printable(child.surface), (), (), is_word=True)
        if isinstance(child, Word)
        else _box(child, readings)
        for child in node.children
    )
    return Box(node.label, tuple(lines), children)


def _levels(height: float, ranks: Sequence[float]) -> list[float]:
    """Lower edge of the symbols of each rank [inch]."""
    levels: list[float] = []
    for rank in ranks:
        height -= _rank_gap + rank
        levels.append(height)
        height -= _label_room
    return levels


def _draw_phrase(
    axes: Axes, box: Box, left: float, levels: Sequence[float], words: float
) -> tuple[float, float]:
    """Draws a phrase and what is below it; returns the upper middle of its symbols."""
    x, y = left + 0.5 * box.width, levels[0]
    factor, label = (x, y - 0.5 * _label_room), (x, y - _label_room)
    _connect(axes, (x, y), label, _factor_colour)
    left += 0.5 * (box.width - sum(child.width for child in box.children))
    for child in box.children:
        if child.is_word:
            middle = (left + 0.5 * child.width, words + 0.5 * _word_room)
            _connect(axes, label, middle, _word_colour)
            _write(axes, middle, child.label, bbox=_paper, style="italic")
        else:
            _connect(
                axes, factor, _draw_phrase(axes, child, left, levels[1:], words), _factor_colour
            )
        left += child.width
    axes.plot(*factor, "ks", markersize=6, zorder=3)
    _write(axes, label, box.label, bbox=_phrase_box)
    _write(axes, (x, y), "\n".join(box.lines), va="bottom", bbox=_symbol_box)
    return x, y + _line * len(box.lines) + _pad


def _connect(axes: Axes, start: Point, end: Point, colour: str) -> None:
    axes.plot([start[0], end[0]], [start[1], end[1]], color=colour, linewidth=0.8, zorder=1)


def _write(axes: Axes, at: Point, text: str, **style: Any) -> None:
    style = {"ha": "center", "va": "center", "zorder": 4, **_font, **style}
    axes.text(at[0], at[1], text, None, **style)
