"""Whether the gripper holds something, told from where its fingers came to rest."""

from robots.arm import GripperSpec

SQUEEZE = 0.03
"""By how much less than the thing's width the gap is commanded [m]."""
_give = 0.006
"""Of the gap: beyond this the fingers were stopped by something [m]."""
_slack = 0.5
"""By which share of its width a thing may be narrower or wider than it looked."""


def grip_opening(width: float) -> float:
    """The gap to command in order to hold something of a width tight [m].

    The fingers then push with their stiffness times half the squeeze, well below their limit:
    saturated fingers would let the pair of them drift.
    """
    return max(0.0, width - SQUEEZE)


def fingers_gap(positions: tuple[float, float]) -> float:
    """The gap between the pads from the positions of both fingers [m]."""
    return positions[0] + positions[1]


def is_held(gripper: GripperSpec, gap: float, commanded: float, width: float) -> bool:
    """Whether what is between the fingers can be the thing.

    Args:
        gripper: whose fingers.
        gap: measured between the pads [m].
        commanded: gap that was asked for [m].
        width: of the thing between the fingers, as it was seen [m].
    """
    stopped = gap > commanded + _give and gap < gripper.opening - _give
    return stopped and abs(gap - width) < max(_slack * width, 2 * _give)
