"""The table of furniture and how its looks are drawn."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.random import Generator

from sim.assets import furniture_kitchen as kitchen
from sim.assets import furniture_lab as lab
from sim.assets import furniture_lounge as lounge
from sim.assets import furniture_office as office
from sim.assets import furniture_table as table
from sim.assets import furniture_transit as transit
from sim.assets.asset import Asset

FURNITURE: dict[str, Callable[[Generator], Asset]] = {
    "counter": kitchen.make_counter,
    "fridge": kitchen.make_fridge,
    "kitchen table": kitchen.make_kitchen_table,
    "desk": office.make_desk,
    "office chair": office.make_office_chair,
    "bookshelf": office.make_bookshelf,
    "cabinet": office.make_cabinet,
    "whiteboard": office.make_whiteboard,
    "plant": office.make_plant,
    "waste bin": office.make_waste_bin,
    "lab bench": lab.make_lab_bench,
    "fume hood": lab.make_fume_hood,
    "stool": lab.make_stool,
    "gas bottle": lab.make_gas_bottle,
    "rack": lab.make_rack,
    "sofa": lounge.make_sofa,
    "armchair": lounge.make_armchair,
    "low table": lounge.make_low_table,
    "lamp": lounge.make_lamp,
    "television": lounge.make_television,
    "painting": lounge.make_painting,
    "conference table": table.make_conference_table,
    "cafeteria table": table.make_cafeteria_table,
    "wall screen": table.make_wall_screen,
    "serving counter": table.make_serving_counter,
    "vending machine": table.make_vending_machine,
    "menu board": table.make_menu_board,
    "closed door": transit.make_closed_door,
    "notice board": transit.make_notice_board,
    "extinguisher": transit.make_extinguisher,
    "exit sign": transit.make_exit_sign,
    "bench seat": transit.make_bench_seat,
    "water cooler": transit.make_water_cooler,
    "lift doors": transit.make_lift_doors,
    "cabin wall": transit.make_cabin_wall,
    "ash stand": transit.make_ash_stand,
}
"""Furniture stands on z = 0 around the origin with its front along +x. What hangs on a wall has its
own height."""


class UnknownFurnitureError(ValueError):
    """There is no maker for the piece that was asked for."""


@lru_cache(maxsize=256)
def make_furniture(label: str, look: int) -> Asset:
    """The piece whose looks are drawn from a seed; the same label and seed give the same arrays.

    Raises:
        UnknownFurnitureError: no piece has that name; the message lists those there are.
    """
    if label not in FURNITURE:
        raise UnknownFurnitureError(f"no furniture {label!r}; there is: {', '.join(FURNITURE)}")
    return FURNITURE[label](np.random.default_rng([look, *label.encode()]))
