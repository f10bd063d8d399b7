// Shows where phones can join this server: the gateway's address as a QR code, and its certificate's fingerprint.

import { encode } from "uqr";
import type { Model } from "./model";
import { byId, isSilent } from "./panels";

// The beginning of STATUS_gateway's summary (modules/gateway/gateway_process.cc).
const kAddress = /^(https:\S+\/) \(certificate's SHA-256 ([0-9A-F:]+)\)/;
const kQuiet = 4; // modules around the code
const kModule_px = 6;

let shown = ""; // the address and the fingerprint in the dialog

function drawCode(text: string) {
  const { size, data } = encode(text, { border: kQuiet });
  const canvas = byId<HTMLCanvasElement>("phones_code");
  canvas.width = canvas.height = kModule_px * size;
  const context = canvas.getContext("2d")!;
  context.fillStyle = "white";
  context.fillRect(0, 0, canvas.width, canvas.height);
  context.fillStyle = "black";
  data.forEach((row, y) => row.forEach((dark, x) => {
    if (dark) context.fillRect(kModule_px * x, kModule_px * y, kModule_px, kModule_px);
  }));
}

// Shows the button while a gateway runs.
export function drawPhones(model: Model) {
  const gateway = model.processes.get("gateway");
  const runs = gateway !== undefined && !isSilent(gateway, model.now_s);
  const [told, url, fingerprint] = (runs && kAddress.exec(gateway.summary)) || [];
  byId("phones").hidden = told === undefined;
  if (told === undefined || told === shown) return;
  shown = told;
  drawCode(url);
  byId("phones_url").textContent = url;
  byId("phones_fingerprint").textContent = fingerprint;
}

byId("phones").onclick = () => byId<HTMLDialogElement>("phones_dialog").showModal();
