"""All nodes of an episode: those of the process table, or some of them as models."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from robots.catalogue import robot_of
from schemas.run import RunConfig
from services.process_table import PROCESSES, Process
from services.runtime.node import Node, node_generator
from services.runtime.worker import build_node
from sim.driver import SapienDriver
from sim.experiments.body_model import BodySettings, ModelledBodies
from sim.experiments.perception_model import ModelledPerception, PerceptionSettings
from sim.node import RobotNode
from sim.world import make_world


@dataclass(frozen=True)
class Assembly:
    """Nodes by process, in the table's order, and the robot among them."""

    nodes: Mapping[Process, Node]
    driver: SapienDriver


def table_assembly(run: RunConfig) -> Assembly:
    """Every node of the table that takes part in lockstep, with the camera's pictures drawn."""
    nodes = {
        process: build_node(process, run)
        for process in PROCESSES
        if process.lockstep and process.takes_part(run)
    }
    robot = next(node for node in nodes.values() if isinstance(node, RobotNode))
    assert isinstance(robot.driver, SapienDriver)
    return Assembly(nodes, robot.driver)


def modelled_assembly(run: RunConfig, settings: PerceptionSettings) -> Assembly:
    """The same with perception modelled; body, laser and odometry are those of the simulator."""
    spec, world = robot_of(run), make_world(run.world, run.seed)
    driver = SapienDriver(spec, world, run.seed, camera=False)
    rng = node_generator(run, "perception")
    if spec.arm:
        perception: Node = ModelledBodies(world, driver, spec, BodySettings(), rng)
    else:
        perception = ModelledPerception(
            world,
            lambda: driver.world_from_base,
            spec.camera,
            settings,
            rng,
            spec.symbols.locations,
        )
    models: dict[str, Node] = {
        "robot": RobotNode(run, node_generator(run, "robot"), driver),
        "perception": perception,
    }
    nodes: dict[Process, Node] = {}
    for process in PROCESSES:
        if process.name in models:
            nodes[row_of(process, models[process.name])] = models[process.name]
        elif process.lockstep and not process.needs_places and process.takes_part(run):
            # Modelled perception recognises places too.
            nodes[process] = build_node(process, run)
    return Assembly(nodes, driver)


def row_of(process: Process, node: Node) -> Process:
    """The row of a process that a model may stand in for."""
    if process.name != "perception":
        return process
    path = f"{type(node).__module__}:{type(node).__name__}"
    return replace(process, node=path, listens=tuple(node.handlers()))
