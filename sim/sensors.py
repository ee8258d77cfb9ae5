"""Noise and geometry of the simulated sensors."""

from __future__ import annotations

import math

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from sapien import physx

from robots.spec import BaseGeometry, LaserSpec
from schemas.geometry import Pose2

RANGE_DEVIATION = 0.01
"""Of the laser [m]."""
_outside = 0.01
"""How far from the hull a laser sits that looks out of it [m]."""
HOLE_FRACTION = 0.002
"""Part of the depth pixels that answer nothing for no visible reason."""


def scan(
    system: physx.PhysxCpuSystem,
    spec: LaserSpec,
    base: BaseGeometry,
    world_from_base: Pose2,
    rng: Generator,
) -> NDArray[np.float32]:
    """Ranges (beams,) [m], counter-clockwise from -pi in the laser frame; infinite if no answer.

    A laser above the body must sit outside the robot's own collision shapes: a ray that starts in
    one ends there. One inside stands for several around the hull, counted from a common middle.
    """
    mount = world_from_base @ spec.base_from_laser
    origin = [mount.x, mount.y, spec.height]
    angles = mount.yaw + beam_angles(spec)
    directions = np.stack([np.cos(angles), np.sin(angles), np.zeros(spec.beams)], axis=1)
    skipped = hull_ranges(spec, base)
    origins = np.array(origin) + skipped[:, None] * directions
    # The stub says that a hit always comes back; in truth it is None where nothing is in the way.
    hits: list[physx.PhysxRayHit | None] = [
        system.raycast(start, direction, spec.range_max)
        for start, direction in zip(origins.tolist(), directions.tolist(), strict=True)
    ]
    ranges = np.array([math.inf if hit is None else hit.distance for hit in hits]) + skipped
    noisy = ranges + RANGE_DEVIATION * rng.normal(size=spec.beams)
    noisy[(noisy < spec.range_min) | (noisy >= spec.range_max)] = math.inf
    return noisy.astype(np.float32)


def hull_ranges(spec: LaserSpec, base: BaseGeometry) -> NDArray[np.float64]:
    """How far each beam (beams,) runs inside the robot's body; 0 for a laser above it [m]."""
    if spec.height > base.height:
        return np.zeros(spec.beams)
    mount = spec.base_from_laser
    angles = mount.yaw + beam_angles(spec)
    along = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    half = np.array([base.length, base.width]) / 2 + _outside
    with np.errstate(divide="ignore"):
        to_sides = (np.copysign(half, along) - np.array([mount.x, mount.y])) / along
    return to_sides.min(axis=1)


def beam_angles(spec: LaserSpec) -> NDArray[np.float64]:
    """Direction of every beam in the laser frame (beams,) [rad]."""
    return np.linspace(-math.pi, math.pi, spec.beams, endpoint=False, dtype=np.float64)


def measured_depth(
    depth: NDArray[np.float32], range_max: float, rng: Generator
) -> NDArray[np.uint16]:
    """Depth as a stereo camera gives it (H, W) [mm], 0 where it found nothing.

    Axial deviation 1 mm + 1.9 mm/m^2 (z - 0.4 m)^2, drop-outs at depth edges,
    scattered holes, nothing beyond `range_max` [m].
    """
    deviation = 0.001 + 0.0019 * (depth - 0.4) ** 2
    noisy = depth + deviation * rng.standard_normal(depth.shape, np.float32)
    lost = (depth <= 0) | (noisy > range_max) | (noisy <= 0.1)
    lost |= rng.random(depth.shape, np.float32) < HOLE_FRACTION
    lost |= _edges(depth) & (rng.random(depth.shape, np.float32) < 0.5)
    return np.where(lost, 0, noisy * 1000 + 0.5).astype(np.uint16)


def _edges(depth: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Pixels whose right or lower neighbour is more than a twentieth nearer or farther."""
    edge = np.zeros(depth.shape, np.bool_)
    edge[:, :-1] |= np.abs(np.diff(depth, axis=1)) > 0.05 * depth[:, :-1]
    edge[:-1] |= np.abs(np.diff(depth, axis=0)) > 0.05 * depth[:-1]
    return edge
