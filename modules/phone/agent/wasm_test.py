#!/usr/bin/env python3
"""The agent as WebAssembly, in Node, against pangea-vio on a rendered recording of a phone.

wasm_test.py PROGRAMS WASM WORK
"""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

MAX_WASM_BYTES = 3_200_000  # of them 178 kB are the weights of the descriptor
MAX_HEAP_MB = 64
DESCRIPTOR_BYTES = 32
MAX_OTHER_BITS = 12  # of 256: matches are decided at 74 and more
MAX_PREINTEGRATION_OFF = 1e-3


def run(*command, expect=0):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    assert done.returncode == expect, f"{command[0]}: {done.returncode}\n{done.stdout}{done.stderr}"
    return done.stdout + done.stderr


def keyframes(programs, log):
    """Of a log, as our own decoder reads them."""
    lines = run(programs / "pangea-log", "list", "--json", "--channels", "KEYFRAME_1", log).splitlines()
    return [json.loads(line)["message"]["keyframe"]["keyframe"] for line in lines]  # of keyframe_3_t


def rows(numbers, count):
    width = len(numbers) // count
    return [numbers[at:at + width] for at in range(0, len(numbers), width)]


def off(here, there):
    """The largest difference of two matrices of nine rows, as a share of its row's largest number."""
    return max(max(abs(a - b) for a, b in zip(x, y)) / max(map(abs, y)) for x, y in zip(rows(here, 9), rows(there, 9)))


def integrates_as_native(wasm, native):
    """Of one motion both know alike what a bias does to it, and how certain it is."""
    both = [(a["preintegration"], b["preintegration"]) for a, b in zip(wasm, native) if b["has_preintegration"]]
    assert len(both) > 5
    for matrix in ("bias_jacobian", "covariance"):
        worst = max(off(a[matrix], b[matrix]) for a, b in both)
        print(f"{matrix}: {worst:.1e} of native's off")
        assert worst < MAX_PREINTEGRATION_OFF, f"{matrix}: {worst:.1e} of native's off"


def describes_as_native(wasm, native):
    """The network computes the same bits; but the places of blobs differ in their last digits, because OpenCV rounds otherwise."""
    bits = [bin((x ^ y) & 255).count("1") for a, b in zip(wasm, native) for x, y in zip(a["descriptors"], b["descriptors"])]
    descriptors = [sum(bits[i:i + DESCRIPTOR_BYTES]) for i in range(0, len(bits), DESCRIPTOR_BYTES)]
    others = sum(map(bool, descriptors)) / len(descriptors)
    print(f"{100 * others:.1f} % of the descriptors differ from native's, in at most {max(descriptors)} bits")
    assert others < 0.04 and max(descriptors) <= MAX_OTHER_BITS


def numbers(yaml, key):
    return [float(number) for number in re.findall(r"[-+.\de]+", re.search(rf"^ *{key}:([^#\n]*)", yaml, re.M)[1])]


def calibrates_as_native(programs, agent, recording, work):
    """Without sensor.yaml of the camera: the same result as pangea-calibrate's, and as near to the truth as it says."""
    truth = (recording / "mav0/cam0/sensor.yaml").read_text()
    unknown = work / "unknown"
    shutil.copytree(recording, unknown)
    (unknown / "mav0/cam0/sensor.yaml").unlink()
    run(programs / "pangea-calibrate", unknown, "--out", work / "calibrated")
    run("node", agent, "--agent", "1", "--recording", unknown, "--rate", "max", "--out-camera", work / "camera.yaml")
    native = (work / "calibrated/mav0/cam0/sensor.yaml").read_text()
    wasm = (work / "camera.yaml").read_text()
    print(wasm)
    for key, sigma in (("intrinsics", "intrinsics_sigma"), ("distortion_coefficients", "distortion_sigma"),
                       ("time_offset_s", "time_offset_sigma"), ("readout_s", "readout_sigma")):
        for there, here, sigma_of_it in zip(numbers(native, key), numbers(wasm, key), numbers(native, sigma)):
            assert abs(here - there) < 0.3 * sigma_of_it, f"{key}: {here}, and pangea-calibrate says {there}"
    for key, sigma in (("intrinsics", "intrinsics_sigma"), ("readout_s", "readout_sigma")):
        for exact, here, sigma_of_it in zip(numbers(truth, key), numbers(wasm, key), numbers(wasm, sigma)):
            assert abs(here - exact) < 3 * sigma_of_it, f"{key}: {here} +- {sigma_of_it}, and the truth is {exact}"


def refuses(agent, words, message):
    said = run("node", agent, *words, expect=1)
    assert message in said, said


def main(programs, wasm, work):
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    recording = work / "walk"
    run(programs / "pangea-sim", "--no-cache", "--shrink", "2", "--generate", "walk", "--camera", "phone", "--duration", "14",
        "--path-seed", "1", "--seed", "1", "--out", recording)
    agent = wasm / "pangea-agent.mjs"
    common = ["--agent", "1", "--recording", recording, "--rate", "max"]
    native_files = ["--out-tum", work / "native.tum", "--out-keyframes", work / "native.lcm"]
    wasm_files = ["--out-tum", work / "wasm.tum", "--out-keyframes", work / "wasm.lcm"]
    run(programs / "pangea-vio", "--bus", "none", *common, *native_files)
    said = run("node", agent, *common, *wasm_files)
    print(said)

    of_native, of_wasm = keyframes(programs, work / "native.lcm"), keyframes(programs, work / "wasm.lcm")
    expected, found = ([keyframe["utime"] for keyframe in kept] for kept in (of_native, of_wasm))
    assert len(expected) >= 8
    assert found == expected, f"keyframes {found}, and pangea-vio's are {expected}"
    describes_as_native(of_wasm, of_native)
    integrates_as_native(of_wasm, of_native)
    native, poses = ((work / tum).read_text().splitlines() for tum in ("native.tum", "wasm.tum"))
    others = [pose for pose, expected in zip(poses, native) if pose != expected]
    assert poses == native, f"{len(others)} of {len(native)} poses are not pangea-vio's, the first: {others[:1]}"
    heap_mb = float(re.search(r"heap ([\d.]+) MB", said)[1])
    assert heap_mb < MAX_HEAP_MB, heap_mb
    assert (wasm / "pangea_agent.wasm").stat().st_size < MAX_WASM_BYTES

    calibrates_as_native(programs, agent, recording, work)

    refuses(agent, ["--agent", "1"], "--recording DIR is missing")
    refuses(agent, ["--recording", recording], "--agent ID is missing")
    refuses(agent, ["--recording", recording, "--agent", "70000"], "agent: a whole number from 1 to 65535")
    refuses(agent, ["--recording", work / "none", "--agent", "1"], "no such file")
    options = work / "options.yaml"
    options.write_text("tracker: {max_feature: 3}\n")
    refuses(agent, ["--recording", recording, "--agent", "1", "--options", options], "max_feature")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
