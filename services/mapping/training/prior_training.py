"""Learns where things may be and how many there are, and says how sure the filter may be."""

import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import get_args

import numpy as np

from schemas.arrays import Floats
from services.mapping import prior
from services.mapping.place_prior import PlacePrior, by_hand
from services.mapping.prior import PlaceWeights, PriorWeights, Role
from services.mapping.training.groundings import CLASSES, Scored, fit_densities, score
from services.mapping.training.place_fit import fit_places
from services.mapping.training.worlds import (
    FIRST_SEED,
    TrainingWorld,
    places_meant,
    sample_worlds,
)

ROLES: tuple[Role, ...] = get_args(Role)
WORLDS = 120
"""Of each layout."""
_bins = (0.0, 0.5, 0.8, 0.9, 0.95, 0.99, 1.0)

Progress = Callable[[str], None]


def train_priors(worlds: int, progress: Progress) -> PriorWeights:
    """Weights from worlds of each layout; half as many more are kept apart."""
    fitted = sample_worlds(worlds, FIRST_SEED)
    kept_apart = sample_worlds(worlds // 2, FIRST_SEED + worlds)
    places: dict[Role, PlacePrior] = {
        role: fit_places(places_meant(fitted, role)) for role in ROLES
    }
    weights: dict[Role, PlaceWeights] = {role: _weights(one) for role, one in places.items()}
    scored, held_out = (
        score(group, np.random.default_rng(number))
        for number, group in enumerate((fitted, kept_apart))
    )
    change = fit_densities(scored)
    densities = prior.background_density * np.exp(change)
    for line in calibration(held_out, change):
        progress(line)
    return PriorWeights(
        source="python -m services.mapping.training: layouts of sim.scenes.object_relative",
        first_seed=FIRST_SEED,
        worlds=worlds,
        places=weights,
        densities={n: round(one, 6) for n, one in zip(CLASSES, densities.tolist(), strict=True)},
        held_out=_held_out(places, kept_apart, held_out, change),
    )


def calibration(scored: Scored, log_change: Floats) -> list[str]:
    """Of situations in which a pair that was seen has some probability, how many are true."""
    probability, true = scored.best_found(log_change)
    lines = []
    for low, high in itertools.pairwise(_bins):
        rows = (probability > low) & (probability <= high)
        if rows.any():
            lines.append(
                f"posterior of what was found {low:.2f} to {high:.2f}: {rows.sum()} situations, "
                f"mean {probability[rows].mean():.3f}, true {true[rows].mean():.3f}"
            )
    return lines


def _held_out(
    places: Mapping[Role, PlacePrior],
    worlds: Sequence[TrainingWorld],
    scored: Scored,
    log_change: Floats,
) -> dict[str, float]:
    values: dict[str, Floats] = {}
    for role, mixture in places.items():
        at = places_meant(worlds, role)
        values[f"{role}s"] = mixture.log_density(at)
        values[f"{role}s by hand"] = by_hand.log_density(at)
    values |= {
        "groundings": np.log(scored.probability(log_change)),
        "groundings before": np.log(scored.probability(np.zeros(2))),
    }
    return {name: round(float(np.mean(value)), 3) for name, value in values.items()}


def _weights(places: PlacePrior) -> PlaceWeights:
    return PlaceWeights(
        means=_pairs(places.means),
        spreads=_pairs(places.spreads),
        shares=tuple(round(share, 4) for share in places.shares.tolist()),
    )


def _pairs(values: Floats) -> tuple[tuple[float, float], ...]:
    return tuple((round(x, 2), round(y, 2)) for x, y in values.tolist())
