"""Errors of agent 1's anchors as agent 2 shows them, from known camera poses: ground truth of two sessions, or a reference up to scale.

An anchor's true position is its position in the camera by which it was placed, moved by these poses to agent 2's camera: T_cam2_cam1 p_cam1.
Lengths of a reference are scaled to the joint map's metres, so an error of the map's scale does not count. The most certain errors are those
of anchors in view: the reference has matched the two images, or others near them. Elsewhere the reference's own deformation counts too.
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

SETTLED_S = 10  # as in the session's report, where it counts from the fusion
WIDTH_PX = 640
SAME_S = 1e-3  # largest difference between a stamp of the reference and that of its image


def optimised(session, agent):
    """Body poses in the joint map, at camera rate."""
    keyframes = trajectory.read(session / f"agent_{agent}.tum")
    by_map = {}
    for frame in messages.frames(session / f"agent_{agent}.lcm", agent):
        by_map.setdefault(frame.map, []).append((frame.t, frame.T_odom_body))
    return [pose for odometry in by_map.values() for pose in
            trajectory.at_camera_rate([k for k in keyframes if odometry[0][0] <= k[0] <= odometry[-1][0]], odometry)]


def in_metres(session, agents, pieces, T_body_cam):
    """The pieces in the joint map's metres; None if the map does not determine their scale."""
    poses = sorted(pose for agent in agents for pose in optimised(session, agent))
    found = measure(trajectory.moved(poses, T_body_cam), pieces)
    return trajectory.grown(pieces, found["scale"]) if found else None


def nearest(frames, stamps, t):
    """The image with this stamp, or None."""
    i = bisect.bisect_left(stamps, t - SAME_S)
    return frames[i] if i < len(frames) and frames[i].t <= t + SAME_S else None


def pose_at(pieces, t):
    """(frame of the piece, T_ref_cam); None if the pieces have no pose at t."""
    for piece in pieces:
        if pose := trajectory.at(piece.poses, trajectory.stamps_of(piece.poses), t):
            return piece.frame, pose
    return None


def places(session, agent, pieces, T_body_cam):
    """{anchor: (frame of the piece, p_ref)}: the true position of each anchor."""
    heard = messages.first_heard(session / f"agent_{agent}.lcm", agent)
    found = {}
    for anchor, (t, T_odom_body) in messages.placings(session / "session.lcm").items():
        camera = pose_at(pieces, t)
        if camera and anchor in heard:
            p_cam = rot.apply(rot.inverse(rot.compose(T_odom_body, T_body_cam)), heard[anchor][1])
            found[anchor] = camera[0], rot.apply(camera[1], p_cam)
    return found


class Viewer:
    """Agent 2's images with a pose in the reference."""

    def __init__(self, log, agent, pieces, T_body_cam, camera):
        self.camera = camera
        self.frames = []
        self.first_shown = {}
        self.tracked = tracked = messages.frames(log, agent)
        for frame in tracked:
            for anchor in frame.shown:
                self.first_shown.setdefault(anchor, frame.wall_us)
        stamps = [frame.t for frame in tracked]
        for piece in pieces:
            for t, T_ref_cam in piece.poses:
                frame = nearest(tracked, stamps, t)
                if frame:
                    self.frames.append((frame, piece.frame, T_ref_cam, rot.inverse(rot.compose(frame.T_odom_body, T_body_cam))))

    def localised_s(self):
        """Wall time from agent 2's first pose until it first shows an anchor."""
        return 1e-6 * (min(self.first_shown.values()) - self.tracked[0].wall_us) if self.first_shown else None

    def largest_jump_m(self, anchor):
        """Largest step from an image to the next in one map; None if the anchor was never shown in two successive images."""
        steps = [math.dist(a.shown[anchor][1], b.shown[anchor][1]) for a, b in zip(self.tracked, self.tracked[1:])
                 if a.map == b.map and anchor in a.shown and anchor in b.shown]
        return max(steps, default=None)

    def errors(self, anchor, place):
        """For each image with the anchor: (seconds since it was first shown, error in metres, metres from the camera, error in pixels if in view)."""
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
    """A pinhole camera, without the lens's distortion."""

    def __init__(self, size, intrinsics):
        self.size, self.focal, self.centre = size, intrinsics[:2], intrinsics[2:4]

    def project(self, p):
        return tuple(f * x / p[2] + c for f, x, c in zip(self.focal, p, self.centre)) if p[2] > 0 else None

    def pixels(self, seen, truth):
        """Distance of the two for a width of WIDTH_PX; None if the truth is outside the image. If `seen` cannot be projected: the diagonal."""
        here, there = self.project(seen), self.project(truth)
        if not there or not all(0 <= u < length for u, length in zip(there, self.size)):
            return None
        return WIDTH_PX / self.size[0] * (math.dist(here, there) if here else math.hypot(*self.size))


