"""Which tag hangs in which place: a table that a person writes, or numbers in the robot's order."""

from pathlib import Path

import msgspec
from msgspec import Struct

from robots.spec import RobotSpec
from schemas.errors import UserError
from schemas.run import RunConfig

FAMILY = "36h11"
"""Of AprilTags; its numbers run from 0 to 586."""
TAGS = 587


class TagPlace(Struct, frozen=True, kw_only=True):
    """What one tag says."""

    place: str
    """Type of place, one of the locations of the robot's language."""
    before_m: float = 0.5
    """The place lies this far in front of the tag [m]; behind it, on the other side of the wall,
    if negative."""


class TagTable(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Size and meaning of all tags."""

    tags: dict[int, TagPlace]
    """By number; tags that are not listed have a place in space and say nothing of its type."""
    side_m: float = 0.30
    """Of the black square [m]."""
    error_rate: float = 0.03
    """Probability that a tag that is read hangs in another type of place than the table says."""


class TagTableError(UserError):
    """A table of tags cannot be used; the message says what in it, and what is allowed."""


def tag_table(run: RunConfig, robot: RobotSpec) -> TagTable:
    """The table of a run.

    Raises:
        TagTableError: the file is missing, malformed, or names places that the robot has no word
            for.
    """
    if run.tags:
        return read_tags(Path(run.tags), place_types(robot))
    places = enumerate(place_types(robot))
    return TagTable(tags={number: TagPlace(place=name) for number, name in places})


def place_types(robot: RobotSpec) -> tuple[str, ...]:
    """Types of places that a robot has words for; a "generic" place looks like nothing."""
    return tuple(name for name in robot.symbols.locations if name != "generic")


def read_tags(path: Path, types: tuple[str, ...]) -> TagTable:
    """Read a table and check it.

    Raises:
        TagTableError: see `tag_table`.
    """
    try:
        table = msgspec.json.decode(path.read_bytes(), type=TagTable)
    except (OSError, msgspec.DecodeError) as error:
        raise TagTableError(
            f"cannot read a table of tags from {path}: {error}; "
            'an example: {"side_m": 0.3, "tags": {"0": {"place": "kitchen"}}}'
        ) from error
    if wrong := _flaw(table, types):
        raise TagTableError(f"{path}: {wrong}")
    return table


def _flaw(table: TagTable, types: tuple[str, ...]) -> str:
    if table.side_m <= 0:
        return f"side_m is {table.side_m:g}; a tag's side is more than 0 m"
    if not 0 < table.error_rate < 1:
        return f"error_rate is {table.error_rate:g}; it lies between 0 and 1"
    for number, tag in table.tags.items():
        if not 0 <= number < TAGS:
            return f"tag {number}; tags of {FAMILY} are 0 to {TAGS - 1}"
        if tag.place not in types:
            known = ", ".join(types) or "none"
            return f"tag {number} names {tag.place!r}; places of this robot are: {known}"
    return ""
