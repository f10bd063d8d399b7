#!/usr/bin/env python3
"""Makes a recording from another one, with faults that occur between a sensor and a folder. Unchanged images are links to the other's."""

import argparse
import math
import random
import shutil
import sys
from operator import add
from pathlib import Path
from statistics import mean, median

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from ablation_lib.recording import direction, numbers, put, rotated  # noqa: E402
from generalization_lib import pictures  # noqa: E402
from generalization_lib.people import crowd, people  # noqa: E402

NS = 1_000_000_000
GRAVITY = 9.81
# A phone's IMU: white noise and random walks several times EuRoC's, at 100 Hz (densities of the order of the BMI160's).
PHONE = {"gyroscope_noise_density": 5e-4, "gyroscope_random_walk": 5e-5, "accelerometer_noise_density": 1e-2,
         "accelerometer_random_walk": 3e-3}


class Recording:
    """Rows of the two tables as text, the two sensor.yaml, and the images to paint over: file -> a function of its pixels.

    An image that the source does not have is made of another one: `origins`, file -> the source's file.
    """

    def __init__(self, mav0):
        self.mav0 = mav0
        self.painted = {}
        self.origins = {}
        self.images = self._rows(mav0 / "cam0/data.csv")
        self.imu = self._rows(mav0 / "imu0/data.csv")
        self.camera_yaml = (mav0 / "cam0/sensor.yaml").read_text()
        self.imu_yaml = (mav0 / "imu0/sensor.yaml").read_text()

    @staticmethod
    def _rows(csv):
        return [line.split(",") for line in csv.read_text().splitlines() if line and line[0] != "#"]

    def stamp(self, row):
        return int(row[0]) - int(self.images[0][0])

    def write(self, mav0):
        for name, yaml, rows in (("cam0", self.camera_yaml, self.images), ("imu0", self.imu_yaml, self.imu)):
            (mav0 / name).mkdir(parents=True)
            (mav0 / name / "sensor.yaml").write_text(yaml)
            (mav0 / name / "data.csv").write_text("#\n" + "\n".join(",".join(row) for row in rows) + "\n")


    def write_images(self, source, folder):
        """Writes the images that are painted over, and links to the others."""
        if not self.painted:
            folder.symlink_to(source.resolve())
            return
        folder.mkdir()
        for name in {row[1] for row in self.images}:
            if name in self.painted:
                width, pixels = pictures.read(source / self.origins.get(name, name))
                pictures.write(folder / name, width, self.painted[name](pixels))
            else:
                (folder / name).symlink_to((source / name).resolve())


def in_gap(ns, every_s, gap_s):
    """Whether a time lies in a gap at the end of every so many seconds."""
    return ns % int(every_s * NS) >= int((every_s - gap_s) * NS)


def image_gaps(recording):
    """0.3 s of images missing every 5 s."""
    first = recording.images[0]
    recording.images = [row for row in recording.images if row is first or not in_gap(recording.stamp(row), 5, 0.3)]


def lone_images(recording):
    """Every tenth image missing, at random."""
    rng = random.Random("lone images")
    recording.images = [row for row in recording.images if rng.random() > 0.1]


def half_rate(recording):
    """Every second image."""
    recording.images = recording.images[::2]


def imu_gaps(recording):
    """50 ms of IMU samples missing every 3 s."""
    recording.imu = [row for row in recording.imu if not in_gap(recording.stamp(row), 3, 0.05)]


def disorder(recording):
    """Doubled rows, and rows swapped with their neighbours."""
    for rows in (recording.images, recording.imu):
        for i in range(50, len(rows) - 1, 97):
            rows[i], rows[i + 1] = rows[i + 1], rows[i]
        for i in reversed(range(30, len(rows), 71)):
            rows.insert(i, list(rows[i]))


def focal_length(recording):
    """Focal length 0.5 % too long."""
    fx, fy, cx, cy = numbers(recording.camera_yaml, "intrinsics")
    recording.camera_yaml = put(recording.camera_yaml, "intrinsics", [1.005 * fx, 1.005 * fy, cx, cy])


