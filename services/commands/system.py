"""Verbs that start things."""

import sys
from pathlib import Path
from typing import Annotated

import tyro

from schemas.errors import MissingComponentError, UserError
from schemas.run import RunConfig
from schemas.task import InstructionStatus, TaskState
from services.commands.detectors import chosen
from services.commands.exit_codes import of_status
from services.commands.output import say

DEMOS: dict[str, tuple[str, str, str]] = {
    "hydrant": ("husky", "hydrant", "go to the hydrant behind the cone"),
}
"""Name: robot, world, instruction."""


def up(
    robot: str = "husky",
    world: str = "hydrant",
    seed: int = 0,
    particles: int = 100,
    no_web: bool = False,
    no_record: bool = False,
    port: int = 8080,
    camera: str = "",
    calibration: Path | None = None,
    tags: Path | None = None,
    say: str | None = None,
    exit_when_done: bool = False,
    realm: str = "default",
    detector: tuple[Path, ...] = (),
    classes: tuple[Path, ...] = (),
    no_adaptive: bool = False,
) -> int:
    """Start a system and supervise it until Ctrl-C.

    Args:
        robot: one of 'incognita robots'.
        world: one of 'incognita worlds', or a world file.
        seed: decides the world, the noise and every random choice.
        particles: number of map hypotheses.
        no_web: without the page.
        no_record: without a log.
        port: of the page; the next free one is taken if it is in use.
        camera: pictures from outside instead of a simulated robot, to try perception on: the number
            of a camera, /dev/videoN, an rtsp:// or http:// address, a video, or a folder of
            pictures.
        calibration: JSON file with the lens of that camera.
        tags: JSON file that says which AprilTag hangs in which place.
        say: an instruction to send when everything is ready.
        exit_when_done: end with that instruction, and with its exit code.
        realm: isolates parallel systems on this machine.
        detector: ONNX files of other networks that find objects; several work as one.
        classes: a file with the class names of each, where they do not say them themselves.
        no_adaptive: perception looks at all of every picture, whatever is asked for.
    """
    from robots.catalogue import get_robot
    from sim.node import require_pictures
    from sim.world import make_world

    get_robot(robot)
    if camera:
        _require_pictures_of(camera)
    else:
        require_pictures(robot)
        make_world(world, seed)
    if exit_when_done and not say:
        raise UserError("--exit-when-done needs an instruction: add --say TEXT")
    detectors, detector_classes = chosen(detector, classes)
    run = RunConfig(
        robot=robot,
        world=world,
        seed=seed,
        particles=particles,
        realm=realm,
        detectors=detectors,
        detector_classes=detector_classes,
        adaptive=not no_adaptive,
        camera=_absolute(camera),
        camera_calibration=str(calibration.resolve()) if calibration else "",
        tags=str(tags.resolve()) if tags else "",
        web_port=port,
    )
    return _serve(run, not no_web, not no_record, say, exit_when_done)


def demo(
    name: Annotated[str | None, tyro.conf.Positional] = None,
    seed: int = 0,
    particles: int = 100,
    no_web: bool = False,
    no_record: bool = False,
    port: int = 8080,
    exit_when_done: bool = False,
    realm: str = "default",
    detector: tuple[Path, ...] = (),
    classes: tuple[Path, ...] = (),
    no_adaptive: bool = False,
) -> int:
    """Start a system with a prepared world and instruction.

    Args:
        name: of the demonstration; without one they are listed.
        seed: decides the world, the noise and every random choice.
        particles: number of map hypotheses.
        no_web: without the page.
        no_record: without a log.
        port: of the page; the next free one is taken if it is in use.
        exit_when_done: end with the instruction, and with its exit code.
        realm: isolates parallel systems on this machine.
        detector: ONNX files of other networks that find objects; several work as one.
        classes: a file with the class names of each, where they do not say them themselves.
        no_adaptive: perception looks at all of every picture, whatever is asked for.
    """
    if name is None:
        for known, (robot, world, text) in DEMOS.items():
            print(f"{known}: {robot} in world {world}, {text!r}")
        return 0
    if name not in DEMOS:
        raise UserError(f"unknown demo {name!r}; demos are: {', '.join(DEMOS)}")
    robot, world, text = DEMOS[name]
    return up(
        robot=robot,
        world=world,
        seed=seed,
        particles=particles,
        no_web=no_web,
        no_record=no_record,
        port=port,
        say=text,
        exit_when_done=exit_when_done,
        realm=realm,
        detector=detector,
        classes=classes,
        no_adaptive=no_adaptive,
    )


def _require_pictures_of(camera: str) -> None:
    """Say at once what is wrong with a source, and not by a process that dies."""
    from services.perception.camera.source import open_source

    open_source(camera).close()


def _absolute(camera: str) -> str:
    """A path as seen from wherever the camera's process runs."""
    is_path = camera and not camera.isdigit() and Path(camera).exists()
    return str(Path(camera).resolve()) if is_path else camera


def _serve(run: RunConfig, web: bool, record: bool, text: str | None, exit_when_done: bool) -> int:
    from services.runtime.system import (
        System,
        chosen_processes,
        page_address,
        prepared,
        stop_on_signals,
    )

    wanted = run.web_port
    run = prepared(run, Path("runs"), web=web, record=record)
    if web and run.web_port != wanted:
        say(f"port {wanted} is in use: the page is on {run.web_port}")
    system = System(run, say, chosen_processes(run))
    stop_on_signals(system.stop_requested)
    say(f"starting {run.robot} in world {run.world} (realm {run.realm}) ...")

    def announce() -> None:
        print(f"ready: {page_address(run) or 'no page'}", flush=True)
        if text:
            say(f"say: {text}")

    try:
        status = system.serve(text, exit_when_done=exit_when_done, on_ready=announce)
    except MissingComponentError as error:
        raise MissingComponentError(str(error).removeprefix("incognita: ")) from error
    _tell_end(status, run.log)
    return of_status(status) if exit_when_done else 0


def _tell_end(status: InstructionStatus | None, log: str) -> None:
    if status is not None:
        mark = "done" if status.state is TaskState.SUCCEEDED else str(status.state)
        print(f"{mark}: {status.text!r}: {status.reason}", file=sys.stderr)
    if log:
        print(f"log: {log}", file=sys.stderr)
