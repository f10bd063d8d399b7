"""The BLAS that the server computes with on this machine: time and last bits of its results depend on it."""

import subprocess
from pathlib import Path


def blas(programs):
    """ "BLAS: OpenBLAS 0.3.21, kernel Zen (/usr/lib/...)"; `programs`: the folder with pangea-posegraph."""
    done = subprocess.run([Path(programs) / "pangea-posegraph", "--version"], check=True, capture_output=True, text=True)
    return done.stdout.splitlines()[1]
