"""What each robot's language ranges over (paper, Sec. Experiments)."""

from dataclasses import dataclass

from schemas.errors import UserError


@dataclass(frozen=True)
class SymbolSpace:
    """The sets of Eqs. annotation-symbol-space and experiments-behavior-inference-space.

    "unknown" stands for what the robot has no name for, or for what was left open; "robot" is the
    robot itself, the landmark of "on the left".
    """

    object_classes: tuple[str, ...]
    locations: tuple[str, ...]
    relations: tuple[str, ...]
    actions: tuple[str, ...]
    modes: tuple[str, ...]
    containers: tuple[str, ...] = ()
    """Classes of things that others may lie in, where only a look from above shows them."""
    hierarchical: bool = False
    """Whether a first pass prunes the symbols (HDCG), as the paper does for the wheelchair."""


_outdoor = ("unknown", "robot", "cone", "tree", "car", "building", "hydrant", "wall", "barrel")
_sides = ("unknown", "near", "away", "front", "back", "left", "right")
_modes = ("safely", "quickly", "unknown")

SYMBOL_SPACES: dict[str, SymbolSpace] = {
    "husky": SymbolSpace(
        object_classes=_outdoor,
        locations=(),
        relations=_sides,
        actions=("unknown", "navigate"),
        modes=_modes,
    ),
    "wheelchair": SymbolSpace(
        object_classes=_outdoor,
        locations=(
            "generic",
            "kitchen",
            "office",
            "hallway",
            "lab",
            "lounge",
            "elevator",
            "conference room",
            "cafeteria",
        ),
        relations=(*_sides, "down", "through", "towards", "past", "around"),
        actions=("unknown", "navigate", "left", "right"),
        modes=_modes,
        hierarchical=True,
    ),
    "husky_ur5": SymbolSpace(
        object_classes=(
            "unknown",
            "robot",
            "drill",
            "suitcase",
            "banana",
            "pitcher",
            "cracker box",
            "mustard bottle",
            "ball",
            "box",
            "cone",
        ),
        locations=("lab", "hallway", "office"),
        relations=("unknown", "inside", "behind", "left", "right", "front", "back", "near"),
        actions=("unknown", "pick", "retrieve", "navigate"),
        modes=("unknown",),
        containers=("box",),
    ),
}


class UnknownLanguageError(UserError):
    """No robot of that name has words; the message lists those that have."""


def get_symbols(robot: str) -> SymbolSpace:
    """Look up what a robot's language ranges over.

    Raises:
        UnknownLanguageError: the name is not in `SYMBOL_SPACES`.
    """
    if robot not in SYMBOL_SPACES:
        known = ", ".join(SYMBOL_SPACES)
        raise UnknownLanguageError(f"unknown robot {robot!r}; robots with words are: {known}")
    return SYMBOL_SPACES[robot]
