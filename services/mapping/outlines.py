"""What the range finder saw from each pose node, and how far two nodes saw the same.

The similarity of Blanco et al. 2006, which Section "Updating the current spatial region" clusters
by: the share of one scan's end points that lie within what the other scan sees. Both shares are
multiplied: a room sees much of the hallway through its door, the hallway little of the room.
"""

from dataclasses import dataclass

import numpy as np

from schemas.arrays import Flags, Floats
from schemas.geometry import Pose2
from schemas.sensing import LaserScan

_beams = 180
_reach = 8.0
"""Walls farther away say little about the place that one is in [m]."""
_slack = 0.25
"""An end point this far behind the other scan's wall still is that wall [m]."""


@dataclass(frozen=True)
class Outline:
    """One scan with evenly spaced beams, seen from its pose node."""

    node_from_laser: Pose2
    ranges: Floats
    """(B,) from -pi on [m]; `limit` where nothing answered."""
    limit: float
    """[m]"""


def outline_of(scan: LaserScan, odom_from_node: Pose2) -> Outline:
    """The scan in the frame of a pose node."""
    turn = round(2 * np.pi / scan.angle_increment)
    beam = np.rint((_angles - scan.angle_min) / scan.angle_increment).astype(np.int32) % turn
    known = beam < len(scan.ranges)
    ranges = scan.ranges[np.where(known, beam, 0)].astype(np.float64)
    limit = min(scan.range_max, _reach)
    ranges = np.minimum(np.nan_to_num(ranges, nan=0.0, posinf=limit), limit)
    node_from_laser = odom_from_node.inverse() @ scan.odom_from_base @ scan.base_from_laser
    return Outline(node_from_laser, np.where(known, ranges, 0.0), limit)


def overlaps(new: Outline, new_pose: Floats, others: list[Outline], poses: Floats) -> Floats:
    """Similarity (N,) in [0, 1] of a scan with N others; pose nodes x, y, yaw (3,) and (N, 3)."""
    mine, theirs = _lasers([new], new_pose[None]), _lasers(others, poses)
    # Scans that are farther apart than both see have nothing in common.
    near = np.hypot(*(theirs[:, :2] - mine[0, :2]).T) < 2 * new.limit
    similarity = np.zeros(len(others))
    if near.any():
        ranges = np.stack([other.ranges for other in others])[near]
        limits = np.array([other.limit for other in others])[near]
        similarity[near] = _symmetrised(mine, new, theirs[near], ranges, limits)
    return similarity


def _symmetrised(
    mine: Floats, new: Outline, theirs: Floats, ranges: Floats, limits: Floats
) -> Floats:
    own_ends, own_hits = _ends(mine, new.ranges[None], np.array([new.limit]))
    ends, hits = _ends(theirs, ranges, limits)
    there = _share(_within(theirs, ranges, own_ends), np.broadcast_to(own_hits, hits.shape))
    own_ranges = np.broadcast_to(new.ranges, ranges.shape)
    back = _share(_within(np.broadcast_to(mine, theirs.shape), own_ranges, ends), hits)
    return there * back


def _lasers(outlines: list[Outline], poses: Floats) -> Floats:
    """Poses x, y, yaw (N, 3) of the range finder, map frame."""
    mounts = [outline.node_from_laser for outline in outlines]
    inner = np.array([[mount.x, mount.y, mount.yaw] for mount in mounts])
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    x = poses[:, 0] + c * inner[:, 0] - s * inner[:, 1]
    y = poses[:, 1] + s * inner[:, 0] + c * inner[:, 1]
    return np.stack([x, y, poses[:, 2] + inner[:, 2]], axis=1)


def _ends(lasers: Floats, ranges: Floats, limits: Floats) -> tuple[Floats, Flags]:
    """End points (N, B, 2) of all beams, map frame, and which of them hit something (N, B)."""
    angle = lasers[:, 2:] + _angles
    rays = np.stack([np.cos(angle), np.sin(angle)], axis=2)
    hits = (ranges > 0) & (ranges < limits[:, None])
    return lasers[:, None, :2] + ranges[..., None] * rays, hits


def _within(lasers: Floats, ranges: Floats, points: Floats) -> Flags:
    """Whether points (N or 1, B, 2), map frame, lie inside what each of the N scans sees."""
    offset = points - lasers[:, None, :2]
    bearing = np.arctan2(offset[..., 1], offset[..., 0]) - lasers[:, 2:]
    beam = np.rint((bearing + np.pi) / (2 * np.pi) * _beams).astype(np.int32) % _beams
    reach = np.take_along_axis(ranges, beam, axis=1)
    return np.hypot(offset[..., 0], offset[..., 1]) < reach + _slack


def _share(within: Flags, hits: Flags) -> Floats:
    """Share (N,) of the hits that lie within; all of none: where no walls are none separates."""
    count = hits.sum(axis=1)
    return np.where(count > 0, (within & hits).sum(axis=1) / np.maximum(count, 1), 1.0)


_angles: Floats = 2 * np.pi * (np.arange(_beams, dtype=np.float64) / _beams - 0.5)
