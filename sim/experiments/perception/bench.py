"""`bench perception`: quality and speed of seeing, on pictures that nothing was learned from."""

from functools import partial

import msgspec
import numpy as np
from numpy.random import Generator

from schemas.errors import MissingComponentError
from services.perception.scene import Recogniser
from services.perception.space.forms import read_forms
from sim.assets.library import DETECTED
from sim.experiments.bench_suites import suite_rows
from sim.experiments.perception.box_rows import box_rows, false_row, working_rows
from sim.experiments.perception.cycle import FRAMES, cycle_rows
from sim.experiments.perception.figures import draw
from sim.experiments.perception.found import Found, found_in
from sim.experiments.perception.frames import FOLDER, FrameSet
from sim.experiments.perception.networks import Networks, networks_of
from sim.experiments.perception.own_pictures import measure_pictures
from sim.experiments.perception.place_rows import place_rows
from sim.experiments.perception.progress import counting
from sim.experiments.perception.scene_files import RANGE_MAX
from sim.experiments.perception.space_rows import space_rows
from sim.experiments.report import Outcome, Row, Settings

EMPTY_SHARE = 2
"""For one picture of distractors alone there are so many with objects."""
SUITES = ("shader", "camera", "fiducials")
"""Of `tests.benchmarks`, besides `detector`, which is of our own network."""
ROUNDS = (3, 25)
"""Turns of each contender in them: least, and most, for as many pictures as are usual."""
PICTURES_A_ROUND = 40
_peer, _slow_peer = "onnxruntime", "without graph optimisation"
ASKED_RATIO = 1.5
"""Time of the network in OpenCV by that in onnxruntime."""


def measure(settings: Settings) -> Outcome:
    """Everything, on `settings.runs` rendered pictures; or a person's own pictures."""
    networks = networks_of(settings.detectors, settings.detector_classes)
    if settings.images is not None:
        return measure_pictures(settings.images, networks, settings)
    test, empty = _rendered(settings)
    with counting("looking", len(test)) as progress:
        found = found_in(test, networks, read_forms(), progress)
    rng = np.random.default_rng(settings.seed)
    settings.progress("time of the cycle")
    speed = _speed(test, networks, rng)
    places, about_places = place_rows(settings, FOLDER)
    suites, about_suites = _suites(settings)
    return Outcome(
        rows=(*_quality(found, networks, empty, rng), *speed, *places, *suites),
        settings=(*_told(settings, networks, test, empty), *about_places, *about_suites),
        draw=partial(draw, found),
    )  # fmt: skip


def _rendered(settings: Settings) -> tuple[FrameSet, FrameSet]:
    counts = {"test": settings.runs, "empty": max(settings.runs // EMPTY_SHARE, 1)}
    sets = [FrameSet(FOLDER, part, settings.seed, count) for part, count in counts.items()]
    for one in sets:
        with counting(f"rendering {one.part}, scenes", one.scenes) as progress:
            one.render(settings.workers, progress)
    return sets[0], sets[1]


def _quality(found: Found, networks: Networks, empty: FrameSet, rng: Generator) -> list[Row]:
    with counting("looking at distractors", len(empty)) as progress:
        inventions = 0
        for number, known in enumerate(empty, start=1):
            inventions += len(networks.working.detect(known.frame.color).scores)
            progress(number)
    return [
        *box_rows(found.faint, rng),
        *working_rows(found.working),
        false_row(inventions, len(empty)),
        *space_rows(found.placings, found.scenes, rng),
    ]


def _speed(test: FrameSet, networks: Networks, rng: Generator) -> list[Row]:
    step = max(1, len(test) // FRAMES)
    frames = [test[index].frame for index in range(0, len(test), step)][:FRAMES]
    return cycle_rows(networks, Recogniser(networks.working, read_forms(), RANGE_MAX), frames, rng)


def _suites(settings: Settings) -> tuple[list[Row], list[str]]:
    """Rows of the speed suites, and which are left out for want of what."""
    rows: list[Row] = []
    left_out: list[str] = []
    rounds = min(max(settings.runs // PICTURES_A_ROUND, ROUNDS[0]), ROUNDS[1])
    for name in SUITES if settings.detectors else (*SUITES, "detector"):
        settings.progress(name)
        try:
            rows += suite_rows([name], rounds)
        except MissingComponentError as error:
            left_out.append(f"left out: {error}")
    return rows + [ratio for row in rows if (ratio := ratio_of(row)) is not None], left_out


def ratio_of(row: Row) -> Row | None:
    """The network's time as a multiple of onnxruntime's, where a row compares the two."""
    peer = row.peer
    if peer is None or not peer.name.startswith(_peer) or peer.name.endswith(_slow_peer):
        return None
    return msgspec.structs.replace(
        row,
        metric=f"time by that of {peer.name}",
        unit="",
        ours=row.ours / peer.value,
        interval=(row.interval[0] / peer.value, row.interval[1] / peer.value),
        peer=None,
        asked=ASKED_RATIO,
    )


def _told(
    settings: Settings, networks: Networks, test: FrameSet, empty: FrameSet
) -> tuple[str, ...]:
    unknown = [name for name in DETECTED if name not in networks.working.classes]
    unseen = [name for name in networks.working.classes if name not in DETECTED]
    lines = [
        *networks.told,
        f"pictures {len(test)} and {len(empty)} of sim.dataset's sets test and empty, seed "
        f"{settings.seed}, with the depth of a camera that measures to {RANGE_MAX:g} m; kept in "
        f"{FOLDER}",
        "times of the cycle are those of the processor, one thread; those of a simulation and of "
        "what has a peer are by the wall clock",
    ]
    if unknown:
        lines.append(f"not known to the network, hence scenery: {', '.join(unknown)}")
    if unseen:
        lines.append(f"known to it, but in no picture: {', '.join(unseen)}")
    return tuple(lines)
