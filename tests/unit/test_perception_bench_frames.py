"""Pictures with the truth in space, rendered once and read again."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("sapien")

from sim import vulkan
from sim.experiments.perception.frames import FrameSet
from sim.experiments.perception.scene_files import Scene
from sim.scenes.training_parts import get_part
from sim.shards import renderer


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One scene of the set `test`."""
    vulkan.activate()
    try:
        vulkan.device_name()
    except vulkan.NoVulkanDeviceError as error:
        pytest.skip(str(error))
    home = tmp_path_factory.mktemp("frames")
    FrameSet(home, "test", 3, 4).render(1, lambda done: None)
    return home


@pytest.mark.slow
def test_frames_come_back_as_they_were_rendered(folder: Path):
    frames = list(FrameSet(folder, "test", 3, 4))
    truths = renderer().true_frames(get_part("test"), 3, 0)
    assert len(frames) == 4
    for frame, truth in zip(frames, truths, strict=False):
        difference = frame.frame.color.astype(int) - truth.frame.color
        assert np.abs(difference).mean() < 4
        np.testing.assert_allclose(frame.boxes, truth.frame.boxes)
        seen = frame.frame.base_from_camera.inverse().apply(frame.centers)
        np.testing.assert_allclose(seen, truth.centers, atol=1e-6)
        depth = truth.depth[frame.frame.depth_mm > 0]
        measured = frame.frame.depth_mm[frame.frame.depth_mm > 0] / 1000
        assert np.median(np.abs(measured - depth)) < 0.05


@pytest.mark.slow
def test_what_is_there_is_not_rendered_again_unless_it_was_made_otherwise(folder: Path):
    told: list[int] = []
    FrameSet(folder, "test", 3, 6).render(1, told.append)
    assert told == [1]
    scene = Scene(folder / "test-3", "test", 3, 0)
    arrays = scene.arrays() | {"recipe": -1}
    np.savez(scene.truth, **arrays)
    told.clear()
    FrameSet(folder, "test", 3, 6).render(1, told.append)
    assert told == [0, 1]