class Recording:
    """Camera and extrinsics of a recording."""

    def __init__(self, recording):
        self.mav0 = mav0_of(recording)
        yaml = (self.mav0 / "cam0/sensor.yaml").read_text()
        self.T_rig_body, self.T_rig_cam = (trajectory.extrinsics(self.mav0 / sensor / "sensor.yaml") for sensor in ("imu0", "cam0"))
        self.T_body_cam = rot.between(self.T_rig_body, self.T_rig_cam)
        self.camera = Camera(numbers(yaml, "resolution"), numbers(yaml, "intrinsics"))


class Reference(Recording):
    """The reference of one recording that is cut in two."""

    def __init__(self, recording, file=None):
        super().__init__(recording)
        beside = [self.mav0 / REFERENCE, self.mav0.parent / REFERENCE]
        found = file or next((path for path in beside if path.is_file()), None)
        if not found:
            raise SystemExit(f"anchors: {recording}: no {REFERENCE} is beside it, and --reference is not given")
        self.pieces = trajectory.read_pieces(found)
        self.begin = begin(self.mav0)

    def seconds(self):
        """Seconds since the start of the recording, of the images with known poses."""
        return [t - self.begin for piece in self.pieces for t, _ in piece.poses]

    def fill(self, report, session):
        """Writes the errors into report.json's `anchors`, where the reference knows them."""
        pieces = in_metres(session, (1, 2), self.pieces, self.T_body_cam)
        if pieces:
            viewer = Viewer(session / "agent_2.lcm", 2, pieces, self.T_body_cam, self.camera)
            fill(report, places(session, 1, pieces, self.T_body_cam), viewer)


def fill_next_day(report, first, second, recordings):
    """Errors of the anchors that agent 1 placed in the session `first` and agent 2 shows in `second`; `report` is that of `first`."""
    maker, looker = map(Recording, recordings)
    viewer = Viewer(second / "agent_2.lcm", 2, ground_truth(looker), looker.T_body_cam, looker.camera)
    for anchor in report["anchors"]:
        anchor["agents"] = [{"id": 2, "largest_jump_m": viewer.largest_jump_m(identity(anchor))}]
    fill(report, places(first, 1, ground_truth(maker), maker.T_body_cam), viewer)


def ground_truth(recording):
    poses = trajectory.read_groundtruth(recording.mav0 / "state_groundtruth_estimate0/data.csv")
    return [trajectory.Piece(trajectory.moved(poses, recording.T_rig_cam), 0)]


def identity(anchor):
    return tuple(map(int, anchor["id"].split("/"))) if anchor["id"] else None


def fill(report, known, viewer):
    for anchor in report["anchors"]:
        place = known.get(identity(anchor))
        for agent in anchor["agents"]:
            if agent["id"] == 2:
                agent.update(summary(viewer.errors(identity(anchor), place) if place else []))
    report["localised_s"] = viewer.localised_s()


def summary(errors):
    """The fields of report.json: errors from SETTLED_S after the anchor was first shown; errors in view at any time."""
    found = {"shown": bool(errors)}
    settled = [metres for shown_s, metres, _, _ in errors if shown_s >= SETTLED_S]
    if settled:
        found |= {"error_m": statistics.median(settled), "error_max_m": max(settled), "error_10s_m": settled[0], "error_end_m": settled[-1]}
    in_view = [(metres, metres / away, px) for _, metres, away, px in errors if px is not None]
    if in_view:
        names = ("error_in_view_m", "error_in_view_share", "error_px")
        found |= {name: statistics.median(values) for name, values in zip(names, zip(*in_view))}
    return found
