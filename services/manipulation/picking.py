"""From a thing to the motions that take it: all planned before the arm moves."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np
from numpy.random import Generator

from robots.arm import ArmSpec
from robots.arm_kinematics import inverse_of, matrix
from schemas.arrays import Floats
from schemas.task import HandlingFailure
from services.manipulation.collision import ArmCollision, Held
from services.manipulation.errors import RefusalError
from services.manipulation.grasps import Grasps, Thing, candidates
from services.manipulation.holding import grip_opening
from services.manipulation.inverse import Solutions, inverse, representations
from services.manipulation.motions import free_motion, smooth_motion
from services.manipulation.obstacles import Obstacle
from services.manipulation.straight import flange_frames, straight, tool_frame
from services.manipulation.timing import Motion

NEAR_CLEARANCE = 0.004
"""Kept from everything while the hand is at the thing [m]."""
_backs = (0.18, 0.10)
"""From where the hand begins its straight way to the thing, the first that can be reached [m]."""
_lifts = (0.35, 0.28, 0.22, 0.16)
"""Heights to which the thing is lifted, the first that can be reached [m]."""
_wanted = 6
"""Reachable candidates that are compared."""
_most_tries = 1000
"""Postures that are tried before the thing is given up."""
_slow = 0.5
"""Share of the arm's speed with which the hand goes to the thing and lifts it."""


@dataclass(frozen=True)
class Pick:
    """The motions, in order. The gripper opens before `approach`, and shuts before `lift`."""

    approach: Motion
    descend: Motion
    lift: Motion
    opening: float
    """Gap to go to the thing with [m]."""
    grip: float
    """Gap to command in order to hold it [m]."""
    width: float
    """Of the thing between the fingers [m]."""
    held: Held
    """The thing in the hand, for motions that follow."""


@dataclass(frozen=True)
class _Reach:
    """A candidate that the arm can carry out."""

    down: Floats
    """Postures from before the thing to the thing (N, 6) [rad]."""
    up: Floats
    """Postures from there on (M, 6) [rad]."""
    tool: Floats
    """`base_from_tool` (4, 4) at the thing."""
    width: float
    opening: float
    clearance: float


def plan_pick(
    arm: ArmSpec,
    thing: Thing,
    obstacles: Sequence[Obstacle],
    start: Floats,
    rng: Generator,
    points: Floats | None = None,
    skip: int = 0,
) -> Pick:
    """Motions that take a thing.

    Args:
        arm: with which.
        thing: what to take.
        obstacles: everything else, in the frame of the base.
        start: where the joints are (6,) [rad].
        rng: for the search.
        points: surfaces seen around the thing (P, 3) in the base frame [m].
        skip: candidates that were tried in vain.

    Raises:
        RefusalError: it is too big or out of reach, something is in the way, or no way was found.
    """
    grasps = candidates(arm.gripper, thing, points)
    reaches = sorted(
        _reaches(arm, grasps, thing, obstacles, start, skip), key=lambda one: -one.clearance
    )
    everything = [*obstacles, Obstacle(thing.kind, thing.base_from_box, thing.size, "thing itself")]
    approach = _approach(arm, everything, start, reaches, rng)
    chosen = min(reaches, key=lambda one: float(np.abs(one.down[0] - approach.positions[-1]).max()))
    return _assembled(arm, thing, obstacles, approach, chosen)


def _approach(
    arm: ArmSpec,
    obstacles: Sequence[Obstacle],
    start: Floats,
    reaches: Sequence[_Reach],
    rng: Generator,
) -> Motion:
    """To where the hand goes down from; in narrow places by the best candidate alone, and closer.

    Raises:
        RefusalError: no way was found.
    """
    before = np.array([one.down[0] for one in reaches])
    wide = ArmCollision(arm, obstacles, max(one.opening for one in reaches))
    try:
        return free_motion(arm, wide, start, before, rng)
    except RefusalError:
        near = ArmCollision(arm, obstacles, reaches[0].opening, clearance=NEAR_CLEARANCE)
        return free_motion(arm, near, start, before[:1], rng)


