"""The robots there are."""

from dataclasses import replace

from robots.husky.spec import HUSKY
from robots.husky_ur5.spec import HUSKY_UR5
from robots.spec import RobotSpec
from robots.wheelchair.spec import WHEELCHAIR
from schemas.errors import UserError
from schemas.run import RunConfig

ROBOTS: dict[str, RobotSpec] = {spec.name: spec for spec in (HUSKY, WHEELCHAIR, HUSKY_UR5)}


class UnknownRobotError(UserError):
    """No robot has that name; the message lists those that exist."""


def get_robot(name: str) -> RobotSpec:
    """Look up a robot.

    Raises:
        UnknownRobotError: the name is not in `ROBOTS`.
    """
    if name not in ROBOTS:
        raise UnknownRobotError(f"unknown robot {name!r}; robots are: {', '.join(ROBOTS)}")
    return ROBOTS[name]


def robot_of(run: RunConfig) -> RobotSpec:
    """The robot of a run, with the field of view that the run gives it.

    A field of view that is given is sharp to its rim and begins at the robot, as the paper's.

    Raises:
        UnknownRobotError: no robot has that name.
    """
    spec = get_robot(run.robot)
    if not run.view_range_m:
        return spec
    camera = replace(
        spec.camera,
        horizontal_fov=run.view_fov_rad,
        range_max=run.view_range_m,
        near=0.0,
        sharp_share=1.0,
        blind_share=1.02,
    )
    return replace(spec, camera=camera)
