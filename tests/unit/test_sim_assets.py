import math

import numpy as np
import pytest

from robots.symbols import SYMBOL_SPACES
from sim.assets.library import (
    DETECTED,
    DISTRACTORS,
    FURNITURE,
    MAKERS,
    SMALL,
    SMALL_DISTRACTORS,
    UnknownClassError,
    make_asset,
)
from sim.assets.normals import shaded
from sim.assets.shapes import arc, atlas_box, rounded_box, tube
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
        (rounded_box(1, 2, 3, 0.05, 0.02), 6.0),
        (atlas_box(1, 2, 3), 6.0),
        (tube([(0, 0, 0), (0, 0, 2)], 0.5, 64), math.pi / 2),
        (tube(arc(2.0, 0, math.pi, 64), 0.1, 64), math.pi * 0.01 * 2 * math.pi),
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


def test_the_detector_has_the_words_of_all_robots_and_no_distractor():
    spaces = SYMBOL_SPACES.values()
    words = {name for space in spaces for name in space.object_classes} - {"unknown", "robot"}
    assert set(DETECTED) == words
    # Weights trained before there were more classes name these six by number.
    assert DETECTED[:6] == ("cone", "hydrant", "barrel", "tree", "car", "building")
    others = {*DISTRACTORS, *SMALL_DISTRACTORS, *FURNITURE}
    assert others <= set(MAKERS)
    assert not others & set(DETECTED)
    assert set(SMALL) < set(DETECTED)


@pytest.mark.parametrize(
    ("label", "shortest", "longest"),
    [
        ("drill", (0.05, 0.09), (0.16, 0.26)),
        ("suitcase", (0.15, 0.33), (0.40, 1.10)),
        ("banana", (0.03, 0.06), (0.14, 0.24)),
        ("pitcher", (0.09, 0.17), (0.20, 0.29)),
        ("cracker box", (0.05, 0.075), (0.19, 0.23)),
        ("mustard bottle", (0.045, 0.08), (0.17, 0.22)),
        ("ball", (0.058, 0.242), (0.058, 0.242)),
        ("box", (0.18, 0.34), (0.30, 0.80)),
    ],
)
def test_small_objects_are_as_large_as_real_ones(label, shortest, longest):
    for look in range(10, 20):
        sides = sorted(make_asset(label, look).size)
        assert shortest[0] <= sides[0] <= shortest[1]
        assert longest[0] <= sides[2] <= longest[1]


@pytest.mark.parametrize("look", range(6))
def test_an_open_box_is_hollow_for_physics_too(look):
    shapes = make_asset("box", look).collisions

    def solid(point):
        return any(
            (np.abs(np.subtract(point, shape.center)) <= shape.half).all() for shape in shapes
        )

    low = np.min([np.subtract(s.center, s.half) for s in shapes], axis=0)
    high = np.max([np.add(s.center, s.half) for s in shapes], axis=0)
    assert solid((0, 0, low[2] + 0.004))
    for height in np.linspace(low[2] + 0.03, high[2], 5):
        assert not solid((0, 0, height))
        assert not solid((0.4 * high[0], 0.4 * low[1], height))
        walls = [(low[0], 0), (high[0], 0), (0, low[1]), (0, high[1])]
        assert all(solid((0.995 * x, 0.995 * y, height)) for x, y in walls)
