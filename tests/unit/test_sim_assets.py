import math

import numpy as np
import pytest

from sim.assets.library import DETECTED, MAKERS, UnknownClassError, make_asset
from sim.assets.normals import shaded
from sim.assets.surface import ball, box, cylinder, lathe, loft, slab

SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]


def volume(surface):
    a, b, c = (surface.vertices[surface.triangles[:, k]] for k in range(3))
    return np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6


@pytest.mark.parametrize(
    ("surface", "expected"),
    [
        (box(1, 2, 3), 6.0),
        (cylinder(0.5, 2, 64), math.pi / 2),
        (lathe([(1, 0), (0, 3)], 64), math.pi),
        (ball(1, 3), 4 * math.pi / 3),
        (slab([(0, 0), (2, 0), (2, 1), (0, 1)], 0.5), 1.0),
        (loft([[(x, y, z) for x, y in SQUARE] for z in (0, 1)]), 1.0),
    ],
)
def test_surfaces_are_closed_and_wound_outwards(surface, expected):
    # The divergence theorem gives the volume only if no triangle is missing or turned around.
    assert volume(surface) == pytest.approx(expected, rel=0.02)


def test_normals_are_smooth_on_curves_and_sharp_at_edges():
    _, flat = shaded(box(1, 1, 1))
    assert np.allclose(np.sort(np.abs(flat), axis=1)[:, :2], 0, atol=1e-9)
    surface, round_ = shaded(ball(2.0, 2))
    assert np.einsum("ij,ij->i", surface.vertices / 2.0, round_).min() > 0.97


@pytest.mark.parametrize("label", MAKERS)
@pytest.mark.parametrize("look", [0, 1, 2])
def test_an_asset_is_light_stands_on_the_ground_and_fits_its_collision(label, look):
    asset = make_asset(label, look)
    assert asset.triangle_count <= 3000
    assert -0.05 < asset.bounds[0][2] < 0.03
    assert asset.collisions
    for mesh in asset.meshes:
        assert np.isfinite(mesh.vertices).all()
        assert mesh.triangles.max() < len(mesh.vertices)
        assert np.allclose(np.linalg.norm(mesh.normals, axis=1), 1, atol=1e-6)
    top = max(shape.center[2] + shape.half[2] for shape in asset.collisions)
    assert top > 0.7 * asset.bounds[1][2] or label in ("tree", "building")


@pytest.mark.parametrize("label", DETECTED)
def test_same_look_same_arrays_and_another_look_differs(label):
    first = make_asset(label, 5)
    make_asset.cache_clear()
    again, other = make_asset(label, 5), make_asset(label, 6)
    for a, b in zip(first.meshes, again.meshes, strict=True):
        assert np.array_equal(a.vertices, b.vertices)
        assert np.array_equal(a.texture, b.texture)
    assert first.size != other.size


def test_an_unknown_class_is_answered_with_the_known_ones():
    with pytest.raises(UnknownClassError, match=r"dragon.*cone, hydrant"):
        make_asset("dragon", 0)
