"""What the instruction may mean: pairs of figure and landmark with their probabilities.

The belief says what may be where, the behaviours say which of it is meant (Eq. basic-1). Both
meet here, and everything after this module sees one weighted list, whoever made it.
"""

from dataclasses import dataclass, replace

import numpy as np

from schemas.arrays import Flags, Floats, Ints
from schemas.belief import MapBelief, first_topology
from schemas.language import Behaviors

_seen_above = 0.5
"""Existence below which a detection is too doubtful to count as seen."""
same_place = 2.5
"""Middles of places nearer to each other than this are those of one place [m]."""
_negligible = 1e-6
_nearest_m = 4.0
"""Goals nearer than this to the start of the search are as good as seen at once [m]."""
_contradiction = 0.05
"""Credit of behaviours that contradict the hypothesis they were inferred in.

A hypothesis says itself which of its objects the utterance means. Behaviour inference looks at the
objects alone, and keeps mass on other pairs and on "none" however well one pair fits.
"""


@dataclass(frozen=True)
class Referents:
    """M readings of the instruction as columns; one of them may be "nothing on any map fits"."""

    probability: Floats
    """(M,) Sums to one."""
    known: Flags
    """(M,) False for the reading that nothing fits: its other columns mean nothing."""
    figure: Floats
    """(M, 2) Where the thing that is meant stands, map frame [m]."""
    figure_id: Ints
    """(M,)"""
    figure_seen: Flags
    """(M,) Seen, not only hypothesised."""
    figure_existence: Floats
    """(M,)"""
    figure_size: Floats
    """(M,) Its mean width [m]."""
    figure_away: Floats
    """(M,) From where the instruction was given [m]."""
    landmark: Floats
    """(M, 2) Map frame [m]; the figure's place where there is no landmark."""
    landmark_seen: Flags
    """(M,) True also where there is none: nothing is left to see."""
    landmark_existence: Floats
    """(M,)"""
    landmark_id: Ints
    """(M,) -1 where there is none."""

    @property
    def found(self) -> Flags:
        """(M,) Whether everything the reading speaks of was seen."""
        return self.known & self.figure_seen & self.landmark_seen

    @property
    def stake(self) -> Floats:
        """(M,) What a metre counts for in each reading: 1 on average, less where the goal is far.

        With it an expected way is one in multiples of the shortest, of which the paths' efficiency
        (SPL, Anderson et al., 2018) is the inverse: detours count for more the nearer the goal is.
        """
        inverse = 1 / np.maximum(self.figure_away, _nearest_m)
        share = self.probability * self.known
        mean = float(share @ inverse) / max(float(share.sum()), _negligible)
        return np.where(self.known, inverse / max(mean, _negligible), 1.0)


def mass_of(referents: Referents, object_id: int) -> float:
    """Posterior mass that a seen object is meant and that all the reading speaks of was seen."""
    return float(referents.probability[referents.found & (referents.figure_id == object_id)].sum())


def best_found(referents: Referents) -> int:
    """Seen object with the largest `mass_of`, -1 where nothing is found."""
    ids = seen_figures(referents)
    masses = [mass_of(referents, object_id) for object_id in ids]
    return ids[int(np.argmax(masses))] if ids else -1


def place_of(referents: Referents, object_id: int) -> Floats:
    """Where a seen object that may be meant stands (2,), map frame [m]."""
    rows = referents.known & referents.figure_seen & (referents.figure_id == object_id)
    return referents.figure[np.flatnonzero(rows)[0]]


def seen_figures(referents: Referents) -> list[int]:
    """Ids of the seen objects that may be meant, ascending."""
    return np.unique(referents.figure_id[referents.known & referents.figure_seen]).tolist()


def at_their_boxes(referents: Referents) -> Referents:
    """The same readings where things that lie in others are looked for at those.

    Nobody sees what is in a box from afar: to go for it is to go for the box. A box that was seen
    takes the place of what it may hold.
    """
    hidden = referents.known & ~referents.figure_seen & (referents.landmark_id >= 0)
    in_seen = hidden & referents.landmark_seen
    return replace(
        referents,
        figure=np.where(hidden[:, None], referents.landmark, referents.figure),
        figure_id=np.where(in_seen, referents.landmark_id, referents.figure_id),
        figure_seen=referents.figure_seen | in_seen,
        figure_existence=np.where(hidden, referents.landmark_existence, referents.figure_existence),
    )


def from_behaviors(belief: MapBelief, behaviors: Behaviors) -> Referents:
    """Readings from the behaviours inferred in this belief, one for each of their rows.

    Raises:
        ValueError: the behaviours belong to another belief.
    """
    if behaviors.stamp_ns != belief.stamp_ns:
        raise ValueError(
            f"behaviours of the belief at {behaviors.stamp_ns} ns do not go with the belief "
            f"at {belief.stamp_ns} ns"
        )
    probability = belief.weights[behaviors.particle] * _credible(belief, behaviors)
    return _readings(belief, behaviors.particle, behaviors.node, behaviors.landmark, probability)


