"""The belief as things to draw: all hypotheses, what was seen, where the figure may be."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from schemas.arrays import Flags, Floats
from schemas.belief import MapBelief
from schemas.task import Decision
from web.shapes import Instances

Rows = NDArray[np.intp]
"""Row numbers of a belief."""

_drawn_per_class = 100
_faintest, _strongest = 0.05, 0.5
_shown_from_existence = 0.2
_mode_radius = 2.0
_modes_shown = 4
_smallest_mode = 0.03
_same_place = 3.0
_solid_from = 3.0
"""Times the mean weight from which a guess is drawn as solid as guesses get."""


@dataclass(frozen=True)
class SeenObject:
    """An object that was observed, and so stands in every hypothesis."""

    node: int
    name: str
    probability: float
    """Of the class."""
    center: Floats
    """(3,) map frame [m]"""
    extent: Floats
    """(3,) [m]"""


@dataclass(frozen=True)
class Mode:
    """One place where the thing that was meant may be."""

    name: str
    mass: float
    """Summed weight of the hypotheses that put it here."""
    mean: Floats
    """(2,) map frame [m]"""
    place: Floats
    """Of the heaviest object in it (2,), map frame [m]."""
    covariance: Floats
    """Spread over the hypotheses (2, 2) [m^2]."""
    extent: Floats
    """(3,) [m]"""
    seen: bool
    """Whether it is (mostly) an observed object."""


@dataclass(frozen=True)
class GoalObject:
    """What the robot is after, as far as it knows."""

    mode: Mode
    position: Floats
    """(2,) map frame [m]"""


def hypothesised(belief: MapBelief) -> dict[str, Instances]:
    """Guessed objects by class; of very many the heaviest."""
    rows = np.flatnonzero(belief.particle >= 0)
    mass = belief.weights[belief.particle[rows]] * belief.existence[rows]
    strongest = mass.max(initial=0.0)
    if strongest <= 0:
        return {}
    reference = max(strongest, _solid_from / len(belief.weights))
    opacity = _faintest + (_strongest - _faintest) * mass / reference
    found: dict[str, Instances] = {}
    for index in np.unique(belief.class_index[rows]):
        chosen = np.flatnonzero(belief.class_index[rows] == index)
        heaviest = np.argsort(-mass[chosen], kind="stable")[:_drawn_per_class]
        chosen = chosen[np.sort(heaviest)]
        at = rows[chosen]
        found[belief.classes[index]] = Instances(
            _centers(belief, at), belief.extent[at], opacity[chosen]
        )
    return found


def observed(belief: MapBelief) -> list[SeenObject]:
    """Objects that were seen and are more than a passing error of the detector."""
    seen = belief.seen & (belief.existence >= _shown_from_existence)
    rows = np.flatnonzero(seen)
    centers = _centers(belief, rows)
    return [
        SeenObject(
            node=int(belief.node[row]),
            name=belief.classes[belief.class_index[row]],
            probability=float(belief.class_probability[row]),
            center=center,
            extent=belief.extent[row],
        )
        for row, center in zip(rows, centers, strict=True)
    ]


def figure_rows(belief: MapBelief) -> tuple[Rows, Floats]:
    """Rows of the objects that the utterance's figure is grounded to, and the mass of each.

    A seen object gathers the weights of all hypotheses that mean it. The masses sum to the share
    of the hypotheses in which the figure is some object.
    """
    mass = np.zeros(len(belief.particle))
    figure = belief.row_of(np.arange(len(belief.weights), dtype=np.int32), belief.figure)
    np.add.at(mass, figure[figure >= 0], belief.weights[figure >= 0])
    rows = np.flatnonzero(mass > 0)
    return rows, mass[rows]


def modes(belief: MapBelief) -> list[Mode]:
    """Where the figure may be, heaviest place first; the masses sum to at most one."""
    rows, mass = figure_rows(belief)
    found: list[Mode] = []
    left = np.ones(len(rows), np.bool_)
    while left.any() and len(found) < _modes_shown:
        members = left & _around_densest(belief.position[rows], np.where(left, mass, 0.0))
        left &= ~members
        found.append(_mode(belief, rows[members], mass[members]))
    found = [mode for mode in found if mode.mass >= _smallest_mode]
    return sorted(found, key=lambda mode: -mode.mass)


def goal_object(belief: MapBelief, decision: Decision) -> GoalObject | None:
    """The object that the chosen candidate is about; None for ground that is to be explored."""
    found, kind = modes(belief), decision.kinds[decision.chosen]
    if not found or kind == "frontier":
        return None
    if kind == "stop":
        return GoalObject(found[0], found[0].place)
    target = decision.positions[decision.chosen]
    mode = min(found, key=lambda mode: float(np.hypot(*(mode.mean - target))))
    if np.hypot(*(mode.mean - target)) > _same_place:
        return None
    return GoalObject(mode, mode.place if mode.seen else target)


def _centers(belief: MapBelief, rows: Rows) -> Floats:
    """Objects stand on the ground: the centre is half their height above it."""
    return np.column_stack([belief.position[rows], belief.extent[rows, 2] / 2])


def _around_densest(points: Floats, mass: Floats) -> Flags:
    """Points within a mode's radius of the one with most mass around it."""
    squared = ((points[:, None] - points[None]) ** 2).sum(-1)
    density = np.exp(-squared / (2 * (_mode_radius / 2) ** 2)) @ mass
    center = int(np.argmax(np.where(mass > 0, density, -1.0)))
    return squared[center] <= _mode_radius**2


def _mode(belief: MapBelief, rows: Rows, mass: Floats) -> Mode:
    share = mass / mass.sum()
    points = belief.position[rows]
    mean = share @ points
    spread = (points - mean).T @ ((points - mean) * share[:, None])
    inner = np.einsum("n,nij->ij", share, belief.covariance[rows])
    heaviest = rows[int(np.argmax(mass))]
    return Mode(
        name=belief.classes[belief.class_index[heaviest]],
        mass=float(mass.sum()),
        mean=mean,
        place=belief.position[heaviest],
        covariance=spread + inner,
        extent=belief.extent[heaviest],
        seen=bool(belief.seen[heaviest]),
    )
