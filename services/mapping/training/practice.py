"""What relations mean where the robot practises: the instructions of its training worlds.

Annotators of abstract scenes say what a word can mean; how far "behind" is in the open, where
things stand metres apart, is learned where the robot works.
"""

from collections.abc import Mapping

import numpy as np

from schemas.geometry import Pose2
from services.mapping.prior import typical_radius
from services.mapping.relations import features_of, frame_at
from services.mapping.training.utterances import Examples
from services.mapping.training.worlds import FIRST_SEED, places_meant, sample_world

_first_seed = FIRST_SEED + 5_000
"""Apart from the worlds that priors are fitted to and judged in."""
_layouts: Mapping[str, tuple[str, ...]] = {
    "back": ("one_hydrant_one_cone", "one_hydrant_two_cones", "two_hydrants_one_cone"),
    "nearest": ("nearest_hydrant",),
}
"""In which worlds a word is said."""


def practised(relation: str, count: int) -> Examples:
    """`count` pairs of hydrant and cone; none for words that are not practised."""
    layouts = _layouts.get(relation, ())
    number = range(count if layouts else 0)
    worlds = [sample_world(layouts[n % len(layouts)], _first_seed + n) for n in number]
    figure, landmark = places_meant(worlds, "figure"), places_meant(worlds, "landmark")
    frame = frame_at(landmark, Pose2(0.0, 0.0, 0.0))
    apart = figure - landmark
    offset = np.stack([np.sum(apart * frame.u, axis=1), np.sum(apart * frame.v, axis=1)], axis=1)
    radius = np.full(len(worlds), typical_radius("hydrant"))
    half = np.full((len(worlds), 2), typical_radius("cone"))
    return Examples(offset, features_of(frame, radius, half))