def _assembled(
    arm: ArmSpec, thing: Thing, obstacles: Sequence[Obstacle], approach: Motion, reach: _Reach
) -> Pick:
    # Between the postures that were tested the rounded way may come a little nearer.
    near = ArmCollision(arm, obstacles, reach.opening, clearance=NEAR_CLEARANCE / 2)
    return Pick(
        approach=approach,
        descend=smooth_motion(arm, near, reach.down, _slow),
        lift=smooth_motion(arm, near, reach.up, _slow),
        opening=reach.opening,
        # Pads that close askew turn a thing until its narrow side lies flat between them.
        grip=grip_opening(min(reach.width, *thing.size[:2].tolist())),
        width=reach.width,
        held=_held(arm, thing, reach.tool),
    )


def _reaches(
    arm: ArmSpec,
    grasps: Grasps,
    thing: Thing,
    obstacles: Sequence[Obstacle],
    start: Floats,
    skip: int,
) -> list[_Reach]:
    """The first candidates that can be reached, gone down to and lifted from without touching.

    Raises:
        RefusalError: there is none.
    """
    answers = inverse(arm, flange_frames(arm, grasps.base_from_tool))
    if not answers.valid.any():
        where = thing.base_from_box[:3, 3] - np.array(arm.base_from_foot.position)
        raise RefusalError(
            HandlingFailure.UNREACHABLE,
            f"it is {np.linalg.norm(where):.2f} m from the arm's foot, and no posture takes the "
            "hand there",
        )
    found: list[_Reach] = []
    reason, last = "", -1
    nears: dict[float, ArmCollision] = {}
    for index, posture in islice(_tries(arm, answers, start), _most_tries):
        if len(found) >= _wanted + skip:
            break
        if index == last:
            continue
        # Bodies are costly to make; the fingers' gap counts to the millimetre.
        opening = math.ceil(float(grasps.openings[index]) * 1e3) / 1e3
        near = nears.get(opening) or ArmCollision(arm, obstacles, opening, clearance=NEAR_CLEARANCE)
        nears[opening] = near
        try:
            found.append(_reach(arm, near, grasps, index, posture))
            last = index
        except RefusalError as refusal:
            # The best candidate's reason says most.
            reason = reason or refusal.reason
    if len(found) <= skip:
        reason = reason or "all ways to take it were tried"
        raise RefusalError(HandlingFailure.GOAL_IN_COLLISION, f"it cannot be taken: {reason}")
    return found[skip:]


def _tries(arm: ArmSpec, answers: Solutions, start: Floats) -> Iterator[tuple[int, Floats]]:
    """Candidates by number, each with the two postures that are nearest to where the arm is."""
    for index, (joints, valid) in enumerate(zip(answers.joints, answers.valid, strict=True)):
        postures = representations(arm, joints[valid], start)
        order = np.argsort(np.abs(postures - start).max(axis=1), kind="stable")
        yield from ((index, posture) for posture in postures[order[:2]])


def _reach(arm: ArmSpec, near: ArmCollision, grasps: Grasps, index: int, posture: Floats) -> _Reach:
    """A candidate with its ways down and up.

    Raises:
        RefusalError: one of them is not free.
    """
    tool, opening = grasps.base_from_tool[index], float(grasps.openings[index])
    _require_free(near, posture[None])
    back = _straight(arm, near, posture, -tool[:3, 2], _backs)
    up = _straight(arm, near, posture, np.array([0.0, 0.0, 1.0]), _lifts)
    width = float(grasps.widths[index])
    return _Reach(back[::-1], up, tool, width, opening, near.clearance(posture))


def _straight(
    arm: ArmSpec,
    near: ArmCollision,
    posture: Floats,
    direction: Floats,
    lengths: tuple[float, ...],
) -> Floats:
    """Away in a direction (3,) of the base, by the first of the lengths that can be gone.

    Raises:
        RefusalError: by none of them.
    """
    refused = RefusalError(HandlingFailure.NO_PATH, "the hand cannot go straight")
    for length in lengths:
        end = tool_frame(arm, posture)
        end[:3, 3] += length * direction
        try:
            way = straight(arm, posture, end)
            _require_free(near, way)
        except RefusalError as refusal:
            refused = refusal
        else:
            return way
    raise refused


def _require_free(collision: ArmCollision, way: Floats) -> None:
    for joints in way:
        if not collision.free(joints):
            raise RefusalError(HandlingFailure.NO_PATH, collision.touching(joints))


def _held(arm: ArmSpec, thing: Thing, base_from_tool: Floats) -> Held:
    tool_from_thing = inverse_of(base_from_tool) @ thing.base_from_box
    return Held(thing.kind, matrix(arm.flange_from_tool) @ tool_from_thing, thing.size)
