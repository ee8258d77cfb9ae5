"""Forms of objects: what they are learned from, how they are kept, and what they are used for."""

import math
from pathlib import Path

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from schemas.geometry import Pose2, Pose3
from services.perception.errors import PerceptionError
from services.perception.space.forms import ANY, Forms, default_forms, read_forms, write_forms
from services.perception.space.surface import MEASURES, Surface
from services.perception.training.forms.data import level_from, upright_box
from services.perception.training.forms.fit import Example, learn_forms


def box_corners(center: np.ndarray, size: np.ndarray, yaw: float) -> np.ndarray:
    signs = np.stack(np.meshgrid(*[(-0.5, 0.5)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    turned = Pose2(0.0, 0.0, yaw).lifted().rotation()
    return center + (signs * size) @ turned.T


@given(
    yaw=st.floats(-1.5, 1.5),
    length=st.floats(0.3, 2.0),
    width=st.floats(0.05, 0.25),
    height=st.floats(0.05, 1.0),
)
def test_the_upright_box_around_a_box_is_that_box(
    yaw: float, length: float, width: float, height: float
):
    center, size = np.array([2.0, -1.0, 0.5]), np.array([length, width, height])
    found_center, found_size, found_yaw = upright_box(box_corners(center, size, yaw))
    np.testing.assert_allclose(found_center, center, atol=1e-9)
    np.testing.assert_allclose(found_size, size, atol=1e-9)
    off = (found_yaw - yaw + math.pi / 2) % math.pi - math.pi / 2
    assert abs(off) < 1e-6


@settings(deadline=None)
@given(yaw=st.floats(-3.1, 3.1), pitch=st.floats(-0.3, 0.8), height=st.floats(0.2, 1.5))
def test_the_base_under_a_camera_is_level_and_looks_as_it_does(
    yaw: float, pitch: float, height: float
):
    half = pitch / 2
    tilt = Pose3((0.0, 0.0, 0.0), (math.cos(half), 0.0, math.sin(half), 0.0))
    optical = Pose3((0.0, 0.0, 0.0), (0.5, -0.5, 0.5, -0.5))
    world_from_camera = Pose2(3.0, 1.0, yaw).lifted() @ Pose3((0, 0, height), (1, 0, 0, 0))
    world_from_camera = world_from_camera @ tilt @ optical
    base_from_camera = level_from(world_from_camera)
    np.testing.assert_allclose(base_from_camera.position, (0.0, 0.0, height), atol=1e-9)
    ahead = base_from_camera.rotation()[:, 2]
    assert ahead[1] == pytest.approx(0.0, abs=1e-9)
    assert ahead[0] > 0


def drawn(label: str, count: int, behind: float, rng: np.random.Generator) -> list[Example]:
    """Things whose middle lies `behind` times their width behind the surface, give or take."""
    found: list[Example] = []
    for _ in range(count):
        measures = np.zeros(len(MEASURES))
        width, depth = rng.uniform(0.2, 0.6), rng.uniform(1.0, 6.0)
        values = {"one": 1.0, "width": width, "mean_width": width, "fill": 0.9, "high": 0.8}
        for name, value in values.items():
            measures[MEASURES.index(name)] = value
        bearing = rng.uniform(-0.5, 0.5)
        toward = np.array([math.cos(bearing), math.sin(bearing)])
        anchor = np.array([*(depth * toward), 0.0])
        surface = Surface(anchor[None], depth, toward, anchor, measures)
        middle = surface.axes @ [behind * width + rng.normal(0, 0.02), rng.normal(0, 0.01), 0.4]
        size = np.array([width, width, 0.8])
        found.append(Example(label, surface, anchor + middle, size))
    return found


def test_every_class_has_its_own_depth_and_strangers_the_mean():
    rng = np.random.default_rng(0)
    table = learn_forms(drawn("drum", 200, 0.5, rng) + drawn("screen", 200, 0.1, rng), "drawn")
    forms = Forms(table)
    for label, behind in (("drum", 0.5), ("screen", 0.1), ("teapot", 0.3)):
        (one,) = drawn("drum", 1, behind, np.random.default_rng(1))
        along = one.surface.axes[:, 0] @ (forms.place(one.surface, label).center - one.center)
        assert abs(along) < (0.08 if label == "teapot" else 0.05), label


def test_classes_with_few_examples_are_left_to_any():
    rng = np.random.default_rng(0)
    table = learn_forms(drawn("drum", 60, 0.5, rng) + drawn("rare", 5, 0.5, rng), "drawn")
    assert set(table.forms) == {ANY, "drum"}


def test_deviation_follows_the_scatter_that_was_seen():
    rng = np.random.default_rng(3)
    forms = Forms(learn_forms(drawn("drum", 400, 0.5, rng), "drawn"))
    (one,) = drawn("drum", 1, 0.5, np.random.default_rng(4))
    placed = forms.place(one.surface, "drum")
    along, across, _ = np.sqrt(np.diag(one.surface.axes.T @ placed.covariance @ one.surface.axes))
    assert along == pytest.approx(0.02, rel=0.5)
    assert across < along


def test_kept_forms_are_the_same(tmp_path: Path):
    table = learn_forms(drawn("drum", 60, 0.5, np.random.default_rng(0)), "drawn")
    write_forms(table, tmp_path / "forms.json")
    assert read_forms(tmp_path / "forms.json").table == table


def test_a_file_that_is_missing_broken_or_of_other_measures_is_refused(tmp_path: Path):
    path = tmp_path / "forms.json"
    with pytest.raises(PerceptionError, match="train forms"):
        read_forms(path)
    path.write_text("{}")
    with pytest.raises(PerceptionError, match="train forms"):
        read_forms(path)
    table = learn_forms(drawn("drum", 60, 0.5, np.random.default_rng(0)), "drawn")
    write_forms(msgspec.structs.replace(table, measures=MEASURES[:-1]), path)
    with pytest.raises(PerceptionError, match="other measures"):
        read_forms(path)


def test_the_forms_in_the_tree_know_every_class_of_the_language_that_is_small():
    known = set(read_forms(default_forms).table.forms)
    assert {"cone", "hydrant", "barrel", "ball", "box", "drill", "cracker box", ANY} <= known
