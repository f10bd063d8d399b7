// Reads a recording in EuRoC's format (docs/recordings.md): the calibration if there is one, inertial samples, and the list of images.

import { Matrix4 } from "three";
import { kPhoneImu } from "../sensors/calibration";
import { imuExtrinsics } from "../sensors/sensor_file";
import { parseCamera } from "../view/camera_model";
import type { CameraModel } from "../view/camera_model";
import type { Files } from "./files";

export interface ImuSample {
  utime: number; // us
  gyro: [number, number, number]; // rad/s, body
  accel: [number, number, number]; // m/s^2, body
}

interface RecordedImage {
  utime: number;
  name: string; // among the files
}

export interface Recording {
  files: Files;
  imuYaml: string;
  imu: ImuSample[];
  images: RecordedImage[];
  // Both are missing without cam0/sensor.yaml.
  camera?: CameraModel;
  cameraYaml?: string;
}

export type CalibratedRecording = Recording & Required<Pick<Recording, "camera" | "cameraYaml">>;

export const isCalibrated = (recording: Recording): recording is CalibratedRecording => recording.camera !== undefined;

// The recording with the calibration from the text of a cam0/sensor.yaml; `file` is its name in messages.
export function withCamera(recording: Recording, cameraYaml: string, file: string): CalibratedRecording {
  const T_rig_body = imuExtrinsics(recording.imuYaml, "imu0/sensor.yaml");
  return { ...recording, cameraYaml, camera: parseCamera(cameraYaml, file, T_rig_body) };
}

const text = async (files: Files, name: string) => new TextDecoder().decode(await files.read(name));

// The folder that contains cam0 and imu0, with a final slash.
function rootOf(names: string[]): string {
  const roots = names
    .map((name) => /^(.*?)cam0\/data\.csv$/.exec(name)?.[1])
    .filter((root) => root !== undefined);
  if (roots.length === 0) throw new Error("no EuRoC recording: there is no cam0/data.csv");
  if (roots.length > 1) throw new Error(`drop one recording at a time: there are ${roots.join(", ")}`);
  return roots[0];
}

// Time stamps in nanoseconds do not fit a double, so their last three digits are cut off before conversion.
const utimeOf = (nanoseconds: string) => Number(nanoseconds.trim().slice(0, -3));

function rows(csv: string, file: string, columns: number): string[][] {
  const lines = csv.split("\n").map((line) => line.trim()).filter((line) => line !== "" && !line.startsWith("#"));
  const good = lines.map((line) => line.split(",")).filter((row) =>
    row.length >= columns && /^\s*\d{4,}\s*$/.test(row[0]));
  if (good.length === 0 || lines.length - good.length > Math.max(1, lines.length / 10)) {
    throw new Error(`${file}: ${lines.length - good.length} of ${lines.length} rows are not ` +
      `a stamp in nanoseconds and ${columns - 1} more columns`);
  }
  return good;
}

function growing<T extends { utime: number }>(items: T[]): T[] {
  const sorted = [...items].sort((a, b) => a.utime - b.utime);
  return sorted.filter(({ utime }, i) => i === 0 || utime > sorted[i - 1].utime);
}

function parseImu(csv: string, file: string): ImuSample[] {
  const samples = rows(csv, file, 7).map((row) => {
    const values = row.slice(1, 7).map(Number);
    return {
      utime: utimeOf(row[0]),
      gyro: values.slice(0, 3) as ImuSample["gyro"],
      accel: values.slice(3, 6) as ImuSample["accel"],
    };
  });
  return growing(samples.filter(({ gyro, accel }) => [...gyro, ...accel].every(Number.isFinite)));
}

export async function openRecording(files: Files): Promise<Recording> {
  const root = rootOf(files.names);
  const present = new Set(files.names);
  if (!present.has(`${root}imu0/data.csv`)) throw new Error(`${root}imu0/data.csv is missing`);
  // TUM-VI has its calibration in dso/ beside mav0.
  const dso = `${root.replace(/[^/]*\/$/, "")}dso`;
  const firstPresent = (...candidates: string[]) => candidates.find((name) => present.has(name));
  const imuFile = firstPresent(`${root}imu0/sensor.yaml`, `${dso}/imu_config.yaml`);
  const imuYaml = imuFile === undefined ? kPhoneImu : await text(files, imuFile);
  const imu = parseImu(await text(files, `${root}imu0/data.csv`), `${root}imu0/data.csv`);
  const images = growing(
    rows(await text(files, `${root}cam0/data.csv`), `${root}cam0/data.csv`, 2)
      .map(([stamp, name]) => ({ utime: utimeOf(stamp), name: `${root}cam0/data/${name.trim()}` }))
      .filter(({ name }) => present.has(name)),
  );
  if (images.length === 0) throw new Error(`${root}cam0/data: none of the images of data.csv is there`);
  const recording = { files, imuYaml, imu, images };
  const cameraFile = firstPresent(`${root}cam0/sensor.yaml`, `${dso}/camchain.yaml`);
  if (cameraFile !== undefined) return withCamera(recording, await text(files, cameraFile), cameraFile);
  if (imuFile !== undefined && !imuExtrinsics(imuYaml, imuFile).equals(new Matrix4())) {
    throw new Error(`${imuFile}: field 'T_BS' must be the identity where ${root}cam0/sensor.yaml is missing: the camera is calibrated to the IMU`);
  }
  return recording;
}
