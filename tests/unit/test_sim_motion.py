import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robots.husky.spec import HUSKY
from robots.kinematics import base_speeds, limited, moved, ramped, wheel_speeds
from schemas.geometry import Pose2
from schemas.motion import BaseCommand
from sim.governor import BaseGovernor
from sim.slip import generator, measured_motion, next_slip

speed = st.floats(-2, 2)


@given(speed, speed)
def test_wheel_speeds_and_base_speeds_are_inverse(linear, angular):
    wheels = wheel_speeds(HUSKY.base, linear, angular)
    assert base_speeds(HUSKY.base, *wheels) == pytest.approx((linear, angular), abs=1e-9)


@given(speed, speed, st.floats(0.01, 2))
def test_driving_twice_half_as_long_is_driving_once(linear, angular, duration):
    start = Pose2(1.0, -2.0, 0.3)
    once = moved(start, linear, angular, duration)
    half = moved(start, linear, angular, duration / 2)
    twice = moved(half, linear, angular, duration / 2)
    assert (twice.x, twice.y) == pytest.approx((once.x, once.y), abs=1e-9)


@given(st.floats(), st.floats())
def test_limited_speeds_are_finite_and_within_limits(linear, angular):
    forward, turning = limited(HUSKY.limits, linear, angular)
    assert abs(forward) <= HUSKY.limits.linear_speed + 1e-9
    assert abs(turning) <= HUSKY.limits.angular_speed + 1e-9


def test_limits_keep_the_curvature():
    forward, turning = limited(HUSKY.limits, 4.0, 2.0)
    assert forward / turning == pytest.approx(2.0)


@given(speed, speed, st.floats(0.1, 5))
def test_a_ramp_never_jumps_and_never_overshoots(current, target, rate):
    after = ramped(current, target, rate, 0.1)
    assert abs(after - current) <= rate * 0.1 + 1e-12
    assert min(current, target) - 1e-12 <= after <= max(current, target) + 1e-12


def command(linear, valid_ms=300):
    return BaseCommand(stamp_ns=0, linear=linear, angular=0.0, valid_ms=valid_ms)


def run(governor, seconds, start_s=0.0):
    for tick in range(round(seconds * 100)):
        governor.advance(round((start_s + tick / 100) * 1e9), 0.01)
    return governor.linear


def test_a_command_expires_whatever_it_says():
    governor = BaseGovernor(HUSKY.limits)
    governor.take(command(0.5, valid_ms=60_000), 0)
    assert run(governor, 0.3) == pytest.approx(0.5)
    assert run(governor, 1.0, start_s=0.3) == 0.0


def test_the_latch_stops_and_a_release_brings_no_command_back():
    governor = BaseGovernor(HUSKY.limits)
    governor.take(command(0.5), 0)
    run(governor, 0.25)
    governor.latch(True)
    governor.take(command(0.5), 250_000_000)
    assert run(governor, 0.29, start_s=0.25) == 0.0
    governor.latch(False)
    assert run(governor, 0.2, start_s=0.54) == 0.0


def test_drift_grows_with_the_way_and_standing_still_does_not_drift():
    noise = HUSKY.odometry
    rng = np.random.default_rng(0)
    assert measured_motion(Pose2(0, 0, 0), noise, rng) == Pose2(0, 0, 0)

    def deviation(metres):
        ends = [
            sum(measured_motion(Pose2(0.1, 0, 0), noise, rng).x for _ in range(metres * 10))
            for _ in range(300)
        ]
        return np.var(ends)

    assert deviation(1) == pytest.approx(noise.variance_per_metre, rel=0.35)
    assert deviation(4) == pytest.approx(4 * noise.variance_per_metre, rel=0.35)


def test_slip_stays_small_and_streams_are_independent_and_repeatable():
    slip, seen = (0.0, 0.0), []
    for tick in range(2000):
        slip = next_slip(slip, generator(1, "slip", tick), 0.01)
        seen.append(slip[0])
    assert 0.005 < np.std(seen) < 0.04
    assert math.isfinite(slip[1])
    assert generator(1, "slip", 5).normal() == generator(1, "slip", 5).normal()
    assert generator(1, "slip", 5).normal() != generator(1, "laser", 5).normal()
