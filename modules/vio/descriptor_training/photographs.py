"""Freely licensed photographs: those of packages in Debian's main archive."""

import pathlib
import subprocess

import cv2

PACKAGES = [  # Debian 12
    "opencv-doc=4.6.0+dfsg-12",
    "plasma-workspace-wallpapers=4:5.27.5-2",
    "mate-backgrounds=1.26.0-1",
    "python3-skimage=0.19.3-8",
    "python3-sklearn=1.2.1+dfsg-1",
    "ukui-wallpapers=20.04.3-1.1",
    "lomiri-wallpapers-16.04=20.04.0-2",
    "lomiri-wallpapers-20.04=20.04.0-2",
    "libvigraimpex-doc=1.11.1+dfsg-11",
]
SUFFIXES = {".jpg", ".jpeg", ".png", ".webp", ".tif"}
MIN_BYTES = 30_000  # smaller ones are icons
MIN_SIDE_PX = 240
MAX_SIDE_PX = 1400


def download(folder):
    """Unpacks the packages into folders of their own; those that are there already stay."""
    for package in PACKAGES:
        name = package.split("=")[0]
        target = folder / name
        if target.exists():
            continue
        archives = folder / "archives"
        archives.mkdir(parents=True, exist_ok=True)
        print(f"Downloading {package}", flush=True)
        subprocess.run(["apt-get", "download", "-qq", package], cwd=archives, check=True)
        (archive,) = archives.glob(f"{name}_*.deb")
        target.mkdir()
        subprocess.run(["dpkg-deb", "-x", archive, target], check=True)


def load(folder):
    """Grey images, at most MAX_SIDE_PX wide and high, in the order of their names."""
    images = []
    for package in PACKAGES:
        for path in sorted((folder / package.split("=")[0]).rglob("*")):
            if path.suffix.lower() not in SUFFIXES or not path.is_file():
                continue
            if path.stat().st_size <= MIN_BYTES:
                continue
            image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
            if image is None or min(image.shape) < MIN_SIDE_PX:
                continue
            scale = MAX_SIDE_PX / max(image.shape)
            if scale < 1:
                image = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
            images.append(image)
    return images
