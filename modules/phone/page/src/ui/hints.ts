// The one line that tells the visitor what to do next.

import type { PhonePose } from "../agent/phone_agent";
import type { CalibrationProgress } from "../calibration/camera_calibration";
import type { CalibrationWalk } from "../calibration/calibration_walk";
import type { LinkState } from "../messages";

export interface Situation {
  pose?: PhonePose; // the newest one
  brightness: number; // of the newest image, 0 to 255
  link?: LinkState; // undefined: the agent runs without a server
  isMemoryFull: boolean; // of keyframes that wait for the server
  together: string[]; // names of the people whose map is fused with this one
  motionSilent: boolean;
  cameraSilent: boolean;
}

export interface Hint {
  text: string;
  tone: "do" | "good" | "bad";
}

const kNoMotion = "The phone tells no motion. Allow it in the browser's settings.";
const kTooDark = "Too dark: find more light.";
const kDark = 25;
const kFewFeatures = 25;

export function hintOf({ pose, brightness, link, isMemoryFull, together, motionSilent, cameraSilent }: Situation): Hint {
  if (motionSilent) return { text: kNoMotion, tone: "bad" };
  if (cameraSilent) return { text: "The camera gives no images. Does another app use it?", tone: "bad" };
  if (!pose) return { text: "Starting…", tone: "do" };
  const tracking = pose.state === "tracking";
  if (brightness < kDark && (!tracking || pose.numTracked < kFewFeatures)) return { text: kTooDark, tone: "bad" };
  if (pose.state === "initialising") return starting(pose.reason);
  if (!tracking) return { text: "Lost. Look at something with detail, and move sideways, slowly.", tone: "bad" };
  if (pose.numTracked < kFewFeatures) return { text: "Little to see here: look at something with more detail.", tone: "do" };
  if (link === "refused") return { text: "The server does not know this phone any more: ask for a new invite.", tone: "bad" };
  if (link === "replaced") return { text: "The page is open elsewhere too, and works there. Stop and start here.", tone: "bad" };
  if (link === "connecting" && isMemoryFull) {
    return { text: "No connection for so long that the memory is full: what you walk now is not kept.", tone: "bad" };
  }
  if (link === "connecting") return { text: "No connection. Walk on: your map is kept, and sent later.", tone: "do" };
  if (together.length > 0) return { text: `In one map with ${listed(together)}. Tap to place an anchor.`, tone: "good" };
  if (link === "open") return { text: "Walk where others have been, to join their map.", tone: "do" };
  return { text: "Tracking.", tone: "good" };
}

// The hint while an unknown camera is calibrated. CalibrationProgress.missing is about the camera's axes.
export function calibrationHint(situation: Pick<CalibrationWalk, "progress" | "refused" | "brightness" | "motionSilent">): Hint {
  const { progress: { share, missing }, refused, brightness, motionSilent } = situation;
  if (motionSilent) return { text: kNoMotion, tone: "bad" };
  if (brightness < kDark) return { text: kTooDark, tone: "bad" };
  if (missing === "points") return { text: "Look at something with more detail, near and far.", tone: "bad" };
  if (share >= 1 && refused === "") return { text: "Calculating…", tone: "good" };
  const begin = refused === "" ? "Getting to know this camera." : `Not yet: ${refused}.`;
  return { text: `${begin} ${kMoves[missing]}`, tone: "do" };
}

const kMoves: Record<CalibrationProgress["missing"], string> = {
  points: "",
  "": "Go on rotating the phone to and fro.",
  time: "Rotate the phone to and fro, in all directions.",
  "rotation about x": "Tilt the phone up and down, to and fro.",
  "rotation about y": "Look left and right, to and fro.",
  "rotation about z": "Roll the phone like a steering wheel, to and fro.",
};

function starting(reason: string): Hint {
  if (/the calibration is of/.test(reason)) return { text: "Another camera or image size than the calibration's: calibrate the camera again.", tone: "bad" };
  if (/too few features/.test(reason)) return { text: "Look at something with more detail.", tone: "do" };
  if (/accelerometer shows/.test(reason)) return { text: "Hold the phone more quietly for a moment.", tone: "do" };
  return { text: "Move sideways, slowly.", tone: "do" };
}

const listed = (names: string[]) =>
  names.length === 1 ? names[0] : `${names.slice(0, -1).join(", ")} and ${names.at(-1)}`;
