"""The robots there are."""

from robots.husky.spec import HUSKY
from robots.spec import RobotSpec
from schemas.errors import UserError

ROBOTS: dict[str, RobotSpec] = {spec.name: spec for spec in (HUSKY,)}


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