def _credible(belief: MapBelief, behaviors: Behaviors) -> Floats:
    """Probabilities (M,) of the rows after what contradicts their hypothesis was discounted."""
    meant = _meant(belief, behaviors)
    particle, count = behaviors.particle, len(belief.weights)
    contradicts = (meant[particle] >= 0) & (behaviors.node != meant[particle])
    odds = behaviors.probability * np.where(contradicts, _contradiction, 1.0)
    nothing = behaviors.nothing_fits * np.where(meant >= 0, _contradiction, 1.0)
    total = np.bincount(particle, odds, minlength=count) + nothing
    return odds / np.maximum(total[particle], _negligible)


def _meant(belief: MapBelief, behaviors: Behaviors) -> Ints:
    """Object (P,) that each hypothesis itself takes for the figure, -1 where it does not say.

    Words without a relation are met by any object of the class. The one seen first is taken, so
    that another one, seen or imagined, is no reason to doubt it.
    """
    same = belief.instruction_id == behaviors.instruction_id
    meant = np.where(same, belief.figure, np.int32(-1))
    if behaviors.relation != "unknown":
        return meant
    never = np.iinfo(np.int32).max
    first = np.full(len(meant), never, np.int32)
    is_seen = np.isin(behaviors.node, belief.node[_seen(belief)])
    np.minimum.at(first, behaviors.particle[is_seen], behaviors.node[is_seen])
    return np.where(first < never, first, meant)


def from_figures(belief: MapBelief) -> Referents:
    """Readings from what the filter grounded the utterance to, one for each particle."""
    particles = np.arange(len(belief.weights), dtype=np.int32)
    return _readings(belief, particles, belief.figure, belief.landmark, belief.weights)


def _readings(
    belief: MapBelief, particle: Ints, figure: Ints, landmark: Ints, probability: Floats
) -> Referents:
    figure_row = belief.row_of(particle, figure)
    kept = (figure_row >= 0) & (probability > _negligible)
    figure_row, probability = figure_row[kept], probability[kept]
    figure_row = _one_row_a_place(belief, figure_row, probability)
    landmark_row = belief.row_of(particle[kept], landmark[kept])
    has_landmark = landmark_row >= 0
    # Where there is no landmark its columns repeat the figure, as something that was found.
    landmark_row = np.where(has_landmark, landmark_row, figure_row)
    seen, start = _seen(belief), (belief.viewer.x, belief.viewer.y)
    return _with_nothing(
        Referents(
            probability=probability,
            known=np.ones(len(probability), bool),
            figure=belief.position[figure_row],
            figure_id=belief.node[figure_row],
            figure_seen=seen[figure_row],
            figure_existence=belief.existence[figure_row],
            figure_size=belief.extent[figure_row, :2].mean(axis=1),
            figure_away=np.hypot(*(belief.position[figure_row] - start).T),
            landmark=belief.position[landmark_row],
            landmark_seen=seen[landmark_row] | ~has_landmark,
            landmark_existence=belief.existence[landmark_row],
            landmark_id=np.where(has_landmark, belief.node[landmark_row], np.int32(-1)),
        )
    )


def _one_row_a_place(belief: MapBelief, rows: Ints, probability: Floats) -> Ints:
    """Figures (M,) by row, where one place is one row.

    Hypotheses that divide the ground in other ways have other names for about the same place.
    """
    merged = rows.copy()
    left = belief.particle[rows] <= first_topology
    if left.any():
        left = belief.seen[rows]
    while left.any():
        mass = np.bincount(rows[left], probability[left])
        anchor = int(np.argmax(mass))
        gaps = np.hypot(*(belief.position[rows] - belief.position[anchor]).T)
        alike = left & (gaps < same_place)
        merged[alike], left = anchor, left & ~alike
    return merged


def _with_nothing(readings: Referents) -> Referents:
    """Add the reading that nothing fits, with the probability that the others leave."""
    left = max(0.0, 1.0 - float(readings.probability.sum()))
    probability = np.append(readings.probability, left)
    return Referents(
        probability=probability / probability.sum(),
        known=np.append(readings.known, False),
        figure=np.concatenate([readings.figure, np.zeros((1, 2))]),
        figure_id=np.append(readings.figure_id, np.int32(-1)),
        figure_seen=np.append(readings.figure_seen, False),
        figure_existence=np.append(readings.figure_existence, 0.0),
        figure_size=np.append(readings.figure_size, 0.0),
        figure_away=np.append(readings.figure_away, 0.0),
        landmark=np.concatenate([readings.landmark, np.zeros((1, 2))]),
        landmark_seen=np.append(readings.landmark_seen, False),
        landmark_existence=np.append(readings.landmark_existence, 0.0),
        landmark_id=np.append(readings.landmark_id, np.int32(-1)),
    )


def _seen(belief: MapBelief) -> Flags:
    return belief.seen & (belief.existence >= _seen_above)
