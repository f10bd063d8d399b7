#!/usr/bin/env python3
"""A live sensor source: plays a recording in EuRoC's format onto an agent's bus, in real time.

    euroc_source.py --agent 3 --recording MH_01 [--bus URL] [--rate 1]       beside: pangea-vio --live --agent 3

For your own sensors replace `Recording`: the loop in `play` is all that a source has to do (docs/bus.md).
"""

import argparse
import csv
import re
import sys
import time
from pathlib import Path

try:
    from pangea import camera_t, imu_t, pose_t
    from pangea.bus import DEFAULT_URL, Bus, image_chunks
except ModuleNotFoundError:
    if not {"-h", "--help"} & set(sys.argv):  # --help does not need the package
        sys.exit("euroc_source: no package pangea: set PYTHONPATH to build/release/python of Pangea's tree, or install Pangea")

CAMERA_INTERVAL_S = 1.0


def fail(why):
    sys.exit(f"euroc_source: {why}")


def numbers(text, key, path):
    """The list of numbers at `key`. EuRoC's sensor.yaml is read without a YAML parser, because Python has none."""
    found = re.search(rf"\b{key}:\s*\[([^\]]*)\]", text)
    if not found:
        fail(f"{path}: field '{key}' (a list of numbers) is missing")
    return [float(number) for number in found[1].split(",")]


def transform(text, path):
    """T_BS as (rotation rows, translation)."""
    m = numbers(text[text.index("T_BS"):] if "T_BS" in text else "", "data", path)
    if len(m) != 16:
        fail(f"{path}: T_BS: data: give 16 numbers, row by row, not {len(m)}")
    return [m[0:3], m[4:7], m[8:11]], [m[3], m[7], m[11]]


def relative(a, b):
    """T_a^-1 T_b"""
    (Ra, ta), (Rb, tb) = a, b
    R = [[sum(Ra[k][i] * Rb[k][j] for k in range(3)) for j in range(3)] for i in range(3)]
    t = [sum(Ra[k][i] * (tb[k] - ta[k]) for k in range(3)) for i in range(3)]
    return R, t


def set_transform(message, R, t):
    message.translation.x, message.translation.y, message.translation.z = t
    # One of the four squares in turn: the largest one gives the others without a small divisor.
    squares = [1 + R[0][0] + R[1][1] + R[2][2], 1 + R[0][0] - R[1][1] - R[2][2],
               1 - R[0][0] + R[1][1] - R[2][2], 1 - R[0][0] - R[1][1] + R[2][2]]
    w, x, y, z = [(squares[0], R[2][1] - R[1][2], R[0][2] - R[2][0], R[1][0] - R[0][1]),
                  (R[2][1] - R[1][2], squares[1], R[1][0] + R[0][1], R[0][2] + R[2][0]),
                  (R[0][2] - R[2][0], R[1][0] + R[0][1], squares[2], R[2][1] + R[1][2]),
                  (R[1][0] - R[0][1], R[0][2] + R[2][0], R[2][1] + R[1][2], squares[3])][squares.index(max(squares))]
    norm = (w * w + x * x + y * y + z * z) ** 0.5
    q = message.rotation
    q.w, q.x, q.y, q.z = w / norm, x / norm, y / norm, z / norm


def field(text, name, otherwise):
    found = re.search(rf"^{name}:\s*(\S+)", text, re.MULTILINE)
    return found[1] if found else otherwise


def time_offset_of_first_row(text, readout_s):
    """docs/recordings.md: our offset is the first row's, Kalibr's the middle row's."""
    ours, kalibr = field(text, "time_offset_s", None), field(text, "timeshift_cam_imu", None)
    row = field(text, "stamp_row", "middle" if kalibr and not ours else "first")
    shares = {"first": 0, "middle": 0.5, "last": 1}
    if row not in shares:
        raise ValueError(f"stamp_row: {row}: give {', '.join(shares)}")
    return float(ours or kalibr or 0) - shares[row] * readout_s


