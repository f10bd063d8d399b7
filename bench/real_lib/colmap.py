#!/usr/bin/env python3
"""Structure from motion by COLMAP (package colmap) on every n-th image: camera poses up to scale, as TUM, with a piece for each model.

SIFT on the CPU; sequential matching, or all pairs if there are few images. The initial intrinsics are those of sensor.yaml.
"""

import argparse
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from ablation_lib.recording import numbers  # noqa: E402
from accuracy_lib.plan import mav0_of  # noqa: E402
from real_lib import rotations as rot  # noqa: E402
from real_lib import trajectory  # noqa: E402

FEATURES = 2000  # per image: the time to match them on a CPU grows with the square
FEW = 60  # images: up to this number all pairs are matched
APART_S = 10  # of a revisit
OVERLAP = 12  # number of following images with which each image is matched


def camera(sensor_yaml):
    """COLMAP's model and parameters."""
    text = sensor_yaml.read_text()
    values = [*numbers(text, "intrinsics"), *numbers(text, "distortion_coefficients")]
    model = "OPENCV_FISHEYE" if "equi" in text.split("distortion_model:", 1)[1].split("\n", 1)[0] else "OPENCV"
    return model, ",".join(map(str, values))


def chosen(mav0, every, seconds):
    """{file name: stamp in seconds} of every n-th image."""
    rows = [line.split(",") for line in (mav0 / "cam0/data.csv").read_text().splitlines() if line and line[0].isdigit()]
    end = int(rows[0][0]) + 1e9 * seconds if seconds else None
    return {row[1].strip(): int(row[0]) // 1000 / 1e6 for row in rows[::every] if end is None or int(row[0]) <= end}


def colmap(command, **arguments):
    words = [word for key, value in arguments.items() for word in ("--" + key.replace("__", "."), str(value))]
    subprocess.run(["colmap", command, *words], check=True)


def reconstruct(mav0, images, work, exhaustive):
    database, listed = work / "database.db", work / "images.txt"
    listed.write_text("\n".join(images) + "\n")
    model, parameters = camera(mav0 / "cam0/sensor.yaml")
    folder = mav0 / "cam0/data"
    colmap("feature_extractor", database_path=database, image_path=folder, image_list_path=listed, ImageReader__single_camera=1,
           ImageReader__camera_model=model, ImageReader__camera_params=parameters, SiftExtraction__use_gpu=0, SiftExtraction__max_num_features=FEATURES)
    if exhaustive or len(images) <= FEW:
        colmap("exhaustive_matcher", database_path=database, SiftMatching__use_gpu=0)
    else:
        colmap("sequential_matcher", database_path=database, SiftMatching__use_gpu=0, SequentialMatching__overlap=OVERLAP)
    (work / "models").mkdir()
    colmap("mapper", database_path=database, image_path=folder, output_path=work / "models")
    for found in sorted((work / "models").iterdir()):
        colmap("model_converter", input_path=found, output_path=found, output_type="TXT")
        yield found / "images.txt"


def covisible(images_txt, stamps):
    """(earlier stamp, later stamp, number of shared points) of the images more than APART_S apart."""
    rows = [line.split() for line in images_txt.read_text().splitlines() if not line.startswith("#")]
    points = sorted((stamps[pose[-1]], set(seen[2::3]) - {"-1"}) for pose, seen in zip(rows[::2], rows[1::2]))
    for i, (first, of_first) in enumerate(points):
        for second, of_second in points[i + 1:]:
            if second - first > APART_S and (shared := len(of_first & of_second)):
                yield first, second, shared


def read_model(images_txt, stamps):
    """Poses T_ref_cam; for each image COLMAP writes T_cam_ref, then a line of points."""
    poses = []
    rows = [line for line in images_txt.read_text().splitlines() if not line.startswith("#")]
    for row in rows[::2]:
        _, *pose, _, name = row.split()
        values = tuple(map(float, pose))
        poses.append((stamps[name], rot.inverse((rot.normalised(values[:4]), values[4:]))))
    return sorted(poses)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recording", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--every", type=int, required=True, metavar="N")
    parser.add_argument("--seconds", type=float, help="only the first ones")
    parser.add_argument("--exhaustive", action="store_true", help="match all pairs, and write covisible.csv: stamps of revisits, shared points")
    options = parser.parse_args()
    mav0 = mav0_of(options.recording)
    images = chosen(mav0, options.every, options.seconds)
    found = list(reconstruct(mav0, images, options.out, options.exhaustive))
    models = [read_model(file, images) for file in found]
    models.sort(key=len, reverse=True)
    text = [f"# T_ref_cam by COLMAP of every {options.every}th image: {sum(map(len, models))} of {len(images)} joined; up to scale"]
    text += [f"{trajectory.PIECE_MARK}\n{trajectory.tum(model)}" for model in models]
    (options.out / "reference.colmap.tum").write_text("\n".join(text))
    if options.exhaustive:
        pairs = [pair for file in found for pair in covisible(file, images)]
        (options.out / "covisible.csv").write_text("".join(f"{a:.6f},{b:.6f},{shared}\n" for a, b, shared in pairs))


if __name__ == "__main__":
    main()
