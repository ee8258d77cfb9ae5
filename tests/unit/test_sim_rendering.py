import itertools

import numpy as np
import pytest

pytest.importorskip("sapien")

from robots.husky.spec import HUSKY
from schemas.geometry import Pose2
from schemas.motion import BaseCommand
from schemas.sensing import RgbdFrame
from sim import dataset, vulkan
from sim.contact_sheet import contact_sheet
from sim.dataset import Dataset, write_dataset
from sim.driver import SapienDriver
from sim.frames import FrameRenderer
from sim.rendering.exposure import exposed
from sim.rendering.shader import ShaderError, lit_fragment, lit_vertex
from sim.rendering.shadow import shadow_brightness
from sim.scenes.model import Ground, PlacedObject, Sun, World
from sim.scenes.training_parts import PARTS
from sim.shards import Shard


@pytest.fixture(scope="module")
def vulkan_device():
    vulkan.activate()
    try:
        return vulkan.device_name()
    except vulkan.NoVulkanDeviceError as error:
        pytest.skip(str(error))


def hydrant_ahead():
    hydrant = PlacedObject(id="h", label="hydrant", look=3, world_from_object=Pose2(3.0, 0.0, 0.0))
    return World(
        name="test",
        seed=0,
        ground=Ground(kind="grass", look=0),
        sun=Sun(azimuth=0.0, elevation=1.0),
        world_from_start=Pose2(0.0, 0.0, 0.0),
        objects=(hydrant,),
    )


def first_frame(world, seed=0):
    driver = SapienDriver(HUSKY, world, seed)
    driver.command(BaseCommand(stamp_ns=0, linear=0.0, angular=0.0, valid_ms=100))
    frames = [r for r in driver.step(500_000_000) if isinstance(r, RgbdFrame)]
    driver.close()
    return frames[0]


@pytest.mark.usefixtures("vulkan_device")
def test_the_camera_sees_the_hydrant_where_it_stands():
    frame = first_frame(hydrant_ahead())
    assert frame.color.shape == (240, 320, 3)
    assert frame.depth_mm.dtype == np.uint16
    spec, k = HUSKY.camera, frame.intrinsics
    ahead = spec.base_from_camera.inverse().apply(np.array([3.0, 0.0, 0.3]))
    u, v = round(k.fx * ahead[0] / ahead[2] + k.cx), round(k.fy * ahead[1] / ahead[2] + k.cy)
    patch = frame.depth_mm[v - 2 : v + 3, u - 2 : u + 3]
    assert np.median(patch) / 1000 == pytest.approx(ahead[2] - 0.15, abs=0.12)
    assert frame.depth_mm[0].max() == 0
    # Sky above, grass below.
    assert frame.color[5, :, 2].mean() > frame.color[5, :, 0].mean()
    assert frame.color[235, :, 1].mean() > frame.color[235, :, 2].mean()


@pytest.mark.usefixtures("vulkan_device")
def test_same_seed_same_picture():
    first, again = first_frame(hydrant_ahead()), first_frame(hydrant_ahead())
    assert np.array_equal(first.color, again.color)
    assert np.array_equal(first.depth_mm, again.depth_mm)


@pytest.mark.usefixtures("vulkan_device")
def test_a_dataset_is_resumed_not_begun_again(tmp_path):
    write_dataset(tmp_path, "train", 6, seed=3)
    frames = Dataset(tmp_path)
    assert len(frames) == 6
    picture = tmp_path / "frames" / "000000.jpg"
    written = picture.stat().st_mtime_ns
    # Left by an older version, which made its scenes otherwise.
    np.savez(tmp_path / "shards" / "000060.npz", seed=3, count=np.zeros(60, int))
    done = []
    write_dataset(tmp_path, "train", 6, 3, progress=lambda *told: done.append(told))
    assert done == [("train", 6, 6)]
    assert picture.stat().st_mtime_ns == written
    assert len(Dataset(tmp_path)) == 6
    for frame in frames:
        assert frame.color.shape == (240, 320, 3)
        assert frame.boxes.shape == (len(frame.classes), 4)
        assert len(frame.ignored) == len(frame.visible) == len(frame.classes)
        assert (frame.boxes[:, 2:] > frame.boxes[:, :2]).all()
        assert (frame.boxes <= [320, 240, 320, 240]).all()
    assert contact_sheet(frames).size == (1600, 1200)
    # The same folder for another set holds nothing of it yet.
    assert not Shard(tmp_path, "val", 3, 0, 6).is_complete()
    assert Shard(tmp_path, "train", 3, 0, 6).is_complete()


