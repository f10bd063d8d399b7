#!/usr/bin/env python3
"""Composes a recording from others: images of one, IMU and calibration of an exact one, with the requested errors.

White noise and random walks of the biases have the sigmas of the exact recording's sensor.yaml; turn-on biases are the simulator's. A
wrong calibration has an error of fixed size, in a direction that depends on the seed.
"""

import argparse
import math
import random
import re
import shutil
from pathlib import Path

GYRO_TURN_ON, ACCEL_TURN_ON = 0.03, 0.08  # rad/s and m/s^2, as modules/sim/imu_simulator.cc
ROTATION_OFF, TRANSLATION_OFF = math.radians(0.2), 0.005  # of the extrinsics: rad, m
TIME_OFF = 0.005  # s
FOCAL_OFF, CENTRE_OFF = 0.002, 1.0  # a share, px
IMU_KEYS = ("rate_hz", "gyroscope_noise_density", "gyroscope_random_walk", "accelerometer_noise_density",
            "accelerometer_random_walk")


def numbers(text, key):
    """The number, or the list of numbers, behind `key:`."""
    found = re.search(rf"\b{key}:\s*(\[[^\]]*\]|\S+)", text)
    if not found:
        raise SystemExit(f"a sensor.yaml lacks the field '{key}': benches read EuRoC's format alone, not Kalibr's")
    values = [float(word) for word in found.group(1).strip("[]").replace("\n", " ").split(",")]
    return values if found.group(1).startswith("[") else values[0]


def put(text, key, values):
    return re.sub(rf"\b{key}:\s*\[[^\]]*\]", f"{key}: [" + ", ".join(f"{v:.14g}" for v in values) + "]", text)


def worse_imu(rows, yaml, noise, bias, seed):
    """Rows of stamp and six numbers. The draws of noise and of bias do not depend on whether the other is requested."""
    rate, gyro_noise, gyro_walk, accel_noise, accel_walk = (numbers(yaml, key) for key in IMU_KEYS)
    white, walk = random.Random(f"noise {seed}"), random.Random(f"bias {seed}")
    biases = [walk.gauss(0, turn_on) for turn_on in 3 * [GYRO_TURN_ON] + 3 * [ACCEL_TURN_ON]]
    made = []
    for stamp, *values in rows:
        for i in range(6):
            density, wander = (gyro_noise, gyro_walk) if i < 3 else (accel_noise, accel_walk)
            values[i] += white.gauss(0, density * math.sqrt(rate)) if noise else 0
            values[i] += biases[i] if bias else 0
            biases[i] += walk.gauss(0, wander / math.sqrt(rate))
        made.append([stamp, *values])
    return made


def direction(rng):
    v = [rng.gauss(0, 1) for _ in range(3)]
    length = math.hypot(*v)
    return [x / length for x in v]


def rotated(matrix, axis, angle):
    """The rotation of a row-major 4x4 matrix, rotated from the left by Rodrigues' formula."""
    c, s = math.cos(angle), math.sin(angle)
    x, y, z = axis
    rotation = [[c + x * x * (1 - c), x * y * (1 - c) - z * s, x * z * (1 - c) + y * s],
            [y * x * (1 - c) + z * s, c + y * y * (1 - c), y * z * (1 - c) - x * s],
            [z * x * (1 - c) - y * s, z * y * (1 - c) + x * s, c + z * z * (1 - c)]]
    made = list(matrix)
    for i in range(3):
        for j in range(3):
            made[4 * i + j] = sum(rotation[i][k] * matrix[4 * k + j] for k in range(3))
    return made


def worse_calibration(text, what, seed):
    if "extrinsics" in what:
        rng = random.Random(f"extrinsics {seed}")
        matrix = rotated(numbers(text, "data"), direction(rng), ROTATION_OFF)
        for i, d in enumerate(direction(rng)):
            matrix[4 * i + 3] += TRANSLATION_OFF * d
        text = put(text, "data", matrix)
    if "intrinsics" in what:
        rng = random.Random(f"intrinsics {seed}")
        fx, fy, cx, cy = numbers(text, "intrinsics")
        scale = 1 + rng.choice((-1, 1)) * FOCAL_OFF
        centre = [rng.choice((-1, 1)) * CENTRE_OFF for _ in range(2)]
        text = put(text, "intrinsics", [scale * fx, scale * fy, cx + centre[0], cy + centre[1]])
    if "time_offset" in what:
        text += f"time_offset_s: {random.Random(f'time offset {seed}').choice((-1, 1)) * TIME_OFF}\n"
    return text


def assemble(exact, images, out, noise, bias, calibration, seed):
    (out / "cam0").mkdir(parents=True)
    (out / "imu0").mkdir()
    (out / "cam0/data").symlink_to((images / "cam0/data").resolve())
    shutil.copy(images / "cam0/data.csv", out / "cam0/data.csv")
    camera = (exact / "cam0/sensor.yaml").read_text()
    (out / "cam0/sensor.yaml").write_text(worse_calibration(camera, calibration, seed))
    shutil.copytree(exact / "state_groundtruth_estimate0", out / "state_groundtruth_estimate0")
    yaml = (exact / "imu0/sensor.yaml").read_text()
    (out / "imu0/sensor.yaml").write_text(yaml)
    header, *lines = (exact / "imu0/data.csv").read_text().splitlines()
    rows = [[line.split(",")[0], *map(float, line.split(",")[1:])] for line in lines]
    rows = worse_imu(rows, yaml, noise, bias, seed)
    text = [header, *(",".join([stamp, *(f"{v:.10f}" for v in values)]) for stamp, *values in rows)]
    (out / "imu0/data.csv").write_text("\n".join(text) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--exact", type=Path, required=True, metavar="RECORDING")
    parser.add_argument("--images", type=Path, required=True, metavar="RECORDING")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--noise", action="store_true")
    parser.add_argument("--bias", action="store_true")
    parser.add_argument("--calibration", nargs="*", default=[], choices=["extrinsics", "time_offset", "intrinsics"])
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    assemble(options.exact / "mav0", options.images / "mav0", options.out / "mav0", options.noise, options.bias,
             options.calibration, options.seed)


if __name__ == "__main__":
    main()
