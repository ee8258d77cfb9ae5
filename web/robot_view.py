"""The robot in the scene, built from its description; its wheels turn."""

import math

import numpy as np
import viser

from robots.colours import Rgb
from robots.spec import RobotSpec
from schemas import topics
from schemas.arrays import Floats
from schemas.geometry import Quaternion
from schemas.sensing import JointState, LaserScan
from web.shapes import UNIT_BOX, UNIT_CYLINDER, Mesh
from web.view_model import ViewModel

_body_colour: Rgb = (62, 68, 78)
_trim_colour: Rgb = (240, 190, 30)
_rubber: Rgb = (38, 40, 46)
_hub: Rgb = (150, 156, 166)
_laser_colour: Rgb = (200, 30, 100)
_axle_along_y: Quaternion = (math.cos(math.pi / 4), math.sin(math.pi / 4), 0.0, 0.0)
_wheel_width = 0.12


class RobotView:
    """The robot's meshes hang below one frame; a move is one message to the browser."""

    def __init__(self, scene: viser.SceneApi, spec: RobotSpec) -> None:
        self._scene = scene
        self._spec = spec
        self.frame = scene.add_frame("/robot", show_axes=False)
        self._build_body()
        self._build_sensors()
        self._wheels = {name: self._build_wheel(name, *at) for name, at in _wheel_places(spec)}
        self.laser_frame = scene.add_frame("/laser", show_axes=False)
        self._laser: viser.PointCloudHandle = scene.add_point_cloud(
            "/laser/points",
            np.zeros((1, 3), np.float32),
            _laser_colour,
            point_size=0.05,
            point_shape="circle",
            point_shading="flat",
            visible=False,
        )
        self._shown_scan: LaserScan | None = None

    def show(self, view: ViewModel) -> None:
        """Move the robot, turn its wheels, draw the newest scan."""
        pose = view.map_from_base.lifted()
        self.frame.position, self.frame.wxyz = pose.position, pose.wxyz
        joints, scan = view.get(topics.JOINT_STATE), view.get(topics.SCAN)
        if joints:
            self._turn_wheels(joints)
        if scan and scan is not self._shown_scan:
            self._shown_scan = scan
            points = scan_points(scan, self._spec.laser.height)
            map_from_odom = view.map_from_odom
            points[:, :2] = map_from_odom.apply(points[:, :2])
            self._laser.visible = len(points) > 0
            if len(points):
                self._laser.points = points.astype(np.float32)

    def _turn_wheels(self, joints: JointState) -> None:
        for name, angle in zip(joints.names, joints.positions, strict=True):
            wheel = self._wheels.get(wheel_corner(name))
            if wheel:
                wheel.wxyz = (math.cos(angle / 2), 0.0, math.sin(angle / 2), 0.0)

    def _build_body(self) -> None:
        base = self._spec.base
        clearance = 0.13
        height = base.height - clearance
        middle = clearance + height / 2
        inner = base.track - _wheel_width - 0.04
        self._part(
            "body", UNIT_BOX.scaled(base.length * 0.9, inner, height), _body_colour, 0, middle
        )
        deck = UNIT_BOX.scaled(base.length * 0.72, base.width * 0.86, 0.035)
        self._part("deck", deck, _trim_colour, 0, base.height)
        bumper = UNIT_BOX.scaled(0.07, inner * 0.96, 0.1)
        for name, end in (("front", 1), ("rear", -1)):
            self._part(
                f"bumper/{name}", bumper, _trim_colour, end * base.length * 0.465, middle - 0.03
            )

    def _build_sensors(self) -> None:
        camera, laser = self._spec.camera, self._spec.laser
        x, y, z = camera.base_from_camera.position
        deck = self._spec.base.height
        mast = UNIT_BOX.scaled(0.05, 0.05, z - deck)
        self._part("mast", mast, _body_colour, x - 0.05, (z + deck) / 2)
        self._part("camera", UNIT_BOX.scaled(0.06, 0.16, 0.06), _hub, x, z)
        puck = UNIT_CYLINDER.scaled(0.11, 0.11, 0.08)
        self._part("laser", puck, _rubber, laser.base_from_laser.x, laser.height)
        self._scene.add_camera_frustum(
            "/robot/view",
            fov=2 * math.atan(math.tan(camera.horizontal_fov / 2) * camera.height / camera.width),
            aspect=camera.width / camera.height,
            scale=0.35,
            thickness=0.012,
            color=(0, 114, 178),
            position=(x, y, z),
            wxyz=camera.base_from_camera.wxyz,
            cast_shadow=False,
            receive_shadow=False,
        )

    def _build_wheel(self, name: str, x: float, y: float) -> viser.FrameHandle:
        radius = self._spec.base.wheel_radius
        frame = self._scene.add_frame(
            f"/robot/wheel/{name}", show_axes=False, position=(x, y, radius)
        )
        tyre = UNIT_CYLINDER.scaled(2 * radius, 2 * radius, _wheel_width)
        self._mesh(f"/robot/wheel/{name}/tyre", tyre, _rubber, (0, 0, 0), _axle_along_y)
        for k in range(2):
            spoke = UNIT_BOX.scaled(1.5 * radius, _wheel_width + 0.01, 0.3 * radius)
            turn = (math.cos(k * math.pi / 4), 0.0, math.sin(k * math.pi / 4), 0.0)
            self._mesh(f"/robot/wheel/{name}/spoke{k}", spoke, _hub, (0, 0, 0), turn)
        return frame

    def _part(self, name: str, mesh: Mesh, colour: Rgb, x: float, z: float) -> None:
        self._mesh(f"/robot/{name}", mesh, colour, (x, 0.0, z), (1.0, 0.0, 0.0, 0.0))

    def _mesh(
        self, path: str, mesh: Mesh, colour: Rgb, at: tuple[float, float, float], wxyz: Quaternion
    ) -> None:
        self._scene.add_mesh_simple(
            path,
            mesh.vertices,
            mesh.faces,
            color=colour,
            flat_shading=True,
            position=at,
            wxyz=wxyz,
            cast_shadow=False,
            receive_shadow=False,
        )


def wheel_corner(joint: str) -> str:
    """Which wheel a joint turns, whatever else its name says; "" for other joints."""
    end = next((word for word in ("front", "rear") if word in joint), None)
    side = next((word for word in ("left", "right") if word in joint), None)
    return f"{end}_{side}" if end and side else ""


def scan_points(scan: LaserScan, height: float) -> Floats:
    """Places (N, 3) where beams ended, odom frame; beams that met nothing are left out."""
    angles = scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))
    hit = np.isfinite(scan.ranges) & (scan.ranges < scan.range_max)
    ranges = scan.ranges[hit].astype(np.float64)
    laser = np.stack([ranges * np.cos(angles[hit]), ranges * np.sin(angles[hit])], axis=-1)
    odom = (scan.odom_from_base @ scan.base_from_laser).apply(laser)
    return np.column_stack([odom, np.full(len(odom), height)])


def _wheel_places(spec: RobotSpec) -> list[tuple[str, tuple[float, float]]]:
    x, y = spec.base.wheelbase / 2, spec.base.track / 2
    return [
        ("front_left", (x, y)),
        ("front_right", (x, -y)),
        ("rear_left", (-x, y)),
        ("rear_right", (-x, -y)),
    ]
