"""The worlds there are: a table of named generators, and files."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from sim.scenes.boxes import (
    make_box_indoor,
    make_box_outdoor,
    make_boxes_indoor,
    make_boxes_outdoor,
)
from sim.scenes.hydrant import make_hydrant, make_two_hydrants
from sim.scenes.model import World, WorldError, load_world
from sim.scenes.object_relative import LAYOUTS, make_object_relative
from sim.scenes.office import make_office, make_office_long, make_office_turned


def _summary(draw: Callable[..., object]) -> str:
    return f"{_first_line(draw)}, and nothing else"


def _first_line(draw: Callable[..., object]) -> str:
    return (draw.__doc__ or "").partition("\n")[0].rstrip(".").lower()


GENERATORS: dict[str, tuple[str, Callable[[int], World]]] = {
    "hydrant": ("a hydrant behind a cone, both out of sight, among street clutter", make_hydrant),
    "two_hydrants": ("as hydrant, with a second hydrant elsewhere", make_two_hydrants),
    **{
        draw.__name__: (_summary(draw), partial(make_object_relative, draw.__name__))
        for draw in LAYOUTS
    },
    **{
        make.__name__.removeprefix("make_"): (_first_line(make), make)
        for make in (
            make_office,
            make_office_turned,
            make_office_long,
            make_box_indoor,
            make_box_outdoor,
            make_boxes_indoor,
            make_boxes_outdoor,
        )
    },
}


def world_names() -> tuple[str, ...]:
    """Names that `make_world` knows."""
    return tuple(GENERATORS)


def world_summaries() -> dict[str, str]:
    """One line about every named world."""
    return {name: summary for name, (summary, _) in GENERATORS.items()}


def make_world(name: str, seed: int) -> World:
    """The world of that name drawn from a seed, or the one in a file if `name` ends in `.json`.

    Raises:
        WorldError: no world has that name, or the file cannot be read; the message says what
            names there are.
    """
    if name in GENERATORS:
        return GENERATORS[name][1](seed)
    if Path(name).suffix == ".json":
        return load_world(Path(name))
    known = ", ".join(GENERATORS)
    raise WorldError(f"no world {name!r}; worlds are: {known}, or a file that ends in .json")
