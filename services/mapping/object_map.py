"""The things that were seen, and their life from a first detection to a place in the map."""

import numpy as np

from schemas.arrays import Flags, Floats
from services.mapping.association import match, same_place
from services.mapping.nesting import build_of_things, enclosed, may_be_at_one_place
from services.mapping.objects import ObjectColumns, TrackedObject, columns, first_odds
from services.mapping.sensing import Picture
from services.mapping.visibility import View

_missed_odds = -0.3
_missed_candidate_odds = -0.7
_gone_odds = -2.0
_forget_after = 30
_doubt = 0.3
"""A known thing is called missed only where pictures are sharp, and this much nearer [m]."""


class ObjectMap:
    """Confirmed objects and candidates; data association is shared by all particles.

    Args:
        classes: C of the map's vocabulary.
        containers: indices of those of things that others may lie in.
    """

    def __init__(self, classes: int, containers: tuple[int, ...] = ()) -> None:
        self._classes = classes
        self._containers = containers
        self._things: list[TrackedObject] = []
        self._next = 0

    @property
    def confirmed(self) -> list[TrackedObject]:
        """What is in the map, in the order of being found."""
        return [thing for thing in self._things if thing.confirmed]

    @property
    def columns(self) -> ObjectColumns:
        """The map's objects as arrays."""
        return columns(self.confirmed, self._classes)

    def associate(self, picture: Picture) -> tuple[list[tuple[int, int]], bool]:
        """Enter each detection into the thing it belongs to, or as a new candidate.

        Returns:
            (object id, detection) of each confirmed object that was seen, and whether any of
            them is new to the map.
        """
        known = list(self._things)
        new = False
        seen: list[tuple[int, int]] = []
        for detection, index in enumerate(match(picture, known, self._containers).tolist()):
            if index == -1:
                self._things.append(self._first(picture, detection))
            elif index >= 0:
                new |= self._hit(known[index], picture, detection)
                if known[index].confirmed:
                    seen.append((known[index].number, detection))
        return seen, new

    def miss(self, picture: Picture, view: View, sought: Flags) -> bool:
        """Lower the existence of what should have been seen; True if something left the map.

        Only things of the classes (C,) that the picture was searched for should have been.
        Doubles leave too: a thing that was misplaced at first enters twice, and its two estimates
        meet as soon as it is seen well.
        """
        if not self._things:
            return False
        local = picture.map_from_base.inverse().apply(self._means())
        distance = np.hypot(local[:, 0], local[:, 1])
        radii = np.array([thing.radius for thing in self._things])
        sharp = view.sharp_share * view.reach - _doubt
        near = distance < np.array([sharp if t.confirmed else view.reach for t in self._things])
        shown = near & view.shows(distance - radii - 0.1, np.arctan2(local[:, 1], local[:, 0]))
        # What lies in a box hides there: from the side it is nowhere in view.
        shown &= ~enclosed(self._things, self._containers)
        for thing, plain in zip(self._things, shown.tolist(), strict=True):
            if sought[thing.likeliest]:
                self._overlooked(thing, plain)
        return self._forget()

    def nearest(self, class_index: int, point: Floats) -> int | None:
        """Id of the object of a class that is nearest to a point (2,) of the map, if one is."""
        near = [
            (float(np.hypot(*(thing.mean - point))), thing.number)
            for thing in self.confirmed
            if thing.likeliest == class_index
        ]
        return min(near)[1] if near and min(near)[0] < same_place else None

    def moved(self, estimates: dict[int, tuple[Floats, Floats]]) -> None:
        """Take means (2,) and covariances (2, 2) by id from the pose graph."""
        for thing in self.confirmed:
            if thing.number in estimates:
                thing.mean, thing.covariance = estimates[thing.number]

    def restore(self, thing: TrackedObject) -> None:
        """Put back an object of an earlier life of the process."""
        self._things.append(thing)
        self._next = max(self._next, thing.number + 1)

    def _means(self) -> Floats:
        return np.array([thing.mean for thing in self._things])

    def _first(self, picture: Picture, detection: int) -> TrackedObject:
        thing = TrackedObject(
            number=-1,
            mean=picture.points[detection],
            covariance=picture.covariances[detection],
            extent=picture.extents[detection],
            class_log=np.full(self._classes, -np.log(self._classes)),
            odds=first_odds,
            hits=0,
            seen_with=picture.uncertainty,
        )
        thing.hit(picture.class_probability[detection], picture.extents[detection])
        return thing

    def _hit(self, thing: TrackedObject, picture: Picture, detection: int) -> bool:
        gain = thing.covariance @ np.linalg.inv(thing.covariance + picture.covariances[detection])
        thing.mean = thing.mean + gain @ (picture.points[detection] - thing.mean)
        thing.covariance = thing.covariance - gain @ thing.covariance + 1e-3 * np.eye(2)
        thing.hit(picture.class_probability[detection], picture.extents[detection])
        thing.seen_with = picture.uncertainty
        if thing.confirmed or not thing.worthy:
            return False
        thing.number, self._next = self._next, self._next + 1
        return True

    def _overlooked(self, thing: TrackedObject, plain: bool) -> None:
        thing.unseen += 1
        if plain and thing.unseen > 1:
            thing.odds += _missed_odds if thing.confirmed else _missed_candidate_odds

    def _forget(self) -> bool:
        living = [thing for thing in self._things if not _hopeless(thing)]
        kept = _without_doubles(living, self._containers)
        lost = len([t for t in kept if t.confirmed]) < len(self.confirmed)
        self._things = kept
        return lost


def _hopeless(thing: TrackedObject) -> bool:
    stale = thing.unseen > _forget_after and not thing.confirmed
    return stale or thing.odds < _gone_odds


def _without_doubles(
    things: list[TrackedObject], containers: tuple[int, ...]
) -> list[TrackedObject]:
    """Of things at one place only the one that was seen most often, in the order given."""
    together = _same_place(things, containers)
    if not together.any():
        return things
    dropped: set[int] = set()
    for row in sorted(range(len(things)), key=lambda row: _rank(things[row])):
        if row not in dropped:
            dropped.update(np.flatnonzero(together[row]).tolist())
    return [thing for row, thing in enumerate(things) if row not in dropped]


def _rank(thing: TrackedObject) -> tuple[bool, int]:
    """Lower for what is kept rather."""
    return not thing.confirmed, -thing.hits


def _same_place(things: list[TrackedObject], containers: tuple[int, ...]) -> Flags:
    """(K, K) Whether two different things are nearer to one another than two things can be."""
    means = np.array([thing.mean for thing in things]).reshape(-1, 2)
    radii = np.array([thing.radius for thing in things])
    offset = means[:, None] - means
    apart = np.maximum(same_place, np.minimum(radii[:, None], radii))
    together: Flags = np.hypot(offset[..., 0], offset[..., 1]) < apart
    build = build_of_things(things, containers)
    together &= ~may_be_at_one_place(build, build)
    np.fill_diagonal(together, False)
    return together
