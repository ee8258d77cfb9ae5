"""A world as data: what stands where, on what ground, under which sun.

Worlds are made from a seed by the generators of `sim.scenes`, saved as JSON and read back
unchanged. Nothing here imports the simulator, so worlds are cheap to list, sample and compare.
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import msgspec
from msgspec import Struct

from schemas.errors import UserError
from schemas.geometry import Pose2

GroundKind = Literal["grass", "asphalt", "dirt", "concrete"]


class Sun(Struct, frozen=True, kw_only=True):
    """Where the light comes from."""

    azimuth: float
    """Direction towards the sun [rad], counter-clockwise from +x."""
    elevation: float
    """Above the horizon [rad]."""
    color: tuple[float, float, float] = (1.15, 1.10, 1.0)
    """Linear intensity of the direct light."""
    ambient: float = 0.42
    """Linear intensity of the sky's light."""


class Ground(Struct, frozen=True, kw_only=True):
    """What the floor looks like."""

    kind: GroundKind
    look: int
    """Seed of the texture."""


class PlacedObject(Struct, frozen=True, kw_only=True):
    """One object of a world."""

    id: str
    """Unique in its world."""
    label: str
    """Class name, a key of `sim.assets.library.MAKERS`."""
    look: int
    """Seed of colours, proportions and textures."""
    world_from_object: Pose2
    scale: float = 1.0
    height: float = 0.0
    """Of its underside above the ground [m]."""


class Wall(Struct, frozen=True, kw_only=True):
    """A straight piece of wall, an upright box from the floor."""

    start: tuple[float, float]
    """Middle of one end [m]."""
    end: tuple[float, float]
    """Middle of the other end [m]."""
    thickness: float = 0.2
    """[m]"""
    height: float = 2.5
    """[m]"""


class Region(Struct, frozen=True, kw_only=True):
    """A place with a name: a room, a hallway."""

    id: str
    """Unique in its world."""
    kind: str
    """Type of place, one of the locations of the robot's symbol space."""
    corners: tuple[tuple[float, float], ...]
    """Of its floor, a convex polygon, counter-clockwise [m]."""

    @property
    def center(self) -> tuple[float, float]:
        """Mean of the corners [m]."""
        xs, ys = zip(*self.corners, strict=True)
        return sum(xs) / len(xs), sum(ys) / len(ys)


class World(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """Everything that is true about one scene before the robot moves."""

    name: str
    seed: int
    ground: Ground
    sun: Sun
    world_from_start: Pose2
    """Base of the robot at time zero."""
    objects: tuple[PlacedObject, ...]
    walls: tuple[Wall, ...] = ()
    regions: tuple[Region, ...] = ()

    def find(self, object_id: str) -> PlacedObject:
        """The object of that id.

        Raises:
            WorldError: there is none; the message lists the ids.
        """
        for placed in self.objects:
            if placed.id == object_id:
                return placed
        ids = ", ".join(placed.id for placed in self.objects)
        raise WorldError(f"no object {object_id!r} in world {self.name!r}; there are: {ids}")

    def region(self, region_id: str) -> Region:
        """The place of that id.

        Raises:
            WorldError: there is none; the message lists the ids.
        """
        for region in self.regions:
            if region.id == region_id:
                return region
        ids = ", ".join(region.id for region in self.regions) or "none"
        raise WorldError(f"no region {region_id!r} in world {self.name!r}; there are: {ids}")


class WorldError(UserError):
    """A world, or an object in one, does not exist or cannot be read."""


def save_world(world: World, path: Path) -> None:
    """Write the world as indented JSON."""
    path.write_bytes(msgspec.json.format(msgspec.json.encode(world)) + b"\n")


def load_world(path: Path) -> World:
    """Read a world that `save_world` or a person wrote.

    Raises:
        WorldError: the file is missing or is not a world; the message names file and field.
    """
    try:
        return msgspec.json.decode(path.read_bytes(), type=World)
    except (OSError, msgspec.DecodeError) as error:
        raise WorldError(f"cannot read a world from {path}: {error}") from error
