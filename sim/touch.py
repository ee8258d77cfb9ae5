"""How hard the robot and what it holds press against other things; for evaluation alone."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
import sapien


def forces(scene: sapien.Scene, of: Collection[str], on: str) -> float:
    """Sum of the forces of bodies on another in the last step, by the names of entities [N]."""
    total = 0.0
    for contact in scene.get_contacts():
        names = {body.entity.name for body in contact.bodies}
        if on in names and names & set(of):
            impulses = [np.linalg.norm(point.impulse) for point in contact.points]
            total += float(np.sum(impulses))
    return total / scene.get_timestep()
