"""When things come into view on a straight way, in closed form."""

from dataclasses import dataclass

import numpy as np

from schemas.arrays import Floats
from services.policy.view import FieldOfView


@dataclass(frozen=True)
class Legs:
    """Straight ways between all pairs of A starts and B ends, driven forwards."""

    start: Floats
    """(A, 2), map frame [m]"""
    end: Floats
    """(B, 2), map frame [m]"""
    length: Floats
    """(A, B) [m]"""

    @staticmethod
    def between(start: Floats, end: Floats) -> "Legs":
        """All ways from starts (A, 2) to ends (B, 2)."""
        return Legs(start, end, distances(start, end))

    @property
    def direction(self) -> tuple[Floats, Floats]:
        """Components x and y (A, B) of unit vectors; zero where start and end are one."""
        length = np.maximum(self.length, 1e-9)
        x = (self.end[None, :, 0] - self.start[:, None, 0]) / length
        y = (self.end[None, :, 1] - self.start[:, None, 1]) / length
        return x, y

    def first_sight(self, points: Floats, view: FieldOfView) -> Floats:
        """How far along each way each point (P, 2) comes into view: (A, B, P), infinite if never.

        A point that lies `ahead` of the start and `aside` of the way is in range while the robot
        is within `half_chord` of its foot, and in the angle of view until it is too far aside.
        """
        x, y = self.direction
        dx = points[None, :, 0] - self.start[:, :1]
        dy = points[None, :, 1] - self.start[:, 1:]
        ahead = x[..., None] * dx[:, None] + y[..., None] * dy[:, None]
        aside_square = np.maximum((dx * dx + dy * dy)[:, None] - ahead * ahead, 0.0)
        half_chord = np.sqrt(np.maximum(view.reach**2 - aside_square, 0.0))
        first = np.maximum(ahead - half_chord, 0.0)
        if view.half_angle < np.pi:
            last = ahead - np.sqrt(aside_square) / np.tan(view.half_angle)
        else:
            last = ahead + half_chord
        seen = (aside_square < view.reach**2) & (first <= last) & (first <= self.length[..., None])
        return np.where(seen, first, np.inf)


def distances(start: Floats, end: Floats) -> Floats:
    """Between all pairs (A, 2), (B, 2): shape (A, B) [m]."""
    dx, dy = start[:, None, 0] - end[:, 0], start[:, None, 1] - end[:, 1]
    return np.sqrt(dx * dx + dy * dy)


def shown_from(poses: Floats, points: Floats, view: FieldOfView) -> Floats:
    """0 where points (P, 2) are in view from poses x, y, yaw (A, 3), infinite elsewhere: (A, P)."""
    dx, dy = points[:, 0] - poses[:, :1], points[:, 1] - poses[:, 1:2]
    seen = dx**2 + dy**2 < view.reach**2
    if view.half_angle < np.pi:
        bearing = np.arctan2(dy, dx) - poses[:, 2:]
        seen &= np.abs((bearing + np.pi) % (2 * np.pi) - np.pi) < view.half_angle
    return np.where(seen, 0.0, np.inf)
