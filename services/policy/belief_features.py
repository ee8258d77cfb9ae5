r"""Features of the belief: moments of per-hypothesis features (Eq. policy-decomposition).

The data contract, for C candidates, M readings of the instruction and D features:

    referents                      candidates                    terrain, travel, view
      probability  f8 (M,) sum 1     pose       f8 (C, 3)          map-level, without hypotheses
      figure       f8 (M, 2) ...     object_id  i4 (C,)  ...
            \                            |                               /
             phi(x, a, S_i)        f8 (C, M, D)       one row of `names` each, all >= 0
                                         |
             F = [Phi_1 ... Phi_K]  f8 (C, K, D)       k = 1: weighted mean
                                                       k > 1: k-th central moment
                                         |
             cost = f(W, F)         f8 (C,)            services/policy/cost.py

`names`, in order along D:

    length              way to drive [m]
    turn                at the start of the way and at its end [rad]
    see_figure          probability to see the figure, given that it is not seen yet
    see_either          likewise, figure or landmark
    new_area            ground that is looked at for the first time, as a share of one full view
    new_area_nothing    the same where nothing on the map fits, else 0
    reach               1 when the candidate leads to (or stops at) the figure, which was seen
    reach_found         1 when moreover the landmark was seen, or there is none
    is_stop             1 for stop
    here                1 when the robot stands at the candidate's seen thing
    tried               how often the robot looked from there before
    way                 to the goal, if the candidate is taken first [m], see `search`, and what
                        a metre of it is worth, see `Referents.stake`
    see_rate            see_either for each metre of way
    figure_gap          from the end of the way to the figure [m]
    figure_nearer       by how much that is less than from its start [m]
    figure_detour       longer than straight to the figure, if the candidate is taken first [m]
    figure_size         mean width of the figure [m]
    landmark_gap        as for the figure
    landmark_nearer     as for the figure
    stop_found          1 for stop at the figure, where the landmark was seen, or there is none
    stop_imagined       1 for stop at the figure, where the landmark is only imagined
    stop_doubt_90       by how much the mass of stop_found falls short of 0.9
    stop_doubt_60       likewise of 0.6

The first four of the path and all of figure and landmark are those of Duvallet et al. (2013): the
shape of the path, the geometry of the landmark, and the relation of the two.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from schemas.arrays import Floats
from services.policy.candidates import Candidates, Kind
from services.policy.referents import Referents
from services.policy.search import way_to_goal
from services.policy.sight import distances
from services.policy.terrain import Terrain
from services.policy.travel import Travel
from services.policy.view import FieldOfView

names = (
    "length",
    "turn",
    "see_figure",
    "see_either",
    "new_area",
    "new_area_nothing",
    "reach",
    "reach_found",
    "is_stop",
    "here",
    "tried",
    "way",
    "see_rate",
    "figure_gap",
    "figure_nearer",
    "figure_detour",
    "figure_size",
    "landmark_gap",
    "landmark_nearer",
    "stop_found",
    "stop_imagined",
    "stop_doubt_90",
    "stop_doubt_60",
)
_area_step = 0.8
"""New ground is measured on blocks so far apart, which is fine enough for an area [m]."""
_same_place, _same_heading = 1.0, 0.4
"""Looks this alike show the same [m], [rad]."""
_visited_within = 2.5
"""A pose this near a seen thing was a visit to it [m]."""
_on_the_way = (0.33, 0.66)
"""Shares of a straight way at which the robot looks ahead."""
_start_m = 2.0
"""Added to every way where a rate is meant: stopping and looking take time too [m]."""
_inside_shown = 0.95
"""Probability that a look into a thing shows what lies in it."""
_detour = 1.2
"""Beyond this share of the straight line the way is not straight."""


@dataclass(frozen=True)
class Situation:
    """All that does not depend on the hypothesis or the candidate."""

    pose: Floats
    """(3,) x, y, yaw of the base, map frame."""
    terrain: Terrain
    travel: Travel
    view: FieldOfView
    tried: Floats
    """(T, 3) Poses from which the robot looked on purpose, map frame."""


def belief_features(
    situation: Situation,
    candidates: Candidates,
    here: Floats,
    referents: Referents,
    moments: int,
) -> Floats:
    """F, shape (C, K, D).

    Args:
        situation: pose, terrain, travel and view.
        candidates: C of them.
        here: (C,) 1 where the robot stands at the candidate's seen thing.
        referents: M readings.
        moments: K.
    """
    phi = features(situation, candidates, here, referents)
    return moments_of(phi, referents.probability, moments)


def moments_of(phi: Floats, probability: Floats, moments: int) -> Floats:
    """Mean and central moments of (C, M, D) over the readings (M,): shape (C, K, D)."""
    mean = np.einsum("m,cmd->cd", probability, phi)
    central = phi - mean[:, None]
    rest = [np.einsum("m,cmd->cd", probability, central**k) for k in range(2, moments + 1)]
    return np.stack([mean, *rest], axis=1)


def features(
    situation: Situation, candidates: Candidates, here: Floats, referents: Referents
) -> Floats:
    """phi(x, a, S_i) of every candidate and reading, shape (C, M, D)."""
    see_figure, see_landmark = _sightings(situation, candidates, referents)
    stop = np.array([kind is Kind.STOP for kind in candidates.kinds], np.float64)
    area = _new_area(situation, candidates) * (1 - stop)
    reach = (candidates.object_id[:, None] == referents.figure_id) & referents.figure_seen
    inside = np.array([kind is Kind.INSIDE for kind in candidates.kinds])
    see_figure = np.maximum(see_figure, _inside_shown * (reach & inside[:, None]))
    length = situation.travel.to(candidates.pose[:, :2])
    way = way_to_goal(
        situation.pose, length, candidates, referents, situation.view, situation.terrain
    )
    see_either = 1 - (1 - see_figure) * (1 - see_landmark)
    move = (1 - stop)[:, None]
    stop_found = stop[:, None] * here[:, None] * (reach & referents.found)
    stop_mass = (stop_found @ referents.probability)[:, None]
    columns = (
        length[:, None],
        _turn(situation.pose, candidates.pose)[:, None],
        see_figure,
        see_either,
        area[:, None],
        area[:, None] * ~referents.known,
        reach & referents.known,
        reach & referents.found,
        stop[:, None],
        here[:, None],
        _times_tried(situation.tried, candidates)[:, None],
        way * referents.stake * move,
        see_either / (length[:, None] + _start_m),
        *(column * move for column in _to_figure(situation, candidates, referents)),
        *(column * move for column in _to_landmark(situation, candidates, referents)),
        stop_found,
        stop[:, None] * here[:, None] * (reach & referents.known & ~referents.found),
        stop[:, None] * np.maximum(0.9 - stop_mass, 0.0),
        stop[:, None] * np.maximum(0.6 - stop_mass, 0.0),
    )
    shape = (len(candidates), len(referents.probability))
    return np.stack([np.broadcast_to(column, shape) for column in columns], axis=-1, dtype=float)


def _to_figure(
    situation: Situation, candidates: Candidates, referents: Referents
) -> tuple[Floats, ...]:
    """How the ways lie to the figures: gap, nearer, detour and size, (C, M) each."""
    gap = distances(candidates.pose[:, :2], referents.figure)
    before = distances(situation.pose[None, :2], referents.figure)
    straight = distances(candidates.pose[:, :2], situation.pose[None, :2])
    known = referents.known
    size = np.broadcast_to(referents.figure_size * known, gap.shape)
    return gap * known, (before - gap) * known, (straight + gap - before) * known, size


def _to_landmark(
    situation: Situation, candidates: Candidates, referents: Referents
) -> tuple[Floats, ...]:
    """How the ways lie to the landmarks: gap and nearer, (C, M) each."""
    gap = distances(candidates.pose[:, :2], referents.landmark)
    before = distances(situation.pose[None, :2], referents.landmark)
    return gap * referents.known, (before - gap) * referents.known


def _sightings(
    situation: Situation, candidates: Candidates, referents: Referents
) -> tuple[Floats, Floats]:
    """Probabilities (C, M) that figure and landmark are seen for the first time."""
    poses, owner = _looks(situation, candidates)
    terrain, view = situation.terrain, situation.view
    unseen = referents.known & ~referents.figure_seen
    figure = view.detection(poses, referents.figure, terrain) * unseen
    figure *= referents.figure_existence * terrain.missed_at(referents.figure)
    unseen = referents.known & ~referents.landmark_seen
    landmark = view.detection(poses, referents.landmark, terrain) * unseen
    landmark *= referents.landmark_existence * terrain.missed_at(referents.landmark)
    return _best_of(figure, owner, len(candidates)), _best_of(landmark, owner, len(candidates))


def _looks(situation: Situation, candidates: Candidates) -> tuple[Floats, NDArray[np.intp]]:
    """Poses (V, 3) from which candidates look, at the end and on a straight way, and whose."""
    owner = [row for row, kind in enumerate(candidates.kinds) if kind is not Kind.STOP]
    ends = candidates.pose[owner]
    offset = ends[:, :2] - situation.pose[:2]
    straight = np.hypot(*offset.T)
    way = situation.travel.to(ends[:, :2])
    open_way = (straight > 1.0) & (way < _detour * straight)
    heading = np.arctan2(offset[:, 1], offset[:, 0])[:, None]
    between = [
        np.hstack([situation.pose[:2] + share * offset, heading])[open_way] for share in _on_the_way
    ]
    owners = np.array(owner, np.intp)
    poses = np.concatenate([ends, *between])
    return poses, np.concatenate([owners, *[owners[open_way]] * len(_on_the_way)])


def _best_of(values: Floats, owner: NDArray[np.intp], count: int) -> Floats:
    """Largest of the values (V, M) of each owner, shape (count, M)."""
    best = np.zeros((count, values.shape[1]))
    np.maximum.at(best, owner, values)
    return best


def _new_area(situation: Situation, candidates: Candidates) -> Floats:
    """Unlooked ground seen from the end pose, as a share of one full view, shape (C,)."""
    terrain, view = situation.terrain, situation.view
    stride = max(1, round(_area_step / terrain.resolution))
    sample = terrain.unlooked[::stride, ::stride]
    rows, columns = np.nonzero(sample)
    centers = terrain.centers(rows * stride, columns * stride)
    seen = view.detection(candidates.pose, centers, terrain)
    return seen @ sample[rows, columns] * stride**2 / view.area


def _times_tried(tried: Floats, candidates: Candidates) -> Floats:
    """How many of the poses (T, 3) showed about the same as each candidate will, shape (C,)."""
    ends = candidates.pose
    apart = np.hypot(*(ends[:, None, :2] - tried[None, :, :2]).transpose(2, 0, 1))
    turned = np.abs(_wrapped(ends[:, None, 2] - tried[None, :, 2]))
    from_target = np.hypot(*(candidates.target[:, None] - tried[None, :, :2]).transpose(2, 0, 1))
    # A seen thing looks the same from all sides.
    visited = (candidates.object_id >= 0)[:, None] & (from_target < _visited_within)
    alike = (apart < _same_place) & (turned < _same_heading)
    return (alike | visited).sum(axis=1).astype(np.float64)


def _turn(pose: Floats, ends: Floats) -> Floats:
    """Turning on the spot before and after a straight way, shape (C,) [rad]."""
    offset = ends[:, :2] - pose[:2]
    moves = np.hypot(*offset.T) > 0.1
    heading = np.where(moves, np.arctan2(offset[:, 1], offset[:, 0]), pose[2])
    return np.abs(_wrapped(heading - pose[2])) + np.abs(_wrapped(ends[:, 2] - heading))


def _wrapped(angle: Floats) -> Floats:
    return (angle + np.pi) % (2 * np.pi) - np.pi
