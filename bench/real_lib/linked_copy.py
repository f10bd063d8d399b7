#!/usr/bin/env python3
"""Makes a copy of a recording with other sensor.yaml files, or with other single values in them; images and samples are links."""

import argparse
import re
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from accuracy_lib.plan import mav0_of  # noqa: E402

SENSORS = {"cam0": "intrinsics", "imu0": "gyroscope_noise_density"}  # a key that only its sensor.yaml has


def sensor_of(text):
    found = [name for name, key in SENSORS.items() if re.search(rf"^{key}:", text, re.M)]
    if len(found) != 1:
        raise SystemExit("real: a sensor.yaml is of a camera or of an IMU: it has " + " or ".join(SENSORS.values()))
    return found[0]


def changed(texts, key, value):
    """The only sensor.yaml that has the key, with this value."""
    having = [name for name, text in texts.items() if re.search(rf"^{key}:", text, re.M)]
    if len(having) != 1:
        raise SystemExit(f"real: --set {key}: {len(having)} sensor.yaml have it, one is needed")
    texts[having[0]] = re.sub(rf"^{key}:.*$", f"{key}: {value}", texts[having[0]], flags=re.M)


def make(source, out, files, values):
    texts = {name: (source / name / "sensor.yaml").read_text() for name in SENSORS}
    for file in files:
        text = file.read_text()
        texts[sensor_of(text)] = text
    for item in values:
        changed(texts, *item.split("=", 1))
    for entry in sorted(source.iterdir()):
        if entry.name not in SENSORS:
            (out / entry.name).symlink_to(entry.resolve())
            continue
        (out / entry.name).mkdir()
        for inner in sorted(entry.iterdir()):
            if inner.name != "sensor.yaml":
                (out / entry.name / inner.name).symlink_to(inner.resolve())
        (out / entry.name / "sensor.yaml").write_text(texts[entry.name])


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recording", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--sensor-yaml", type=Path, nargs="+", default=[])
    parser.add_argument("--set", nargs="+", default=[], metavar="KEY=VALUE")
    options = parser.parse_args()
    (options.out / "mav0").mkdir(parents=True)
    make(mav0_of(options.recording), options.out / "mav0", options.sensor_yaml, options.set)


if __name__ == "__main__":
    main()