@pytest.mark.slow
@pytest.mark.usefixtures("vulkan_device")
def test_two_processes_write_what_one_writes(tmp_path, monkeypatch):
    monkeypatch.setattr(dataset, "FRAMES_PER_SHARD", 6)
    for workers in (1, 2):
        write_dataset(tmp_path / str(workers), "val", 12, seed=1, workers=workers)
    alone, together = (Dataset(tmp_path / name) for name in "12")
    assert len(alone) == len(together) == 12
    for one, other in zip(alone, together, strict=True):
        assert np.array_equal(one.color, other.color)
        assert np.array_equal(one.boxes, other.boxes)
        assert np.array_equal(one.ignored, other.ignored)


@pytest.mark.usefixtures("vulkan_device")
def test_true_boxes_in_space_cover_the_boxes_in_the_picture():
    checked = 0
    for truth in FrameRenderer().true_frames(PARTS["test"], 0, 1):
        k, frame = truth.intrinsics, truth.frame
        signs = np.array(list(itertools.product((-0.5, 0.5), repeat=3)))
        for row in np.flatnonzero(~frame.ignored):
            corners = truth.centers[row] + (signs * truth.sizes[row]) @ truth.rotations[row].T
            if corners[:, 2].min() < 0.05:
                continue
            u = np.clip(k.fx * corners[:, 0] / corners[:, 2] + k.cx + 0.5, 0, k.width)
            v = np.clip(k.fy * corners[:, 1] / corners[:, 2] + k.cy + 0.5, 0, k.height)
            left, top, right, bottom = frame.boxes[row]
            assert u.min() - 1 <= left
            assert right <= u.max() + 1
            assert v.min() - 1 <= top
            assert bottom <= v.max() + 1
            # Something in the box is as far away as the object is.
            patch = truth.depth[int(top) : int(bottom), int(left) : int(right)]
            near, far = corners[:, 2].min() - 0.01, corners[:, 2].max() + 0.01
            assert ((patch >= near) & (patch <= far)).any()
            checked += 1
    assert checked > 3


def test_a_camera_changes_the_picture_but_not_what_it_shows():
    grey = np.full((240, 320, 3), 120, np.uint8)
    grey[:, 160:] = 30
    for seed in range(20):
        rng = np.random.default_rng(seed)
        seen, again = exposed(grey, rng), exposed(grey, np.random.default_rng(seed))
        assert np.array_equal(seen, again)
        assert seen.shape == grey.shape
        assert seen.dtype == np.uint8
        assert seen[:, :150].mean() > 1.8 * seen[:, 170:].mean()
        assert 40 < seen[:, :150].mean() < 200


def test_shadows_are_darker_in_a_stronger_sun():
    soft = shadow_brightness(Sun(azimuth=0, elevation=1, color=(0.2, 0.2, 0.2), ambient=0.7))
    hard = shadow_brightness(Sun(azimuth=0, elevation=1, color=(1.3, 1.3, 1.3), ambient=0.3))
    assert 0 < hard < soft < 1


def test_a_shader_of_another_form_is_refused_with_the_reason():
    with pytest.raises(ShaderError, match=r"void main"):
        lit_vertex("no entry point")
    with pytest.raises(ShaderError, match="brace"):
        lit_fragment("void main() { } // after")
