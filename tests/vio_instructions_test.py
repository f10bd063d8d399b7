#!/usr/bin/env python3
"""Tests the odometry's cost: valgrind counts its instructions on a short rendered recording, which are compared with a committed number.

    tests/vio_instructions_test.py PANGEA_VIO RECORDING [--print]

Decoding and the program's start are not counted. Fails above +5 %, and below -5 %: then the number below must be lowered. Skipped (77)
without valgrind, with other libraries than those of the committed number, and on a processor without AVX2.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

MILLIONS = 4861  # instructions, for 6 s at 20 images per second
TOLERANCE = 0.05
COUNTED_WITH = "libopencv_video.so.406"
SECONDS = 6
# Gives the same machine code on every processor with AVX2, which vio/vector_clones.h uses: no AVX in OpenCV and in the C library.
PLAIN = {"OPENCV_CPU_DISABLE": "AVX,FP16,AVX2,FMA3,AVX512-COMMON,AVX512-SKX",
         "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX,-AVX2,-FMA,-FMA4,-AVX2_Usable,-FMA_Usable,-ERMS"}


def skip(why):
    print(f"skipped: {why}")
    sys.exit(77)


def counted(vio, recording, folder):
    profile = folder / "callgrind.out"
    command = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={profile}", "--toggle-collect=pangea::vio::Vio::AddImage*",
               vio, "--agent", "1", "--bus", "none", "--rate", "max", "--map-utime", "1", "--recording", recording,
               "--duration", str(SECONDS), "--out-tum", str(folder / "vio.tum")]
    run = subprocess.run(command, env={**os.environ, **PLAIN}, capture_output=True, text=True)
    if run.returncode != 0:
        sys.exit(f"pangea-vio failed under valgrind:\n{run.stderr}")
    poses = len((folder / "vio.tum").read_text().splitlines())
    if poses < 10 * SECONDS:
        sys.exit(f"only {poses} poses: it is not the odometry that was counted")
    return int(re.search(r"^totals: (\d+)", profile.read_text(), re.MULTILINE).group(1)) / 1e6


def main():
    vio, recording = sys.argv[1:3]
    if not shutil.which("valgrind"):
        skip("valgrind is not installed")
    if COUNTED_WITH not in subprocess.run(["ldd", vio], capture_output=True, text=True).stdout:
        skip(f"the number is for {COUNTED_WITH}")
    if "avx2" not in Path("/proc/cpuinfo").read_text().split():
        skip("the number is for processors with AVX2")
    with tempfile.TemporaryDirectory() as folder:
        millions = counted(vio, recording, Path(folder))
    print(f"{millions:.0f} million instructions; {MILLIONS} are committed")
    if "--print" not in sys.argv and abs(millions - MILLIONS) > TOLERANCE * MILLIONS:
        sys.exit(f"{100 * (millions / MILLIONS - 1):+.1f} %: more than {100 * TOLERANCE:.0f} % off")


if __name__ == "__main__":
    main()
