// Converts browsers' motion data to the body frame. Body: the device's own axes, independent of the screen's orientation: x to the
// right of the device held upright, y to its top, z out of its screen.

export type Vector3 = [number, number, number];

// The rotation of T_a_b, row-major.
export type Matrix3 = [Vector3, Vector3, Vector3];

const kDegree = Math.PI / 180;

// A DeviceMotionEvent without nulls.
interface MotionReading {
  acceleration: Vector3; // accelerationIncludingGravity, m/s^2, with the platform's sign
  rate: Vector3; // rotationRate: alpha, beta, gamma, i.e. about x, y, z, deg/s
}

interface BodyMotion {
  gyro: Vector3; // rad/s
  accel: Vector3; // specific force, m/s^2: +9.81 upwards when stationary
}

// `sign`: 1 by the specification; -1 on platforms where up is negative (iOS).
export function toBody(reading: MotionReading, sign: 1 | -1): BodyMotion {
  return {
    gyro: reading.rate.map((value) => value * kDegree) as Vector3,
    accel: reading.acceleration.map((value) => value * sign) as Vector3,
  };
}

// The up direction in the body frame, from DeviceOrientationEvent's beta and gamma (deg; rotations about x, then y).
export function upInBody(beta_deg: number, gamma_deg: number): Vector3 {
  const [b, g] = [beta_deg * kDegree, gamma_deg * kDegree];
  return [-Math.cos(b) * Math.sin(g), Math.sin(b), Math.cos(b) * Math.cos(g)];
}

// Finds the sign that a platform gives to gravity. The first readings decide, by comparison with the orientation; then it is kept.
export class GravitySign {
  private static readonly kReadings = 10;
  private static readonly kMinAcceleration = 5; // m/s^2; a smaller value cannot be gravity
  private votes = 0;
  private numVotes = 0;

  add(acceleration: Vector3, up: Vector3) {
    if (this.decided) return;
    const along = acceleration.reduce((sum, value, i) => sum + value * up[i], 0);
    if (Math.abs(along) < GravitySign.kMinAcceleration) return;
    this.votes += Math.sign(along);
    ++this.numVotes;
  }

  get decided(): boolean {
    return this.numVotes >= GravitySign.kReadings;
  }

  // The specification's sign until the readings contradict it.
  get sign(): 1 | -1 {
    return this.votes < 0 ? -1 : 1;
  }
}

// R_body_cam of the back camera. Browsers deliver its image upright for the screen, which is rotated by `angle_deg`
// (screen.orientation.angle) to the device. Camera: x right, y down, z forward, away from the screen.
export function cameraInBody(angle_deg: number): Matrix3 {
  const [c, s] = [Math.round(Math.cos(angle_deg * kDegree)), Math.round(Math.sin(angle_deg * kDegree))];
  return [
    [c, -s, 0],
    [-s, -c, 0],
    [0, 0, -1],
  ];
}