class Recording:
    """camera: camera_t; events: (utime, imu_t or path of an image), in time order."""

    def __init__(self, folder):
        mav0 = folder / "mav0" if (folder / "mav0").is_dir() else folder
        try:
            self.camera = self._camera(mav0)
        except ValueError as error:
            fail(f"{mav0}/cam0/sensor.yaml or imu0/sensor.yaml: {error}")
        self.events = sorted([*self._imu(mav0), *self._images(mav0)], key=lambda event: event[0])
        if not self.events:
            fail(f"{mav0}: imu0/data.csv and cam0/data.csv have no rows")

    def _camera(self, mav0):
        path, imu_path = mav0 / "cam0/sensor.yaml", mav0 / "imu0/sensor.yaml"
        text = path.read_text()
        camera = camera_t()
        is_equidistant = re.search(r"distortion_model:\s*[\"']?equi", text)
        camera.model = camera_t.MODEL_EQUIDISTANT if is_equidistant else camera_t.MODEL_RADTAN
        camera.width, camera.height = map(int, numbers(text, "resolution", path))
        camera.fx, camera.fy, camera.cx, camera.cy = numbers(text, "intrinsics", path)
        camera.distortion = numbers(text, "distortion_coefficients", path)
        if len(camera.distortion) != 4:
            fail(f"{path}: distortion_coefficients: give 4 numbers, not {len(camera.distortion)}")
        camera.readout_s = float(field(text, "readout_s", 0))
        camera.time_offset_s = time_offset_of_first_row(text, camera.readout_s)
        set_transform(camera.T_body_cam, *relative(transform(imu_path.read_text(), imu_path), transform(text, path)))
        return camera

    @staticmethod
    def _events(path, parse):
        """The result of `parse` for each row."""
        with path.open() as file:
            reader = csv.reader(file)
            for row in reader:
                if not row or row[0].startswith("#"):
                    continue
                try:
                    yield parse(*row)
                except (TypeError, ValueError):
                    fail(f"{path}:{reader.line_num}: '{','.join(row)[:60]}': give {parse.__doc__}")

    def _imu(self, mav0):
        def parse(stamp, *values):
            """a stamp in ns, three numbers of the gyroscope, three of the accelerometer"""
            sample = imu_t()
            sample.utime = int(stamp) // 1000
            gyro, accel = sample.gyro_body, sample.accel_body
            gyro.x, gyro.y, gyro.z, accel.x, accel.y, accel.z = map(float, values[:6])
            return sample.utime, sample

        return self._events(mav0 / "imu0/data.csv", parse)

    def _images(self, mav0):
        table = mav0 / "cam0/data.csv"

        def parse(stamp, name, *_):
            """a stamp in ns, an image's name"""
            path = mav0 / "cam0/data" / name.strip()
            return int(stamp) // 1000, path

        for utime, path in self._events(table, parse):
            if path.is_file():
                yield utime, path
            else:
                print(f"euroc_source: {path}: is missing, left out", file=sys.stderr)


def play(recording, bus, agent, rate):
    camera = recording.camera
    begin_utime, begin_s = recording.events[0][0], time.monotonic()
    next_camera_s = begin_s
    for utime, event in recording.events:
        due_s = begin_s + 1e-6 * (utime - begin_utime) / rate
        while (left_s := due_s - time.monotonic()) > 0:
            bus.handle(left_s)  # messages of the odometry that arrive meanwhile
        if time.monotonic() >= next_camera_s:
            bus.publish(f"CAMERA_{agent}", camera)
            next_camera_s += CAMERA_INTERVAL_S
        if isinstance(event, imu_t):
            bus.publish(f"IMU_{agent}", event)
            continue
        for chunk in image_chunks(utime, event.read_bytes(), camera.width, camera.height):
            bus.publish(f"IMAGE_{agent}", chunk)


def say_states(bus, agent):
    """Prints one line whenever the odometry's state changes."""
    states = {pose_t.STATE_INITIALISING: "initialising", pose_t.STATE_TRACKING: "tracking", pose_t.STATE_LOST: "lost"}
    last = [None]

    def on_pose(_, pose):
        if pose.state != last[0]:
            last[0] = pose.state
            print(f"agent {agent}: {states.get(pose.state, '?')}", pose.reason, flush=True)

    bus.subscribe(f"POSE_{agent}", on_pose, pose_t)


def agent_id(text):
    if not text.isdecimal() or not 1 <= int(text) <= 65535:
        raise argparse.ArgumentTypeError(f"'{text}': give 1 to 65535")
    return int(text)


def positive(text):
    if not float(text) > 0:
        raise argparse.ArgumentTypeError(f"'{text}': give a number above 0")
    return float(text)


def main():
    parser = argparse.ArgumentParser(description="Plays a recording in EuRoC's format onto an agent's bus.")
    parser.add_argument("--agent", type=agent_id, required=True, help="agent id, 1 to 65535")
    parser.add_argument("--recording", type=Path, required=True, help="folder that holds mav0")
    parser.add_argument("--bus", help="LCM URL of the agent's bus (default: that of pangea-vio)")
    parser.add_argument("--rate", type=positive, default=1.0, help="times real time")
    arguments = parser.parse_args()
    try:
        recording = Recording(arguments.recording)
        bus = Bus(arguments.bus or DEFAULT_URL)
        say_states(bus, arguments.agent)
        play(recording, bus, arguments.agent, arguments.rate)
    except OSError as error:
        fail(f"{error.filename}: {error.strerror}" if error.filename else error)
    except ValueError as error:
        fail(error)


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        pass