def extrinsics(recording):
    """Camera rotated by 0.5 degrees against the IMU."""
    matrix = rotated(numbers(recording.camera_yaml, "data"), direction(random.Random("extrinsics")), math.radians(0.5))
    recording.camera_yaml = put(recording.camera_yaml, "data", matrix)


def late_images(recording):
    """The IMU's clock 40 ms ahead of the camera's: t_imu = t_image + 0.04 s."""
    for row in recording.imu:
        row[0] = str(int(row[0]) + 40_000_000)


def phone_imu(recording):
    """Every second sample, with a phone's noise, which the data sheet knows."""
    rng, rate = random.Random("phone imu"), 100
    density = [PHONE["gyroscope_noise_density"]] * 3 + [PHONE["accelerometer_noise_density"]] * 3
    walk = [PHONE["gyroscope_random_walk"]] * 3 + [PHONE["accelerometer_random_walk"]] * 3
    bias = [0.0] * 6
    recording.imu = recording.imu[::2]
    for row in recording.imu:
        for i in range(6):
            row[1 + i] = f"{float(row[1 + i]) + bias[i] + rng.gauss(0, density[i] * math.sqrt(rate)):.10f}"
            bias[i] += rng.gauss(0, walk[i] / math.sqrt(rate))
    lines = [line for line in recording.imu_yaml.splitlines() if line.split(":")[0] not in (*PHONE, "rate_hz")]
    recording.imu_yaml = "\n".join([*lines, f"rate_hz: {rate}", *(f"{key}: {value}" for key, value in PHONE.items())]) + "\n"


def jitter(recording):
    """Stamps of images with errors of 2 ms (standard deviation), as of stamps by software."""
    rng = random.Random("jitter")
    for row in recording.images:
        row[0] = str(int(row[0]) + int(rng.gauss(0, 2_000_000)))


def accel_bias(recording):
    """0.3 m/s^2 more along the first axis, as of an uncalibrated phone."""
    for row in recording.imu:
        row[4] = f"{float(row[4]) + 0.3:.10f}"


def cover(recording, *spans):
    """Dark images of noise from one second to another one."""
    rng = random.Random("cover")
    noise = bytes(max(0, min(255, round(6 + rng.gauss(0, 2)))) for _ in range(256))
    for row in recording.images:
        if any(begin <= recording.stamp(row) / NS < end for begin, end in spans):
            recording.painted[row[1]] = lambda pixels: rng.randbytes(len(pixels)).translate(noise)


def scaled_noise(recording, times):
    lines = []
    for line in recording.imu_yaml.splitlines():
        key, _, value = line.partition(":")
        is_noise = key in PHONE
        lines.append(f"{key}: {times * float(value.split('#')[0])}" if is_noise else line)
    recording.imu_yaml = "\n".join(lines) + "\n"


def noise_10_times(recording):
    """Noise densities and random walks given ten times too large."""
    scaled_noise(recording, 10)


def noise_a_tenth(recording):
    """Noise densities and random walks given ten times too small."""
    scaled_noise(recording, 0.1)


def third_of_imu(recording):
    """Every third sample: with 200 Hz this is about a browser's rate."""
    recording.imu = recording.imu[::3]


def large_accel_bias(recording):
    """(0.35, -0.25, 0.25) m/s^2: 0.5 in all."""
    for row in recording.imu:
        row[4:7] = [f"{float(value) + bias:.10f}" for value, bias in zip(row[4:7], (0.35, -0.25, 0.25))]


def accel_scale(recording):
    """The accelerometer shows 2.5 % too much."""
    for row in recording.imu:
        row[4:7] = [f"{1.025 * float(value):.10f}" for value in row[4:7]]


def lost_imu(recording):
    """Three of 97 samples lost."""
    recording.imu = [row for i, row in enumerate(recording.imu) if i % 97 not in (5, 6, 7)]


def doubled_imu(recording):
    """Every 50th sample twice."""
    recording.imu = [copy for i, row in enumerate(recording.imu) for copy in ([row, row] if i % 50 == 7 else [row])]


def covered(recording):
    """A hand over the lens, for 1 s and for 2 s."""
    cover(recording, (10, 11), (25, 27))


def hand(recording):
    """A hand over the lens, for 3 s and for 4.5 s."""
    cover(recording, (10, 13), (25, 29.5))


