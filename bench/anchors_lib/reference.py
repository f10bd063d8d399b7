"""Where agent 2 shows agent 1's anchors, by a reference's camera poses: up to scale, and at few images.

An anchor's place is its place in the camera that it was placed by, carried by the reference to agent 2's camera:
T_cam2_cam1 p_cam1. Lengths of the reference are brought to the joint map's metres, so an error of the map's scale does not count.
Best known is a place in view: the reference has matched the two images, or others near them. Elsewhere its own bend counts too.
"""

import bisect
import math
import statistics

from ablation_lib.recording import numbers
from accuracy_lib.plan import mav0_of
from anchors_lib import messages
from real_lib import rotations as rot
from real_lib import trajectory
from real_lib.measure import measure
from real_lib.plan import REFERENCE, begin

SETTLED_S = 10  # as in the session's report, which counts from the fusion on
WIDTH_PX = 640
SAME_S = 1e-3  # a stamp of the reference and one of an image


def optimised(session, agent):
    """Body poses in the joint map, at camera rate."""
    keyframes = trajectory.read(session / f"agent_{agent}.tum")
    by_map = {}
    for frame in messages.frames(session / f"agent_{agent}.lcm", agent):
        by_map.setdefault(frame.map, []).append((frame.t, frame.T_odom_body))
    return [pose for odometry in by_map.values() for pose in
            trajectory.at_camera_rate([k for k in keyframes if odometry[0][0] <= k[0] <= odometry[-1][0]], odometry)]


def in_metres(session, agents, pieces, T_body_cam):
    """The pieces in the joint map's metres; None where that does not know their scale."""
    poses = sorted(pose for agent in agents for pose in optimised(session, agent))
    found = measure(trajectory.moved(poses, T_body_cam), pieces)
    return trajectory.grown(pieces, found["scale"]) if found else None


def nearest(frames, stamps, t):
    """The image of this stamp, or None."""
    i = bisect.bisect_left(stamps, t - SAME_S)
    return frames[i] if i < len(frames) and frames[i].t <= t + SAME_S else None


def pose_at(pieces, t):
    """(frame of the piece, T_ref_cam)."""
    for piece in pieces:
        if pose := trajectory.at(piece.poses, trajectory.stamps_of(piece.poses), t):
            return piece.frame, pose
    return None


def places(session, agent, pieces, T_body_cam):
    """{anchor: (frame of the piece, p_ref)}."""
    heard = messages.first_heard(session / f"agent_{agent}.lcm", agent)
    found = {}
    for anchor, (t, T_odom_body) in messages.placings(session / "session.lcm").items():
        camera = pose_at(pieces, t)
        if camera and anchor in heard:
            p_cam = rot.apply(rot.inverse(rot.compose(T_odom_body, T_body_cam)), heard[anchor][1])
            found[anchor] = camera[0], rot.apply(camera[1], p_cam)
    return found


class Viewer:
    """Agent 2's images that the reference has."""

    def __init__(self, log, agent, pieces, T_body_cam, camera):
        self.camera = camera
        self.frames = []
        self.first_shown = {}
        tracked = messages.frames(log, agent)
        for frame in tracked:
            for anchor in frame.shown:
                self.first_shown.setdefault(anchor, frame.wall_us)
        stamps = [frame.t for frame in tracked]
        for piece in pieces:
            for t, T_ref_cam in piece.poses:
                frame = nearest(tracked, stamps, t)
                if frame:
                    self.frames.append((frame, piece.frame, T_ref_cam, rot.inverse(rot.compose(frame.T_odom_body, T_body_cam))))

    def errors(self, anchor, place):
        """Of each image that it is shown with: (seconds since it was first shown, metres, metres from the camera, pixels in view)."""
        frame_of_place, p_ref = place
        found = []
        for frame, frame_of_piece, T_ref_cam, T_cam_odom in self.frames:
            if anchor in frame.shown and frame_of_piece == frame_of_place:
                truth = rot.apply(rot.inverse(T_ref_cam), p_ref)
                seen = rot.apply(T_cam_odom, frame.shown[anchor][1])
                shown_s = 1e-6 * (frame.wall_us - self.first_shown[anchor])
                found.append((shown_s, math.dist(seen, truth), math.hypot(*truth), self.camera.pixels(seen, truth)))
        return found


class Camera:
    """A pinhole: the lens's distortion is left out."""

    def __init__(self, size, intrinsics):
        self.size, self.focal, self.centre = size, intrinsics[:2], intrinsics[2:4]

    def project(self, p):
        return tuple(f * x / p[2] + c for f, x, c in zip(self.focal, p, self.centre)) if p[2] > 0 else None

    def pixels(self, seen, truth):
        """Between the two at WIDTH_PX wide; None where the truth is not in the image. What can be drawn nowhere is off by the diagonal."""
        here, there = self.project(seen), self.project(truth)
        if not there or not all(0 <= u < length for u, length in zip(there, self.size)):
            return None
        return WIDTH_PX / self.size[0] * (math.dist(here, there) if here else math.hypot(*self.size))


class Reference:
    """Of one recording."""

    def __init__(self, recording, file=None):
        mav0 = mav0_of(recording)
        beside = [mav0 / REFERENCE, mav0.parent / REFERENCE]
        found = file or next((path for path in beside if path.is_file()), None)
        if not found:
            raise SystemExit(f"anchors: {recording}: no {REFERENCE} is beside it, and --reference is not given")
        self.pieces = trajectory.read_pieces(found)
        self.begin = begin(mav0)
        yaml = (mav0 / "cam0/sensor.yaml").read_text()
        self.T_body_cam = rot.between(*(trajectory.extrinsics(mav0 / sensor / "sensor.yaml") for sensor in ("imu0", "cam0")))
        self.camera = Camera(numbers(yaml, "resolution"), numbers(yaml, "intrinsics"))

    def seconds(self):
        """Of the recording, of the images whose pose is known."""
        return [t - self.begin for piece in self.pieces for t, _ in piece.poses]

    def fill(self, anchors, session):
        """The errors into report.json's `anchors`, where the reference knows them."""
        pieces = in_metres(session, (1, 2), self.pieces, self.T_body_cam)
        if not pieces:
            return
        known = places(session, 1, pieces, self.T_body_cam)
        viewer = Viewer(session / "agent_2.lcm", 2, pieces, self.T_body_cam, self.camera)
        for anchor in anchors:
            identity = tuple(map(int, anchor["id"].split("/"))) if anchor["id"] else None
            errors = viewer.errors(identity, known[identity]) if identity in known else []
            for agent in anchor["agents"]:
                if agent["id"] == 2:
                    agent.update(summary(errors))


def summary(errors):
    """As report.json says it, from SETTLED_S after the anchor was first shown on; and in view, at any time."""
    found = {"shown": bool(errors)}
    settled = [metres for shown_s, metres, _, _ in errors if shown_s >= SETTLED_S]
    if settled:
        found |= {"error_m": statistics.median(settled), "error_max_m": max(settled), "error_10s_m": settled[0], "error_end_m": settled[-1]}
    in_view = [(metres, metres / away, px) for _, metres, away, px in errors if px is not None]
    if in_view:
        names = ("error_in_view_m", "error_in_view_share", "error_px")
        found |= {name: statistics.median(values) for name, values in zip(names, zip(*in_view))}
    return found
