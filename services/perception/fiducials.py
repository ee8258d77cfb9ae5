"""Square tags (AprilTag, family 36h11; Olson, 2011): which are seen, where, and how surely.

The pose of a planar tag has two likely solutions that mirror one another (Schweighofer and Pinz,
2006). The one that fits its corners better is taken; how much better decides how far the other one
widens the covariance. Corners are measured with the same error at every range, so that errors grow
with the square of the range along the view, and with the angle.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from robots.tags import FAMILY, TagTable
from schemas.arrays import Floats, Ints
from schemas.geometry import Pose3
from schemas.perception import Fiducials
from schemas.sensing import Intrinsics, RgbdFrame

_corner_px = 0.12
"""Deviation of a corner of a tag that is seen head on [px]; from tests/benchmarks/fiducials.py."""
_slant = 0.5
"""How fast that grows as a tag turns away and its cells become thin."""
_mount_rad = 0.005
"""Of the camera on the base, which also pitches a little when it drives [rad]."""
_scale_share = 0.005
"""Of the tag's side and the focal length."""
_magnified_below = 480
"""Pictures with fewer rows are enlarged: cells of a distant tag are a pixel or two."""
_least_contrast = 20
"""Of the border of a tag, of 255. Lower steps are taken for noise, whose edges cost seven times the
time of all others; a tag in an eighth of the usual light is still above it."""
_steps = 15
_still = 1e-18
"""Steps whose squared length is less change nothing."""
_half_pixel = 0.5
"""OpenCV's AprilTag corners count from the corner of the first pixel, ours from its middle."""

Pose = tuple[Floats, Floats]
"""Rotation (3, 3) and position (3,) [m] of a tag in the camera frame."""


@dataclass(frozen=True)
class TagPose:
    """One tag in the camera frame."""

    rotation: Floats
    """(3, 3) `camera_from_tag`."""
    position: Floats
    """(3,) [m]"""
    covariance: Floats
    """(6, 6) of position [m] and of a small turn about the camera's axes [rad]."""


class TagReader:
    """Finds tags in pictures; remembers nothing."""

    def __init__(self) -> None:
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_APRILTAG
        parameters.aprilTagMinWhiteBlackDiff = _least_contrast
        dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
        self._detector = cv2.aruco.ArucoDetector(dictionary, parameters)

    def read(self, color: NDArray[np.uint8]) -> tuple[Ints, Floats]:
        """Numbers (N,) and corners (N, 4, 2) [px] of the tags in an RGB picture (H, W, 3)."""
        grey = cv2.cvtColor(color, cv2.COLOR_RGB2GRAY)
        factor = 2 if len(grey) < _magnified_below else 1
        if factor > 1:
            grey = cv2.resize(grey, None, fx=factor, fy=factor, interpolation=cv2.INTER_CUBIC)
        found, numbers, _ = self._detector.detectMarkers(grey)
        if not found:
            # Then the numbers are None.
            return np.zeros(0, np.int32), np.zeros((0, 4, 2))
        corners = np.asarray(found, np.float64).reshape(-1, 4, 2)
        return np.asarray(numbers, np.int32).reshape(-1), corners / factor - _half_pixel


def fiducials_in(frame: RgbdFrame, reader: TagReader, side: float) -> Fiducials:
    """The tags of one size [m] that a frame shows."""
    numbers, corners = reader.read(frame.color)
    poses = [tag_pose(one, frame.intrinsics, side) for one in corners]
    turn = frame.base_from_camera.rotation()
    rotations = [turn @ pose.rotation for pose in poses]
    positions = np.array([pose.position for pose in poses]).reshape(-1, 3)
    return Fiducials(
        stamp_ns=frame.stamp_ns,
        family=FAMILY,
        odom_from_base=frame.odom_from_base,
        ids=numbers,
        corners_px=corners,
        positions_base=frame.base_from_camera.apply(positions),
        wxyz_base=np.array([quaternion(one) for one in rotations]).reshape(-1, 4),
        covariances=np.array([_turned(pose, turn) for pose in poses]).reshape(-1, 6, 6),
    )


def tag_pose(corners: Floats, camera: Intrinsics, side: float) -> TagPose:
    """Pose of a tag whose corners (4, 2) [px] were seen and whose side is known [m]."""
    points = _corner_points(side)
    matrix = np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]])
    first = _refined(points, _start(points, corners, matrix), corners, camera)
    solutions = [first, _refined(points, _mirrored(first), corners, camera)]
    errors = [float((_residual(points, one, corners, camera) ** 2).sum()) for one in solutions]
    best, other = int(np.argmin(errors)), int(np.argmax(errors))
    variance = _corner_variance(*solutions[best])
    covariance = _spread(points, solutions[best], camera, variance)
    if best != other:
        gap = math.exp(-(errors[other] - errors[best]) / (2 * variance))
        covariance += gap / (1 + gap) * _difference(solutions[best], solutions[other])
    return TagPose(*solutions[best], covariance)


def place_rows(tags: Fiducials, table: TagTable, types: tuple[str, ...]) -> tuple[Floats, Floats]:
    """Points (N, 2) in the base frame [m] and type distributions (N, T) that tags speak of."""
    listed = [row for row, number in enumerate(tags.ids.tolist()) if number in table.tags]
    points, rows = np.zeros((len(listed), 2)), np.zeros((len(listed), len(types)))
    for index, row in enumerate(listed):
        tag = table.tags[int(tags.ids[row])]
        w, x, y, z = tags.wxyz_base[row].tolist()
        out = Pose3((0.0, 0.0, 0.0), (w, x, y, z)).rotation()[:, 2]
        points[index] = tags.positions_base[row, :2] + tag.before_m * out[:2]
        rows[index] = table.error_rate / max(len(types) - 1, 1)
        rows[index, types.index(tag.place)] = 1 - table.error_rate
    return points, rows / rows.sum(axis=1, keepdims=True)