def pocket(recording):
    """Dark images of noise for 8 s."""
    cover(recording, (15, 23))


def exposure_steps(recording):
    """Every 3 s the exposure jumps, to 0.4 times, to 1.8 times, and back."""
    for row in recording.images:
        gain = (1, 0.4, 1.8)[recording.stamp(row) // (3 * NS) % 3]
        table = bytes(min(255, round(gain * grey)) for grey in range(256))
        if gain != 1:
            recording.painted[row[1]] = lambda pixels, table=table: pixels.translate(table)


def browser_motion(recording):
    """The motion as Chromium gives it: 60 Hz, rounded to 0.1 m/s^2 and 0.1 degrees/s; its noise as the phone's page says."""
    step_rad, step_mps2 = math.radians(0.1), 0.1
    due, chosen = 0, []
    for row in recording.imu:
        if (at := int(row[0]) - int(recording.imu[0][0])) >= due:
            due += NS / 60 * (1 + (at - due) // (NS / 60))
            steps = [step_rad] * 3 + [step_mps2] * 3
            chosen.append([row[0], *(f"{round(float(value) / step) * step:.9f}" for value, step in zip(row[1:7], steps))])
    recording.imu = chosen
    page = (Path(__file__).resolve().parents[2] / "modules/phone/page/src/sensors/calibration.ts").read_text()
    recording.imu_yaml = page.split("kPhoneImu = `")[1].split("`")[0]


def browser_stamps(recording):
    """Stamps of images with errors of 8 ms (standard deviation), as of stamps by a browser."""
    rng = random.Random("browser stamps")
    for row in recording.images:
        row[0] = str(int(row[0]) + int(rng.gauss(0, 8_000_000)))


def copies_at_60_hz(recording):
    """Each image again every 60th of a second until the next one, as a browser shows them."""
    stamps = [int(row[0]) for row in recording.images]
    ends = [*stamps[1:], 2 * stamps[-1] - stamps[-2]]
    recording.images = [[str(stamp), *row[1:]] for row, begin, end in zip(recording.images, stamps, ends)
                        for stamp in range(begin, end - NS // 120, NS // 60)]


def repeated_images(recording):
    """One in five images repeats the one before it, as of a camera that drops images."""
    rng = random.Random("repeated images")
    for before, row in zip(recording.images, recording.images[1:]):
        if rng.random() < 0.2:
            row[1] = before[1]


def shown_too_early(recording):
    """Every other image shows the one after it: its last stamp is the right one."""
    for row, after in zip(recording.images[::2], recording.images[1::2]):
        row[1] = after[1]


def scaled_imu(recording, columns, factor):
    for row in recording.imu:
        row[columns] = [f"{factor * float(value):.10f}" for value in row[columns]]


def negated_accel(recording):
    """The accelerometer with the opposite sign, as some systems' conventions have it."""
    scaled_imu(recording, slice(4, 7), -1)


def negated_gyro(recording):
    """The gyroscope with the opposite sign."""
    scaled_imu(recording, slice(1, 4), -1)


def gyro_in_degrees(recording):
    """The gyroscope in degrees/s."""
    scaled_imu(recording, slice(1, 4), math.degrees(1))


def swapped_accel(recording):
    """The first two axes of the accelerometer swapped."""
    for row in recording.imu:
        row[4], row[5] = row[5], row[4]


def noisy(rng, sigma):
    """A function that adds new noise to an image's pixels."""
    largest = math.ceil(3 * sigma)
    noise = bytes(largest + max(-largest, min(largest, round(rng.gauss(0, sigma)))) for _ in range(256))
    clipped = bytes(max(0, min(255, grey - largest)) for grey in range(256 + 2 * largest))
    return lambda pixels: bytes(map(clipped.__getitem__, map(add, pixels, rng.randbytes(len(pixels)).translate(noise))))


def rest(recording, seconds=10, image_sigma=2):
    """10 s before the first image in which the body is stationary: that image again and again with new noise, and an IMU with the
    noise of its data sheet about the force of the first quarter of a second. It suits a recording that begins slowly."""
    rng = random.Random("rest")
    first, image_step = recording.images[0], int(recording.images[1][0]) - int(recording.images[0][0])
    rate = numbers(recording.imu_yaml, "rate_hz")
    recording.imu = [row for row in recording.imu if recording.stamp(row) >= 0]
    columns = list(zip(*((float(value) for value in row[1:7]) for row in recording.imu)))
    force = [mean(column[:round(rate / 4)]) for column in columns[3:]]
    scale = GRAVITY / math.hypot(*force)
    means = [median(column) for column in columns[:3]] + [scale * value for value in force]  # the median rate is about the bias
    sigmas = [numbers(recording.imu_yaml, f"{sensor}_noise_density") * math.sqrt(rate)
              for sensor in ("gyroscope", "accelerometer") for _ in range(3)]
    samples = [[str(int(recording.imu[0][0]) - round(i * NS / rate)), *(f"{rng.gauss(m, s):.10f}" for m, s in zip(means, sigmas))]
               for i in range(round(seconds * rate), 0, -1)]
    images = [[str(int(first[0]) - i * image_step), f"rest_{i}.png"] for i in range(seconds * NS // image_step, 0, -1)]
    for _, name in images:
        recording.painted[name], recording.origins[name] = noisy(rng, image_sigma), first[1]
    recording.imu, recording.images = samples + recording.imu, images + recording.images


def product(a, b):
    """The product of two 4x4 matrices, row by row."""
    return [sum(a[4 * i + k] * b[4 * k + j] for k in range(4)) for i in range(4) for j in range(4)]


def inverse_extrinsics(recording):
    """T_BS in the wrong direction: camera from body."""
    m = numbers(recording.camera_yaml, "data")
    inverse = [value for i in range(3) for value in (m[i], m[4 + i], m[8 + i], -sum(m[4 * k + i] * m[4 * k + 3] for k in range(3)))]
    recording.camera_yaml = put(recording.camera_yaml, "data", [*inverse, 0, 0, 0, 1])


def turned_camera(recording):
    """The camera rotated by 90 degrees about its optical axis."""
    matrix = product(numbers(recording.camera_yaml, "data"), [0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1])
    recording.camera_yaml = put(recording.camera_yaml, "data", matrix)


def backward_camera(recording):
    """The camera rotated by 180 degrees about the image's vertical."""
    matrix = product(numbers(recording.camera_yaml, "data"), [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1])
    recording.camera_yaml = put(recording.camera_yaml, "data", matrix)


def scaled_focal_length(recording, factor):
    fx, fy, cx, cy = numbers(recording.camera_yaml, "intrinsics")
    recording.camera_yaml = put(recording.camera_yaml, "intrinsics", [factor * fx, factor * fy, cx, cy])


def long_focal_length(recording):
    """Focal length 1.4 times too long, as of another resolution."""
    scaled_focal_length(recording, 1.4)


def short_focal_length(recording):
    """Focal length 0.7 times too short."""
    scaled_focal_length(recording, 0.7)


SPOILERS = {f.__name__: f for f in (half_rate, image_gaps, lone_images, imu_gaps, disorder, focal_length, extrinsics, late_images,
                                    jitter, accel_bias, phone_imu, noise_10_times, noise_a_tenth, third_of_imu, large_accel_bias,
                                    accel_scale, lost_imu, doubled_imu, browser_motion, browser_stamps, covered, hand, pocket,
                                    exposure_steps, people, crowd,
                                    copies_at_60_hz, repeated_images, shown_too_early, negated_accel, negated_gyro,
                                    gyro_in_degrees, swapped_accel, rest, inverse_extrinsics, turned_camera, backward_camera,
                                    long_focal_length, short_focal_length)}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("source", type=Path, metavar="RECORDING")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--what", nargs="+", required=True, choices=list(SPOILERS))
    options = parser.parse_args()
    source, out = options.source / "mav0", options.out / "mav0"
    recording = Recording(source)
    for what in options.what:
        SPOILERS[what](recording)
    recording.write(out)
    recording.write_images(source / "cam0/data", out / "cam0/data")
    for truth in (source / "state_groundtruth_estimate0", source.parent / "reference.colmap.tum"):
        if truth.is_dir():
            shutil.copytree(truth, out / truth.name)
        elif truth.is_file():
            shutil.copy(truth, options.out / truth.name)


if __name__ == "__main__":
    main()
