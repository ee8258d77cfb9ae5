"""How fast the simulated robot is, with its camera and without.

One call of a contender is 0.2 s of simulated time on the spot, turning: a picture, two scans and
twenty ticks.
"""

from collections.abc import Callable

import sapien
from sapien import physx

from robots.husky.spec import HUSKY
from schemas.motion import BaseCommand
from sim.base import BaseBody
from sim.driver import TICK_NS, TICK_S, SapienDriver
from sim.obstacles import add_obstacles
from sim.scenes.model import World
from sim.world import make_world
from tests.benchmarks.rows import Row, compared
from tests.benchmarks.timing import interleaved

WITH, WITHOUT, PHYSICS = "with camera", "the same without camera", "SAPIEN's physics alone"

_period_ns = round(1e9 / HUSKY.camera.rate_hz)
_ticks = _period_ns // TICK_NS
_drift = 3.0


def measure(rounds: int) -> list[Row]:
    """Needs a Vulkan device."""
    world = make_world("hydrant", 0)
    seeing, blind = (SapienDriver(HUSKY, world, camera=camera) for camera in (True, False))
    spent = interleaved(
        {
            WITH: lambda: _turn(seeing),
            WITHOUT: lambda: _turn(blind),
            PHYSICS: _bare_physics(world),
        },
        rounds,
    )
    seeing.close()
    blind.close()
    return [
        compared(
            "sim with camera 320x240",
            "pictures",
            "1/s",
            1 / spent[WITH],
            (WITHOUT, 1 / spent[WITHOUT]),
            drift=_drift,
            better="higher",
        ),
        compared(
            "sim without camera",
            "driver steps of 10 ms",
            "1/s",
            _ticks / spent[WITHOUT],
            (PHYSICS, _ticks / spent[PHYSICS]),
            drift=_drift,
            better="higher",
        ),
    ]


def _turn(driver: SapienDriver) -> None:
    now_ns = driver.stamp_ns
    driver.command(BaseCommand(stamp_ns=now_ns, linear=0.0, angular=0.5, valid_ms=1000))
    driver.step(now_ns + _period_ns)


def _bare_physics(world: World) -> Callable[[], None]:
    """Steps the same bodies, with nothing that senses or commands."""
    scene = sapien.Scene([physx.PhysxCpuSystem()])
    scene.set_timestep(TICK_S)
    add_obstacles(scene, world)
    BaseBody(scene, HUSKY, world.world_from_start, visible=False)

    def step() -> None:
        for _ in range(_ticks):
            scene.step()

    return step
