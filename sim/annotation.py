"""A training picture, the boxes that belong to it, and how much of each object shows."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from schemas.geometry import Pose3
from schemas.sensing import Intrinsics
from sim.assets.asset import Asset

SMALLEST_SIDES = (6, 12)
"""Objects whose box has a shorter or longer side of less than this many pixels are ignored."""
LEAST_VISIBLE = 0.4
"""So are those of which less than this part shows: hidden, or outside the picture."""
LEAST_SHOWN = 9.0
"""So are those whose longer side times that part is less [px]: what is left tells nobody much."""
_samples = 400

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class TrainingFrame:
    """A picture and what a detector should find in it, N objects."""

    color: NDArray[np.uint8]
    """(H, W, 3) RGB."""
    boxes: NDArray[np.float32]
    """(N, 4) x1, y1, x2, y2 [px] around visible pixels, right and lower edges exclusive."""
    classes: NDArray[np.int64]
    """(N,) indices into `DETECTED`."""
    ignored: NDArray[np.bool_]
    """(N,) too small or too much hidden to be asked for; a detection of it is no mistake."""
    visible: NDArray[np.float32]
    """(N,) share of the object's surface towards the camera that shows in the picture."""


@dataclass(frozen=True)
class TrueFrame:
    """A training picture with the truth in space; for evaluation alone."""

    frame: TrainingFrame
    """Its N objects are those of the arrays below, in the same order."""
    depth: NDArray[np.float32]
    """(H, W) along the optical axis, without noise [m]; 0 where there is only sky."""
    intrinsics: Intrinsics
    world_from_camera: Pose3
    """Camera axes: x right, y down, z forward; z of the world is up."""
    centers: Floats
    """(N, 3) middles of the oriented bounding boxes in the camera frame [m]."""
    rotations: Floats
    """(N, 3, 3) camera_from_object: columns are the box's axes in the camera frame."""
    sizes: Floats
    """(N, 3) sides of the boxes along those axes [m]."""


def visible_box(mask: NDArray[np.bool_]) -> NDArray[np.float32] | None:
    """Box (4,) around the true pixels, or None if there is none."""
    columns, rows = np.flatnonzero(mask.any(axis=0)), np.flatnonzero(mask.any(axis=1))
    if len(columns) == 0:
        return None
    return np.array([columns[0], rows[0], columns[-1] + 1, rows[-1] + 1], np.float32)


def is_ignored(box: NDArray[np.float32], visible: float) -> bool:
    """Whether an object is too small or too much hidden for a label."""
    short, long = sorted((float(box[2] - box[0]), float(box[3] - box[1])))
    is_small = short < SMALLEST_SIDES[0] or long < SMALLEST_SIDES[1]
    return is_small or visible < LEAST_VISIBLE or visible * long < LEAST_SHOWN


def visible_share(
    mask: NDArray[np.bool_], asset: Asset, camera_from_asset: Pose3, camera: Intrinsics
) -> float:
    """Part of the surface towards the camera whose pixels are in the mask (H, W).

    Weighted as the picture shows it, by tilt and distance. What an object hides of itself counts
    as seen; what lies outside the picture does not.
    """
    points, normals = surface_samples(asset)
    seen, turned = camera_from_asset.apply(points), normals @ camera_from_asset.rotation().T
    distance = np.linalg.norm(seen, axis=1)
    weight = np.maximum(-np.einsum("ij,ij->i", turned, seen), 0) / np.maximum(distance, 0.05) ** 3
    depth = np.maximum(seen[:, 2], 1e-3)
    u = np.floor(camera.fx * seen[:, 0] / depth + camera.cx + 0.5)
    v = np.floor(camera.fy * seen[:, 1] / depth + camera.cy + 0.5)
    inside = (seen[:, 2] > 0.05) & (u >= 0) & (v >= 0) & (u < camera.width) & (v < camera.height)
    shows = np.zeros(len(points), np.bool_)
    shows[inside] = mask[v[inside].astype(int), u[inside].astype(int)]
    return float((weight * shows).sum() / max(float(weight.sum()), 1e-12))


@lru_cache(maxsize=256)
def surface_samples(asset: Asset) -> tuple[Floats, Floats]:
    """Points (400, 3) spread evenly over an asset's surface [m], and their unit normals."""
    corners = np.concatenate([mesh.vertices[mesh.triangles] for mesh in asset.meshes])
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(cross, axis=1)
    rng = np.random.default_rng(0)
    chosen = rng.choice(len(area), _samples, p=area / area.sum())
    a, b = rng.random((2, _samples, 1))
    folded = a + b > 1
    a, b = np.where(folded, 1 - a, a), np.where(folded, 1 - b, b)
    first, second, third = corners[chosen].transpose(1, 0, 2)
    points = first + a * (second - first) + b * (third - first)
    return points, cross[chosen] / area[chosen, None]
