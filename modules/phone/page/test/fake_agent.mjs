// In place of pangea_agent.mjs, for the page's own test: an agent that walks along odom's x at the height of 1.5 m, a centimetre
// an image, and is told of an anchor that somebody else has placed. What it was given is in its status.

const kAnchor = [0, 3, 1.5]; // straight ahead at the start
const kMap = "1/1700000000000000";
const half = Math.SQRT1_2;

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
    this.pose = {
      utime, state: "tracking", reason: "", map: kMap, fused: false, numTracked: 120,
      T_odom_body: [0.01 * this.numImages, 0, 1.5, half, 0, 0, half], // upright, the camera to odom's y
    };
  }
  onLinkDown() {}
  restore() {}
  placeAnchor(edit) {
    this.edits.push(edit);
    return "1/1700000000000001";
  }
  removeAnchor() {}
  poll() {}
  startAnew() {
    ++this.numMaps;
  }
  flush() {}
  take() {
    const { pose } = this;
    this.pose = undefined;
    const counters = { images: this.numImages, imu: this.numImu, maps: this.numMaps };
    const told = { imu: this.imu, edits: this.edits, cameraYaml: this.config.cameraYaml, range: rangeOf(this.image) };
    return {
      linkUp: [], spool: [], keyframes: [], pose,
      anchors: pose && [{
        id: "2/1", name: "kettle", payload: "", owner: 2, sigma_m: 0.01, revision: 1, T_odom_anchor: [...kAnchor, 0, 0, 0, 1],
      }],
      status: pose && { vio: { text: JSON.stringify(told), counters } },
    };
  }
  delete() {}
}

const rangeOf = (bytes) => bytes && [Math.min(...bytes.slice(0, 50_000)), Math.max(...bytes.slice(0, 50_000))];

export default async () => ({ createAgent: (config) => ({ agent: new FakeAgent(config) }), heapBytes: () => 0 });
