// Replaces pangea_agent.mjs in the page's own test: an agent that walks along odom's x at a height of 1.5 m, one centimetre per image,
// and gets an anchor of another agent and that agent's pose. Its status tells which data it got. The calibration is a fake too.

const kAnchor = [0, 3, 1.5]; // straight ahead at the start
const kOther = [1, 4, 1.5]; // its camera looks along odom's -y
const kMap = "1/1700000000000000";
const half = Math.SQRT1_2;

// Simulates a bug that the agent itself does not catch. Afterwards the agent always fails, as WebAssembly does.
let isBroken = false;
function breakIfTold(text) {
  isBroken ||= /breaks/.test(text);
  if (isBroken) throw new Error("a bug");
}

class FakeAgent {
  constructor(config) {
    this.config = config;
    this.numImages = 0;
    this.numImu = 0;
    this.edits = [];
    this.numMaps = 1;
  }
  imageBuffer(bytes) {
    return (this.image = new Uint8Array(bytes));
  }
  addImu(_utime, ...values) {
    ++this.numImu;
    this.imu = values;
  }
  addImage(utime) {
    ++this.numImages;
    breakIfTold(this.config.imuYaml);
    this.pose = {
      utime, state: "tracking", reason: "", map: kMap, fused: false, numTracked: 120,
      T_odom_body: [0.01 * this.numImages, 0, 1.5, half, 0, 0, half], // upright, the camera to odom's y
    };
  }
  addPosedImage(utime, width, height, T_odom_body) {
    ++this.numImages;
    const { image } = this;
    const mean = (from, step) => Array.from({ length: 16 }, (_, i) => image[from + i * step]).reduce((a, b) => a + b) / 16;
    this.edges = { top: mean(100, 1), bottom: mean((height - 1) * width + 100, 1), left: mean(100 * width, width), right: mean(101 * width - 1, width) };
    this.pose = { utime, state: T_odom_body ? "tracking" : "lost", reason: "", map: kMap, fused: false, numTracked: 120, T_odom_body: T_odom_body ?? [0, 0, 0, 0, 0, 0, 1] };
  }
  onLinkDown() {}
  restore() {}
  placeAnchor(edit) {
    this.edits.push(edit);
    return "1/1700000000000001";
  }
  removeAnchor(id) {
    breakIfTold(id);
  }
  poll() {
    breakIfTold("");
  }
  startAnew() {
    ++this.numMaps;
  }
  flush() {}
  take() {
    const { pose } = this;
    this.pose = undefined;
    const counters = { images: this.numImages, imu: this.numImu, maps: this.numMaps };
    const told = { imu: this.imu, edits: this.edits, cameraYaml: this.config.cameraYaml, edges: this.edges, range: rangeOf(this.image) };
    return {
      linkUp: [], spool: [], keyframes: [], pose,
      anchors: pose && [{
        id: "2/1", name: "kettle", payload: "", owner: 2, sigma_m: 0.01, revision: 1, T_odom_anchor: [...kAnchor, 0, 0, 0, 1],
      }],
      others: pose && { map: kMap, others: [{ agent: 3, T_odom_cam: [...kOther, 0, half, half, 0] }] },
      status: pose && { vio: { text: JSON.stringify(told), counters } },
    };
  }
  delete() {}
}

const rangeOf = (bytes) => bytes && [Math.min(...bytes.slice(0, 50_000)), Math.max(...bytes.slice(0, 50_000))];

// Knows the camera after kEnough images (three seconds, in which a test can check the page), or at a recording's end. Its focal length
// is kFocal.
const kEnough = 60;
const kFocal = 567;

class FakeCalibration {
  constructor(config) {
    this.config = config;
    this.numImages = 0;
  }
  imageBuffer() {
    return (this.image = new Uint8Array(this.config.width * this.config.height));
  }
  addImu(_utime, ...values) {
    this.imu = values;
  }
  addImage() {
    ++this.numImages;
    breakIfTold(this.config.imuYaml);
  }
  progress() {
    return { share: Math.min(1, this.numImages / kEnough), missing: this.numImages < kEnough ? "rotation about z" : "" };
  }
  solve() {
    const { width, height, q_body_cam } = this.config;
    if (!this.imu) return { cameraYaml: "", refused: "rotate more" };
    return { refused: "", cameraYaml: `comment: fake, with the rotation ${q_body_cam ?? "unknown"}
T_BS: {cols: 4, rows: 4, data: [1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1]}
resolution: [${width}, ${height}]
intrinsics: [${kFocal}, ${kFocal}, ${(width - 1) / 2}, ${(height - 1) / 2}]
distortion_model: radial-tangential
distortion_coefficients: [0, 0, 0, 0]
` };
  }
}

export default async () => ({ 
  createAgent: (config) => ({ agent: new FakeAgent(config) }),
  createCalibration: (config) => ({ calibration: new FakeCalibration(config) }),
  heapBytes: () => 0 });