def quaternion(rotation: Floats) -> Floats:
    """Unit quaternion wxyz (4,) of a rotation matrix (3, 3); its scalar is not negative."""
    return Rotation.from_matrix(rotation).as_quat(canonical=True, scalar_first=True)


def _start(points: Floats, corners: Floats, matrix: Floats) -> Pose:
    """A pose near one of the solutions.

    Not by OpenCV's closed form for squares (IPPE), which would give both: in version 5.0 its
    rotations are wrong by tens of degrees.
    """
    _, turn, shift = cv2.solvePnP(points, corners, matrix, None, flags=cv2.SOLVEPNP_ITERATIVE)
    rotation = np.asarray(cv2.Rodrigues(turn)[0], np.float64)
    return rotation, np.asarray(shift, np.float64).reshape(3)


def _mirrored(pose: Pose) -> Pose:
    """The tag as it would lean the other way: half a turn about the view, and one in its plane."""
    rotation, position = pose
    view = position / np.linalg.norm(position)
    about_view = 2 * np.outer(view, view) - np.eye(3)
    return about_view @ rotation @ np.diag([-1.0, -1.0, 1.0]), position


def _refined(points: Floats, start: Pose, corners: Floats, camera: Intrinsics) -> Pose:
    """The pose of least squared error near a start (Levenberg, 1944; Marquardt, 1963)."""
    pose, damping = start, 1e-6
    residual = _residual(points, pose, corners, camera)
    for _ in range(_steps):
        jacobian = _jacobian(points, pose, camera)
        normal = jacobian.T @ jacobian
        damped = normal + damping * np.diag(np.diag(normal))
        step = np.linalg.solve(damped, jacobian.T @ residual)
        turn = np.asarray(cv2.Rodrigues(step[3:])[0], np.float64)
        moved = (turn @ pose[0], pose[1] + step[:3])
        after = _residual(points, moved, corners, camera)
        if after @ after < residual @ residual:
            pose, residual, damping = moved, after, damping / 10
            if step @ step < _still:
                break
        else:
            damping *= 10
    return pose


def _corner_points(side: float) -> Floats:
    """Corners (4, 3) in the tag's frame [m]; `solvePnP` demands this order."""
    return side / 2 * np.array([(-1.0, 1, 0), (1, 1, 0), (1, -1, 0), (-1, -1, 0)])


def _residual(points: Floats, pose: Pose, corners: Floats, camera: Intrinsics) -> Floats:
    """How far each corner is from where a pose puts it (8,) [px]."""
    x, y, z = (points @ pose[0].T + pose[1]).T
    drawn = np.stack([camera.fx * x / z + camera.cx, camera.fy * y / z + camera.cy], axis=1)
    return (corners - drawn).reshape(-1)


def _jacobian(points: Floats, pose: Pose, camera: Intrinsics) -> Floats:
    """Change (8, 6) of the corners [px] with position [m] and a small turn [rad]."""
    arms = points @ pose[0].T
    rows: list[Floats] = []
    for arm, (x, y, z) in zip(arms, arms + pose[1], strict=True):
        by_point = np.array(
            [[camera.fx / z, 0, -camera.fx * x / z**2], [0, camera.fy / z, -camera.fy * y / z**2]]
        )
        rows.append(by_point @ np.hstack([np.eye(3), -_cross(arm)]))
    return np.vstack(rows)


def _corner_variance(rotation: Floats, position: Floats) -> float:
    """Of each coordinate of a corner [px^2]; grows with the angle at which the tag is seen."""
    cosine = abs(float(rotation[:, 2] @ position)) / float(np.linalg.norm(position))
    return (_corner_px * (1 + _slant * (1 / max(cosine, 0.1) - 1))) ** 2


def _spread(points: Floats, pose: Pose, camera: Intrinsics, variance: float) -> Floats:
    """Covariance (6, 6) that errors of the corners, of the mount and of scale cause."""
    jacobian = _jacobian(points, pose, camera)
    covariance = variance * np.linalg.inv(jacobian.T @ jacobian)
    lever = np.vstack([-_cross(pose[1]), np.eye(3)])
    along = np.concatenate([pose[1], np.zeros(3)])
    covariance += _mount_rad**2 * lever @ lever.T
    return covariance + _scale_share**2 * np.outer(along, along)


def _difference(one: Pose, other: Pose) -> Floats:
    """Outer product (6, 6) of the step from one solution to the other."""
    turn = np.asarray(cv2.Rodrigues(other[0] @ one[0].T)[0], np.float64).reshape(3)
    step = np.concatenate([other[1] - one[1], turn])
    return np.outer(step, step)


def _turned(pose: TagPose, base_from_camera: Floats) -> Floats:
    """Covariance (6, 6) about the axes of the base."""
    both = np.kron(np.eye(2), base_from_camera)
    return both @ pose.covariance @ both.T


def _cross(v: Floats) -> Floats:
    """Matrix (3, 3) of the cross product with v."""
    x, y, z = v.tolist()
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
