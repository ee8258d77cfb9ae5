"""Verbs that start things."""

import sys
from pathlib import Path
from typing import Annotated

import tyro

from schemas.errors import MissingComponentError, UserError
from schemas.run import RunConfig
from schemas.task import InstructionStatus, TaskState
from services.commands.exit_codes import of_status
from services.commands.output import say
from services.commands.run_options import (
    DEFAULTS,
    NO_SOURCE,
    RunOptions,
    SourceOptions,
    config_of,
)

DEMOS: dict[str, tuple[str, str, str]] = {
    "hydrant": ("husky", "hydrant", "go to the hydrant behind the cone"),
    "box": ("husky_ur5", "box_indoor", "retrieve the ball inside the box"),
}
"""Name: robot, world, instruction."""


def up(
    robot: str = "husky",
    world: str = "hydrant",
    system: RunOptions = DEFAULTS,
    source: SourceOptions = NO_SOURCE,
    no_web: bool = False,
    say: str | None = None,
    exit_when_done: bool = False,
) -> int:
    """Start a system and supervise it until Ctrl-C.

    Args:
        robot: one of 'incognita robots'.
        world: one of 'incognita worlds', or a world file.
        system: how it runs.
        source: where pictures come from.
        no_web: without the page.
        say: an instruction to send when everything is ready.
        exit_when_done: end with that instruction, and with its exit code.
    """
    from robots.catalogue import get_robot
    from sim.node import require_pictures
    from sim.world import make_world

    get_robot(robot)
    if not source.camera:
        require_pictures(robot)
        make_world(world, system.seed)
    if exit_when_done and not say:
        raise UserError("--exit-when-done needs an instruction: add --say TEXT")
    run = config_of(robot, world, system, source)
    return _serve(run, not no_web, not system.no_record, say, exit_when_done)


def demo(
    name: Annotated[str | None, tyro.conf.Positional] = None,
    system: RunOptions = DEFAULTS,
    no_web: bool = False,
    exit_when_done: bool = False,
) -> int:
    """Start a system with a prepared world and instruction.

    Args:
        name: of the demonstration; without one they are listed.
        system: how it runs.
        no_web: without the page.
        exit_when_done: end with the instruction, and with its exit code.
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
        system=system,
        no_web=no_web,
        say=text,
        exit_when_done=exit_when_done,
    )


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
