import assert from "node:assert/strict";
import { test } from "node:test";
import { isCalibrated, openRecording, withCamera } from "./euroc";
import { filesOf } from "./files";
import { RecordingWriter } from "./writer";
import { filesOfZip } from "./zip";

const kCamera = `T_BS: {cols: 4, rows: 4, data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}
resolution: [640, 480]
intrinsics: [500, 500, 320, 240]
distortion_model: equidistant
distortion_coefficients: [0, 0, 0, 0]
`;
const kImu = "T_BS: {cols: 4, rows: 4, data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}\nrate_hz: 60\n";

function folder(changes: Record<string, string | undefined> = {}) {
  const contents: Record<string, string | undefined> = {
    "walk/mav0/cam0/sensor.yaml": kCamera,
    "walk/mav0/cam0/data.csv": "#timestamp,filename\n1700000000105000999,b.png\n1700000000055000000,a.png\n",
    "walk/mav0/cam0/data/a.png": "A",
    "walk/mav0/cam0/data/b.png": "B",
    "walk/mav0/imu0/sensor.yaml": kImu,
    "walk/mav0/imu0/data.csv": "#\n1700000000050000000,1,2,3,4,5,6\r\n1700000000060000000,0,0,0,0,0,9.8\n",
    ...changes,
  };
  const present = Object.entries(contents).filter((entry): entry is [string, string] => entry[1] !== undefined);
  return filesOf(new Map(present.map(([name, content]) => [name, new Blob([content])])));
}

test("reads a folder: microseconds, sorted", async () => {
  const { images, imu, camera } = await openRecording(folder());
  assert.deepEqual(images.map(({ utime }) => utime), [1700000000055000, 1700000000105000]);
  assert.equal(images[0].name, "walk/mav0/cam0/data/a.png");
  assert.deepEqual(imu[0], { utime: 1700000000050000, gyro: [1, 2, 3], accel: [4, 5, 6] });
  assert.equal(camera?.width, 640);
});

test("an image that is not there is left out; none at all is refused", async () => {
  const some = await openRecording(folder({ "walk/mav0/cam0/data/a.png": undefined }));
  assert.equal(some.images.length, 1);
  const none = folder({ "walk/mav0/cam0/data/a.png": undefined, "walk/mav0/cam0/data/b.png": undefined });
  await assert.rejects(openRecording(none), /none of the images/);
});

test("without calibration it opens, to be calibrated to its IMU", async () => {
  const recording = await openRecording(folder({ "walk/mav0/cam0/sensor.yaml": undefined, "walk/mav0/imu0/sensor.yaml": undefined }));
  assert.equal(isCalibrated(recording), false);
  assert.match(recording.imuYaml, /a phone's, as browsers deliver it/);
  assert.equal(withCamera(recording, kCamera, "mine").camera.width, 640);
  const shifted = kImu.replace("[1, 0, 0, 0,", "[1, 0, 0, 0.1,");
  const strange = folder({ "walk/mav0/cam0/sensor.yaml": undefined, "walk/mav0/imu0/sensor.yaml": shifted });
  await assert.rejects(openRecording(strange), /walk\/mav0\/imu0\/sensor.yaml: field 'T_BS' must be the identity/);
});

test("Kalibr's files serve too, also in dso/ beside mav0, as in TUM-VI", async () => {
  const camchain = `cam0:\n  ${kCamera.replace("radial-tangential", "radtan").trim().replaceAll("\n", "\n  ")}\n`;
  const imu = "accelerometer_noise_density: 0.0028\nupdate_rate: 200\n";
  const here = await openRecording(folder({ "walk/mav0/cam0/sensor.yaml": camchain, "walk/mav0/imu0/sensor.yaml": imu }));
  assert.equal(here.camera?.width, 640);
  const beside = { "walk/dso/camchain.yaml": camchain, "walk/dso/imu_config.yaml": imu, "walk/mav0/cam0/sensor.yaml": undefined, "walk/mav0/imu0/sensor.yaml": undefined };
  const tumVi = await openRecording(folder(beside));
  assert.deepEqual([tumVi.cameraYaml, tumVi.imuYaml], [camchain, imu]);
});

test("what is wrong is named with its file", async () => {
  const refused = (changes: Record<string, string | undefined>, says: RegExp) =>
    assert.rejects(openRecording(folder(changes)), says);
  await refused({ "walk/mav0/cam0/data.csv": undefined }, /no cam0\/data.csv/);
  await refused({ "walk/mav0/imu0/data.csv": undefined }, /walk\/mav0\/imu0\/data.csv is missing/);
  await refused({ "walk/mav0/imu0/data.csv": "1,2,3\n4,5,6\n" }, /imu0\/data.csv: 2 of 2 rows/);
  await refused({ "walk/mav0/cam0/sensor.yaml": "a: 1" }, /walk\/mav0\/cam0\/sensor.yaml: field/);
  await refused({ "two/mav0/cam0/data.csv": "" }, /one recording at a time/);
  await assert.rejects(filesOfZip(new Blob(["no zip"])), /this zip cannot be read/);
});

test("what the writer writes, the reader reads", async () => {
  const writer = new RecordingWriter("mine");
  writer.addImage(1700000000055000, new Uint8Array([1, 2, 3]), "jpg");
  writer.addImu({ utime: 1700000000050001, gyro: [0.1, -0.2, 0.3], accel: [0, 0, 9.8] });
  const files = await filesOfZip(await writer.finish(kCamera, kImu));
  const { images, imu, cameraYaml, imuYaml } = await openRecording(files);
  assert.deepEqual(imu, [{ utime: 1700000000050001, gyro: [0.1, -0.2, 0.3], accel: [0, 0, 9.8] }]);
  assert.equal(images[0].utime, 1700000000055000);
  assert.deepEqual([...(await files.read(images[0].name))], [1, 2, 3]);
  assert.deepEqual([cameraYaml, imuYaml], [kCamera, kImu]);
});

test("a recording that is too long for a zip is readable up to there", async () => {
  const writer = new RecordingWriter("long");
  for (let i = 0; i < 70_000 && !writer.isFull; ++i) writer.addImage(1700000000000000 + i, new Uint8Array([1]), "jpg");
  assert.ok(writer.numImages > 50_000);
  const { names } = await filesOfZip(await writer.finish(kCamera, kImu));
  assert.equal(names.length, writer.numImages + 4);
});

// A walk goes on while its recording is saved: a pause of 0.3 s would end its map. Other programs run beside a test, so CPU time counts.
test("finishing ten minutes does not hold up the page", async () => {
  const writer = new RecordingWriter("long");
  const jpeg = new Uint8Array(1000);
  for (let i = 0; i < 18_000; ++i) writer.addImage(1700000000000000 + 33_333 * i, jpeg, "jpg");
  for (let i = 0; i < 36_000; ++i) writer.addImu({ utime: 1700000000000000 + 16_667 * i, gyro: [Math.sin(i), 0.1, 1 / 3], accel: [Math.cos(i), 0, 9.8] });
  let longest_us = 0;
  let before = process.cpuUsage();
  const timer = setInterval(() => {
    const { user, system } = process.cpuUsage(before);
    longest_us = Math.max(longest_us, user + system);
    before = process.cpuUsage();
  });
  await writer.finish(kCamera, kImu);
  await new Promise((done) => setTimeout(done, 10));
  clearInterval(timer);
  assert.ok(longest_us < 200_000, `${longest_us / 1000} ms`);
});
