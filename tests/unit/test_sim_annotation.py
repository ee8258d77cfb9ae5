import numpy as np
import pytest

from schemas.geometry import Pose3
from schemas.sensing import Intrinsics
from sim.annotation import is_ignored, surface_samples, visible_box, visible_share
from sim.assets.asset import Part, assemble
from sim.assets.surface import box

CAMERA = Intrinsics(320, 240, 240.0, 240.0, 159.5, 119.5)
CUBE = assemble("cube", [Part(box(0.4, 0.4, 0.4))], [])
AHEAD = Pose3((0.0, 0.0, 2.0), (1.0, 0.0, 0.0, 0.0))


def test_a_box_holds_the_visible_pixels():
    mask = np.zeros((60, 80), np.bool_)
    mask[10:30, 20:36] = True
    box_px = visible_box(mask)
    assert box_px is not None
    assert box_px.tolist() == [20, 10, 36, 30]
    assert visible_box(np.zeros_like(mask)) is None


@pytest.mark.parametrize(
    ("sides", "visible", "ignored"),
    [
        ((20, 30), 1.0, False),
        ((6, 12), 0.8, False),
        ((12, 6), 0.8, False),
        ((24, 24), 0.4, False),
        ((12, 12), 0.7, True),
        ((5, 30), 1.0, True),
        ((11, 11), 1.0, True),
        ((200, 200), 0.38, True),
    ],
)
def test_the_small_and_the_hidden_are_ignored(sides, visible, ignored):
    box_px = np.array([7, 9, 7 + sides[0], 9 + sides[1]], np.float32)
    assert is_ignored(box_px, visible) == ignored


def test_what_shows_is_the_share_of_the_near_side():
    everything = np.ones((240, 320), np.bool_)
    left = everything.copy()
    left[:, 160:] = False
    assert visible_share(everything, CUBE, AHEAD, CAMERA) == pytest.approx(1.0)
    assert visible_share(left, CUBE, AHEAD, CAMERA) == pytest.approx(0.5, abs=0.08)
    assert visible_share(~everything, CUBE, AHEAD, CAMERA) == 0.0


def test_what_is_outside_the_picture_or_behind_the_camera_does_not_show():
    everything = np.ones((240, 320), np.bool_)
    plate = assemble("plate", [Part(box(0.4, 0.4, 0.001))], [])
    # The left edge of the picture cuts it in half.
    cut = Pose3((-2.0 * 160 / 240, 0.0, 2.0), (1.0, 0.0, 0.0, 0.0))
    assert visible_share(everything, plate, cut, CAMERA) == pytest.approx(0.5, abs=0.08)
    behind = Pose3((0.0, 0.0, -2.0), (1.0, 0.0, 0.0, 0.0))
    assert visible_share(everything, CUBE, behind, CAMERA) == 0.0


def test_samples_lie_on_the_surface_and_look_outwards():
    points, normals = surface_samples(CUBE)
    assert np.abs(points).max(axis=1) == pytest.approx(np.full(len(points), 0.2))
    assert np.einsum("ij,ij->i", points, normals) == pytest.approx(np.full(len(points), 0.2))
