"""Verbs that run experiments."""

from pathlib import Path
from typing import Literal

from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from schemas.errors import UserError
from schemas.run import RunConfig
from schemas.task import InstructionStatus
from services.commands import exit_codes
from services.commands.detectors import chosen
from services.commands.output import print_json

Arm = Literal["ours", "known", "without_language", "frontier"]


def episode(
    say: str,
    robot: str = "husky",
    world: str = "hydrant",
    arm: Arm = "ours",
    seed: int = 0,
    particles: int = 100,
    log: Path | None = None,
    detector: tuple[Path, ...] = (),
    classes: tuple[Path, ...] = (),
    no_adaptive: bool = False,
    json: bool = False,
) -> int:
    """One episode in lockstep, as fast as it computes.

    A robot whose cameras cannot be drawn yet, as the wheelchair, has its perception modelled.

    Args:
        say: the instruction.
        robot: one of 'incognita robots'.
        world: one of 'incognita worlds', or a world file.
        arm: how the robot is run.
        seed: decides the world, the noise and every random choice.
        particles: number of map hypotheses.
        log: MCAP file to write.
        detector: ONNX files of other networks that find objects; several work as one.
        classes: a file with the class names of each, where they do not say them themselves.
        no_adaptive: perception looks at all of every picture, whatever is asked for.
        json: one JSON document on stdout.
    """
    from robots.catalogue import get_robot
    from sim import vulkan
    from sim.world import make_world

    get_robot(robot)
    make_world(world, seed)
    vulkan.activate()
    from sim.experiments.episode import DRAWN, run_episode

    if detector and robot not in DRAWN:
        raise UserError(
            f"--detector looks at pictures, and those of {robot} cannot be drawn yet; "
            f"allowed with it: --robot {' or '.join(sorted(DRAWN))}"
        )
    detectors, detector_classes = chosen(detector, classes)
    run = RunConfig(
        robot=robot,
        world=world,
        seed=seed,
        particles=particles,
        detectors=detectors,
        detector_classes=detector_classes,
        adaptive=not no_adaptive,
    )
    console = Console(stderr=True)
    with Progress(
        SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn(), console=console
    ) as bar:
        task = bar.add_task("preparing", total=None)

        def progress(seconds: float, status: InstructionStatus | None) -> None:
            doing = status.reason if status else "listening"
            bar.update(task, description=f"{seconds:5.0f} s simulated: {doing}")

        result = run_episode(run, say, log, progress, arm)
    if json:
        print_json(result)
    else:
        for name, value in result.items():
            print(f"{name}: {value}")
    if result["success"]:
        return exit_codes.DONE
    misunderstood = result["failure"] == "not_understood"
    return exit_codes.NOT_UNDERSTOOD if misunderstood else exit_codes.WITHOUT_SUCCESS
