"""The map in the scene: floor, objects seen and guessed, where to go and why."""

import numpy as np
import viser

from robots.colours import BLUE, GREEN, class_colour
from schemas import topics
from schemas.arrays import Floats
from schemas.belief import MapBelief, OccupancyGrid
from schemas.geometry import Pose2
from schemas.task import Decision, Goal, GoalStatus
from web import grid_model
from web.belief_model import GoalObject, goal_object, hypothesised, modes, observed
from web.colours import cost_colours
from web.decision_model import cheapest_places
from web.layer import Layer
from web.shapes import ARROW, UNIT_CYLINDER, Instances, class_mesh, ellipse, polyline, wire_box
from web.view_model import ViewModel

_layers = {
    "grid": "Obstacles and floor",
    "looked": "Looked at, empty",
    "seen": "Seen objects",
    "guesses": "Guessed objects",
    "trajectory": "Way so far",
    "goal": "Goal",
    "path": "Planned path",
    "policy": "Candidates and costs",
}
_costs_shown = 6
_disc = UNIT_CYLINDER.scaled(0.4, 0.4, 0.03)
_node = UNIT_CYLINDER.scaled(0.12, 0.12, 0.03)
_solid_margin = 1.06
"""The goal's solid body is a little larger than the wires of the object it may stand on."""


class MapView:
    """Draws what changed since the last call, each message once."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self.layers = {name: Layer(scene, f"/{name}") for name in _layers}
        self._floor = FloorView(scene)
        self._done: dict[str, object] = {}

    def switches(self) -> dict[str, viser.FrameHandle]:
        """What can be hidden, by the title of its switch."""
        return {title: self.layers[name].frame for name, title in _layers.items()}

    def show(self, view: ViewModel) -> None:
        """Bring the scene up to date."""
        grid, belief = view.get(topics.GRID), view.get(topics.BELIEF)
        decision, goal = view.get(topics.DECISION), view.get(topics.GOAL)
        status = view.get(topics.GOAL_STATUS)
        if grid and self._changed("grid", grid):
            self._floor.show(grid)
        if belief and self._changed("belief", belief):
            self._show_trajectory(belief.trajectory)
            self._show_seen(belief)
            self._show_guesses(belief)
        if decision and self._changed("decision", (decision, view.active)):
            self._show_candidates(decision, view.active)
        if self._changed("goal", (belief, decision, goal, view.active)):
            self._show_goal(belief, decision, goal, view.active)
        if self._changed("path", (status, view.active)):
            self._show_path(status, view.active)

    def _changed(self, name: str, shown: object) -> bool:
        """Messages are immutable: another object is another message."""
        before = self._done.get(name)
        self._done[name] = shown
        if isinstance(shown, tuple) and isinstance(before, tuple):
            return any(a is not b for a, b in zip(shown, before, strict=True))
        return shown is not before

    def _show_trajectory(self, trajectory: Floats) -> None:
        layer = self.layers["trajectory"]
        with layer.redraw():
            layer.lines("edges", polyline(trajectory[:, :2], 0.03), BLUE, 0.025)
            layer.batch("nodes", _node, Instances.on_floor(trajectory[:, :2], 0.03), BLUE)

    def _show_seen(self, belief: MapBelief) -> None:
        layer = self.layers["seen"]
        with layer.redraw():
            for seen in observed(belief):
                colour = class_colour(seen.name)
                wires = wire_box(seen.center, seen.extent)
                layer.lines(f"box/{seen.node}/{seen.name}", wires, colour, 0.03)
                top = seen.center + np.array([0, 0, seen.extent[2] / 2 + 0.08])
                layer.label(f"name/{seen.node}", f"{seen.name} {seen.probability:.2f}", top)

    def _show_guesses(self, belief: MapBelief) -> None:
        layer = self.layers["guesses"]
        with layer.redraw():
            for name, guesses in hypothesised(belief).items():
                layer.translucent(f"objects/{name}", class_mesh(name), guesses, class_colour(name))
            for k, mode in enumerate(m for m in modes(belief) if not m.seen):
                colour = class_colour(mode.name)
                outline = ellipse(mode.mean, mode.covariance, 2.0, 0.03)
                layer.lines(f"mode/{k}/{mode.name}", outline, colour, 0.03)
                south = mode.mean - np.array([0, 2 * np.sqrt(mode.covariance[1, 1]) + 0.1])
                text = f"{mode.name}? {mode.mass:.2f}"
                layer.label(f"name/{k}", text, np.array([*south, 0.05]), 0.75)

    def _show_candidates(self, decision: Decision, active: bool) -> None:
        layer = self.layers["policy"]
        positions, costs = cheapest_places(decision)
        with layer.redraw():
            if not active:
                return
            discs = Instances.on_floor(positions, 0.04)
            layer.batch("discs", _disc, discs, cost_colours(costs))
            for k, (position, cost) in enumerate(zip(positions, costs, strict=True)):
                if k < _costs_shown:
                    layer.label(f"cost/{k}", f"{cost:.1f}", np.array([*position, 0.12]), 0.65)

    def _show_goal(
        self,
        belief: MapBelief | None,
        decision: Decision | None,
        goal: Goal | None,
        active: bool,
    ) -> None:
        meant = goal_object(belief, decision) if belief and decision else None
        with self.layers["goal"].redraw():
            if goal and active:
                self._show_target(goal.map_from_goal)
            if meant:
                self._show_meant(meant)

    def _show_target(self, at: Pose2) -> None:
        layer = self.layers["goal"]
        position = np.array([at.x, at.y, 0.06])
        layer.solid("target", ARROW.scaled(0.5, 0.42, 0.05), GREEN, position, at.yaw)

    def _show_meant(self, meant: GoalObject) -> None:
        """The object that the robot is after, solid, with the mass that it is the one."""
        mode, (x, y) = meant.mode, meant.position
        layer, extent = self.layers["goal"], mode.extent * _solid_margin
        body = class_mesh(mode.name).scaled(*extent.tolist())
        layer.solid("meant", body, class_colour(mode.name), np.array([x, y, extent[2] / 2]))
        text = f"GOAL {mode.name} {mode.mass:.2f}"
        layer.label("name", text, np.array([x, y, extent[2] + 0.3]), 1.0)

    def _show_path(self, status: GoalStatus | None, active: bool) -> None:
        layer = self.layers["path"]
        with layer.redraw():
            if status and active and len(status.path) > 1:
                layer.lines("line", polyline(status.path, 0.05), GREEN, 0.07)


class FloorView:
    """The occupancy grid and what was looked at, as two pictures on the floor."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene = scene
        self._shape: object = None
        self._images: list[viser.ImageHandle] = []

    def show(self, grid: OccupancyGrid) -> None:
        """Draw the grid; only a grid that grew makes new objects in the browser."""
        obstacles = grid_model.magnified(grid_model.occupancy_picture(grid), grid.resolution)
        pictures = [obstacles, grid_model.looked_picture(grid)]
        shape = (grid.occupancy.shape, grid.origin, grid.resolution)
        if shape == self._shape:
            for image, picture in zip(self._images, pictures, strict=True):
                image.image = picture
            return
        self._shape = shape
        names = ("/grid/picture", "/looked/picture")
        (width, height), (x, y) = grid_model.size_m(grid), grid_model.center(grid)
        self._images = [
            self._scene.add_image(
                name,
                picture,
                width,
                height,
                format="png",
                position=(x, y, 0.004 * (k + 1)),
                cast_shadow=False,
                receive_shadow=False,
            )
            for k, (name, picture) in enumerate(zip(names, pictures, strict=True))
        ]
