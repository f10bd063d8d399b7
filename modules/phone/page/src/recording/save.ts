// Saves a finished recording: on the server, or in the phone's downloads.

import { askDialog, byId } from "../dom";
import { gatewayOrigin } from "../link/gateway_link";
import { uploadRecording } from "../link/upload";
import type { Membership } from "../messages";
import { download } from "./recorder";

let saved = Promise.resolve(); // when the recordings before are saved

// One after the other, because there is one dialog, and the server takes one recording at a time of an agent.
export function saveRecording(...recording: Parameters<typeof save>): Promise<void> {
  const saving = saved.then(() => save(...recording));
  saved = saving.catch(() => {});
  return saving;
}

// Asks a member where to save it. If the server does not take it, the dialog opens once more, so the recording is not lost.
async function save(zip: Blob, name: string, membership: Membership | undefined, notice: (text: string) => void) {
  byId("save_text").textContent = `A recording of ${(zip.size / 1e6).toFixed(1)} MB, with camera images.`;
  while (membership && (await askDialog("save_dialog")) === "server") {
    try {
      const file = await uploadRecording(gatewayOrigin(), membership, zip, (share) => notice(`Uploading: ${Math.floor(100 * share)} %`));
      return notice(`The server keeps it as ${file}.`);
    } catch (error) {
      byId("save_text").textContent = `It was not uploaded: ${(error as Error).message}.`;
    }
  }
  download(zip, `${name}.zip`);
}
