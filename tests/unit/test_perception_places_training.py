# ruff: noqa: E402
"""Figures and fitting of the classifier of places; the rest needs torch, which may be missing."""

from pathlib import Path

import numpy as np
import pytest

from services.perception.places.card import PlacesCard
from services.perception.places.classifier import softmax
from services.perception.training.places.frames import PlacePicture
from services.perception.training.places.measurement import Looks, even, figures, fitted
from sim.scenes.rooms import ROOM_KINDS

TYPES = len(ROOM_KINDS)


def looks(overconfident: float, pictures: int = 1200, windows: int = 3) -> Looks:
    """Three windows that all say what one look does, with logits that many times too large."""
    rng = np.random.default_rng(1)
    truth = rng.integers(0, TYPES, pictures).astype(np.int32)
    honest = rng.normal(0, 1, (pictures, TYPES))
    honest[np.arange(pictures), truth] += 2.0
    # Of unit noise and a step of two, the exact log likelihood ratio is twice the value.
    said = np.repeat(2 * overconfident * honest[:, None], windows, axis=1)
    return Looks(said, said, truth, np.repeat(truth[:, None], windows, axis=1))


def card() -> PlacesCard:
    return PlacesCard(
        types=ROOM_KINDS,
        sha256="",
        licence="",
        data="",
        training_pictures=0,
        validation_pictures=0,
        seed=0,
        windows_seen=0,
        parameters=0,
    )


def test_fitting_takes_back_what_the_network_claims_too_much():
    found = fitted(card(), looks(overconfident=2.0))
    assert found.ahead_temperature == pytest.approx(2.0, rel=0.25)
    # Three windows that say the same are worth one.
    share = 3 ** (1 - found.pooling) / found.here_temperature
    assert share == pytest.approx(0.5, rel=0.25)


def test_figures_of_calibrated_looks_show_no_error():
    said = looks(overconfident=1.0)
    told = figures(ROOM_KINDS, softmax(said.ahead[:, 0]), said.true_here)
    assert told.looks == 1200
    assert told.calibration_error < 0.05
    assert 0.5 < told.accuracy < 1.0
    wrong = figures(ROOM_KINDS, softmax(4 * said.ahead[:, 0]), said.true_here)
    assert wrong.calibration_error > told.calibration_error
    assert wrong.surprise > told.surprise


def test_types_count_evenly():
    truth = np.array([0] * 50 + [1] * 7 + [2] * 3 + [-1] * 20, np.int32)
    chosen = truth[even(truth)]
    assert np.bincount(chosen).tolist() == [7, 7]


torch = pytest.importorskip("torch")
pytest.importorskip("onnx")

from services.perception.detection.detector import Network
from services.perception.places.windows import network_input
from services.perception.training.places.loop import (
    PlacesTraining,
    augmented,
    even_odds,
    learning_rate,
    windows_in,
)
from services.perception.training.places.network import PlacesNetwork, export_places

torch.set_num_threads(1)


def picture(kind: int) -> PlacePicture:
    rng = np.random.default_rng(kind)
    windows = rng.integers(0, 60, (3, 120, 160, 3)).astype(np.uint8)
    windows[:, :, 20 * kind : 20 * kind + 20] = 255
    return PlacePicture(windows, kind, np.array([kind, -1, kind], np.int32))


def test_loss_falls_and_a_checkpoint_continues_exactly(tmp_path: Path):
    windows = windows_in([picture(0), picture(5)])
    odds = np.ones((2, TYPES))
    training = PlacesTraining(TYPES, 0, odds)
    training.windows_seen = 2000  # past the slow first steps
    losses = [training.step(windows, 100_000) for _ in range(12)]
    assert losses[-1] < 0.8 * losses[0]
    training.save(tmp_path / "checkpoint.pt")
    again = PlacesTraining(TYPES, 1, odds)
    again.load(tmp_path / "checkpoint.pt")
    assert again.windows_seen == training.windows_seen
    assert again.rng.random() == training.rng.random()
    for one, other in zip(training.network.parameters(), again.network.parameters(), strict=True):
        assert torch.equal(one, other)


def test_rare_types_weigh_more_and_unknown_ones_nothing():
    odds = even_odds(np.array([0, 0, 0, 1, -1, -1], np.int32), 2)
    np.testing.assert_allclose(odds * [3, 1], [2, 2])


def test_augmentation_keeps_the_size_and_learning_rates_rise_then_fall():
    window = picture(2).windows[0]
    assert augmented(window, np.random.default_rng(0)).shape == window.shape
    rates = [learning_rate(seen, 50_000) for seen in range(0, 60_000, 500)]
    peak = int(np.argmax(rates))
    assert 0 < peak < 12
    assert (np.diff(rates[peak:]) <= 0).all()


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_exported_file_says_what_the_network_does(tmp_path: Path):
    torch.manual_seed(0)
    network = PlacesNetwork(TYPES).eval()
    path = tmp_path / "places.onnx"
    export_places(network, path)
    blob = network_input(picture(3).windows[0])
    with torch.no_grad():
        expected = network(torch.from_numpy(blob)).numpy()
    np.testing.assert_allclose(np.ravel(Network(path)(blob)), expected.ravel(), atol=0.01)
    assert path.stat().st_size < 1e6
    assert sum(p.numel() for p in network.parameters()) <= 300_000
