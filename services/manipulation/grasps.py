"""Ways to take hold of a thing between two parallel fingers, from its box in space."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from robots.arm import GripperSpec
from schemas.arrays import Flags, Floats
from schemas.task import HandlingFailure
from services.manipulation.errors import RefusalError

ROOMS = (0.015, 0.007)
"""That open fingers leave to either side of the thing; the less only where there is no more [m]."""
_skin = 0.005
"""Points this near to the sides of the thing are its own [m]."""
_tight_cost = 0.35
"""As much as a tilt of so many rad."""
_tilts = (0.0, 15.0, 30.0, 45.0)
"""Of the approach from straight down [deg]."""
_azimuths = 8
_rolls = 16
_deep = 0.07
"""How far below its top a thing is taken [m]."""
_least_height = 0.03
"""Of the point to grasp with above the thing's underside, so that finger tips stay off what it
stands on [m]."""


@dataclass(frozen=True)
class Thing:
    """What is to be taken."""

    kind: str
    """One of `schemas.perception.SOLID_KINDS`."""
    base_from_box: Floats
    """(4, 4), z up, the origin in the middle."""
    size: Floats
    """(3,) length, width, height [m]."""


@dataclass(frozen=True)
class Grasps:
    """Candidates, the better ones first."""

    base_from_tool: Floats
    """(N, 4, 4): z is the approach, the fingers close along y."""
    widths: Floats
    """(N,) of the thing between the fingers [m]."""
    openings: Floats
    """(N,) of the fingers on their way to it [m]."""

    def __len__(self) -> int:
        return len(self.widths)


def candidates(gripper: GripperSpec, thing: Thing, points: Floats | None = None) -> Grasps:
    """All ways to take a thing that its size allows.

    Steep approaches come first, and of these the ones that close on the narrow side: there the pads
    lie flat.

    Args:
        gripper: with which.
        thing: what is known of it.
        points: (P, 3) surfaces that were seen around it in the base frame; where a finger would be
            there must be none [m].

    Raises:
        RefusalError: it is too big for the gripper, or something stands close on all sides.
    """
    frames, tilts = (np.concatenate([part] * len(ROOMS)) for part in _frames(thing))
    widths = _widths(thing, frames[:, :3, 1])
    room = np.repeat(ROOMS, len(frames) // len(ROOMS))
    openings = widths + 2 * room
    widest = gripper.opening - 2 * min(ROOMS)
    fit = openings <= gripper.opening
    if not fit.any():
        raise RefusalError(
            HandlingFailure.TOO_BIG,
            f"it is {widths.min():.3f} m wide; the gripper takes up to {widest:.3f} m",
        )
    if points is not None:
        fit &= ~_blocked(gripper, frames, widths, openings, points)
        if not fit.any():
            raise RefusalError(
                HandlingFailure.GOAL_IN_COLLISION, "something stands close to it on all sides"
            )
    cost = tilts + 8.0 * (widths - widths.min()) + _tight_cost * (room < max(ROOMS))
    order = np.flatnonzero(fit)[np.argsort(cost[fit], kind="stable")]
    return Grasps(frames[order], widths[order], openings[order])


def _point(thing: Thing) -> Floats:
    """Where to take it (3,): not far below its top, and not at its very bottom."""
    height = float(thing.size[2])
    above = min(max(height - min(height / 2, _deep), _least_height), height)
    return thing.base_from_box[:3, 3] + thing.base_from_box[:3, 2] * (above - height / 2)


def _frames(thing: Thing) -> tuple[Floats, Floats]:
    """Poses of the tool (N, 4, 4) from all sides above, and their tilts (N,) [rad].

    They are even about the axes of the thing, so that some close on it flat.
    """
    approaches = [(0.0, 0.0)] + [
        (math.radians(tilt), k * math.tau / _azimuths)
        for tilt in _tilts[1:]
        for k in range(_azimuths)
    ]
    tilt, azimuth, roll = (
        column.ravel()
        for column in (
            *(np.repeat(np.array(approaches).T, _rolls, axis=1)),
            np.tile(np.arange(_rolls) * math.tau / _rolls, len(approaches)),
        )
    )
    z = np.stack(
        [np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), -np.cos(tilt)], axis=1
    )
    level = np.stack([-np.sin(azimuth), np.cos(azimuth), np.zeros_like(azimuth)], axis=1)
    other = np.cross(z, level)
    y = np.cos(roll)[:, None] * level + np.sin(roll)[:, None] * other
    frames = np.tile(np.eye(4), (len(z), 1, 1))
    axes = np.stack([np.cross(y, z), y, z], axis=2)
    frames[:, :3, :3] = thing.base_from_box[:3, :3] @ axes
    frames[:, :3, 3] = _point(thing)
    return frames, tilt


def _widths(thing: Thing, closing: Floats) -> Floats:
    """How wide the thing is along directions (N, 3) [m]."""
    along = np.abs(closing @ thing.base_from_box[:3, :3])
    if thing.kind == "ball":
        return np.full(len(along), float(thing.size.mean()))
    if thing.kind == "cylinder":
        across = float(thing.size[:2].mean())
        return np.hypot(along[:, 0], along[:, 1]) * across + along[:, 2] * thing.size[2]
    return along @ thing.size


def _blocked(
    gripper: GripperSpec, frames: Floats, widths: Floats, openings: Floats, points: Floats
) -> Flags:
    """At which candidates (N,) a point lies where a finger goes, or between it and the thing."""
    x, y, z = gripper.finger
    local = np.einsum("nki,npk->npi", frames[:, :3, :3], points[None] - frames[:, None, :3, 3])
    beside = np.abs(local[..., 1]) > widths[:, None] / 2 + _skin
    beside &= np.abs(local[..., 1]) < openings[:, None] / 2 + y
    at_finger = (np.abs(local[..., 0]) < x / 2) & beside
    lengthwise = (local[..., 2] < gripper.pad) & (local[..., 2] > gripper.pad - z)
    return (at_finger & lengthwise).any(axis=1)
