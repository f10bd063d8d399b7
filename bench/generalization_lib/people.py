"""People who walk side by side past a camera, painted into rendered images as textured boards that stand upright in the world.

They cross the view from left to right of the ground-truth camera in the middle of a passage. The camera is EuRoC's.
"""

import math
import random
from dataclasses import dataclass

from ablation_lib.recording import numbers
from real_lib import rotations as rot
from real_lib import trajectory

SPEED_MPS = 1.2
WIDTH_M, HEIGHT_M, EYES_M = 0.55, 1.75, 1.5  # the camera is at the height of the eyes
NEAREST_M, FURTHEST_M = 2.0, 3.2
COLUMNS, ROWS = 16, 48  # patches of a person's clothes, each of one grey


@dataclass
class Person:
    ahead_m: float
    right_m: float  # position in the middle of the passage
    clothes: list  # rows of greys


@dataclass
class Passage:
    """Part of the recording, in seconds, in which people pass."""

    begin: float
    end: float
    people: list

    def middle(self):
        return (self.begin + self.end) / 2


def passage(begin, end, spacing_m, rng):
    """People side by side, as many as needed to have someone in the view all the time."""
    reach = SPEED_MPS * (end - begin) / 2 + FURTHEST_M
    count = max(1, round(2 * reach / spacing_m))
    people = [Person(rng.uniform(NEAREST_M, FURTHEST_M), -reach + spacing_m * (i + rng.uniform(0.3, 0.7)),
                     [[rng.randrange(20, 236) for _ in range(COLUMNS)] for _ in range(ROWS)]) for i in range(count)]
    return Passage(begin, end, sorted(people, key=lambda person: -person.ahead_m))  # the nearest last, as painted


class Camera:
    """Pinhole with radial and tangential distortion."""

    def __init__(self, yaml):
        self.width, self.height = (int(x) for x in numbers(yaml, "resolution"))
        self.intrinsics = numbers(yaml, "intrinsics")
        self.distortion = numbers(yaml, "distortion_coefficients")

    def project(self, p):
        x, y = p[0] / p[2], p[1] / p[2]
        (fx, fy, cx, cy), (k1, k2, p1, p2) = self.intrinsics, self.distortion
        r2 = min(x * x + y * y, 1.5)  # beyond this, far outside the image, the polynomial is not monotonic
        radial = 1 + r2 * (k1 + r2 * k2)
        return (fx * (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)) + cx,
                fy * (y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y) + cy)


def board(camera, T_world_cam, foot, right):
    """The rectangle of the image that a person covers, or None if the person is not in the image."""
    corners = []
    for side in (-0.5, 0.5):
        for up in (0.0, HEIGHT_M):
            p_world = rot.add(rot.add(foot, rot.scaled(side * WIDTH_M, right)), (0.0, 0.0, up))
            p = rot.rotate(rot.conjugate(T_world_cam[0]), rot.subtract(p_world, T_world_cam[1]))
            if p[2] < 0.4:
                return None
            corners.append(camera.project(p))
    xs, ys = zip(*corners)
    return min(xs), max(xs), min(ys), max(ys)


def paint(pixels, camera, rectangle, clothes):
    x0, x1, y0, y1 = rectangle
    left, right = max(0, math.ceil(x0)), min(camera.width, math.ceil(x1))
    top, bottom = max(0, math.ceil(y0)), min(camera.height, math.ceil(y1))
    if left >= right:
        return
    columns = [min(COLUMNS - 1, int(COLUMNS * (x - x0) / (x1 - x0))) for x in range(left, right)]
    rows = [bytes(row[c] for c in columns) for row in clothes]
    for y in range(top, bottom):
        at = y * camera.width
        pixels[at + left:at + right] = rows[min(ROWS - 1, int(ROWS * (y - y0) / (y1 - y0)))]


class View:
    """The view of the recording's camera, by its ground truth."""

    def __init__(self, recording):
        self.camera = Camera(recording.camera_yaml)
        truth = trajectory.read_groundtruth(recording.mav0 / "state_groundtruth_estimate0/data.csv")
        self.poses = trajectory.moved(truth, trajectory.extrinsics(recording.mav0 / "cam0/sensor.yaml"))
        self.stamps = trajectory.stamps_of(self.poses)
        self.first_s = int(recording.images[0][0]) / 1e9

    def pose(self, second):
        return trajectory.at(self.poses, self.stamps, self.first_s + second)

    def rectangles(self, one, second):
        """The rectangles in which people of a passage appear in the image, with their clothes."""
        q, p = self.pose(one.middle())
        ahead = rot.rotate(q, (0.0, 0.0, 1.0))
        ahead = rot.scaled(1 / math.hypot(*ahead[:2]), (*ahead[:2], 0.0))
        right = (ahead[1], -ahead[0], 0.0)
        for person in one.people:
            sideways = person.right_m + SPEED_MPS * (second - one.middle())
            foot = rot.add(rot.add(p, rot.scaled(person.ahead_m, ahead)), rot.scaled(sideways, right))
            rectangle = board(self.camera, self.pose(second), rot.subtract(foot, (0.0, 0.0, EYES_M)), right)
            if rectangle:
                yield rectangle, person.clothes


def painted(pixels, camera, rectangles):
    pixels = bytearray(pixels)
    for rectangle, clothes in rectangles:
        paint(pixels, camera, rectangle, clothes)
    return bytes(pixels)


def walk_past(recording, passages):
    view = View(recording)
    for one in passages:
        for row in recording.images:
            second = recording.stamp(row) / 1e9
            if one.begin <= second < one.end:
                rectangles = list(view.rectangles(one, second))
                recording.painted[row[1]] = lambda pixels, rectangles=rectangles: painted(pixels, view.camera, rectangles)


def passages(spacing_m):
    """People pass a stationary camera, and later a walking one, in the recording "stands"."""
    rng = random.Random("people")
    return [passage(10.5, 14.5, spacing_m, rng), passage(20, 24, spacing_m, rng)]


def people(recording):
    """From time to time someone walks past."""
    walk_past(recording, passages(2.2))


def crowd(recording):
    """People shoulder to shoulder fill the view."""
    walk_past(recording, passages(0.6))
