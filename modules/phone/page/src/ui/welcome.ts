// The panel before a walk: who the visitor is, and joining.

import { SpoolStore, spoolOf } from "../agent/spool_store";
import { askDialog, byId } from "../dom";
import { CodeRefused, codeIn, forgetMembership, join, keepMembership, storedMembership, watchMembership } from "../link/join";
import type { Membership } from "../messages";
import { forgetCalibrations, storedCalibrations } from "../sensors/calibration";
import { notice } from "./notice";

const nameOf = ({ name, agent }: Membership) => name || `agent ${agent}`;

async function asksToLeave({ agent }: Membership): Promise<boolean> {
  const unsent = await SpoolStore.countOf(spoolOf(agent)).catch(() => 0);
  const lost = unsent > 0 ? ` Lost as well: ${unsent} unsent keyframes and anchors.` : "";
  byId("leave_text").textContent = `Leaving deletes this phone's key: you need a new invite to come back.${lost} What the server has stays there.`;
  return (await askDialog("leave_dialog")) === "leave";
}

const codeField = () => byId<HTMLInputElement>("code");

export class Welcome {
  membership: Membership | undefined = storedMembership();
  isRefused = false; // the server does not know this phone any more
  private joining?: Promise<void>;

  constructor() {
    byId("forget").onclick = async () => {
      if (!this.membership || !(await asksToLeave(this.membership))) return;
      forgetMembership();
      this.membership = undefined;
      this.show();
    };
    byId("recalibrate").onclick = () => {
      forgetCalibrations();
      this.show();
    };
    watchMembership(() => {
      this.membership = storedMembership();
      if (!byId("welcome").hidden) this.show();
    });
    this.show();
  }

  // Joins if an invite code was given. Starts that overlap share one request, because the code works only once.
  async admit(): Promise<Membership | undefined> {
    await (this.joining ??= this.joinByCode().finally(() => (this.joining = undefined)));
    return this.membership;
  }

  private async joinByCode() {
    const code = codeField().value.trim();
    if (code === "") return;
    try {
      this.membership = await join(code, byId<HTMLInputElement>("name").value.trim());
      this.isRefused = false;
      if (!keepMembership(this.membership)) notice("This browser does not keep your key: it is lost when you close the page.");
      // The keyframes of an earlier agent cannot be sent without its key; another site may have given the same id.
      await SpoolStore.removeAll().catch(() => {});
    } catch (error) {
      // A member who scans the code of the invite once more.
      if (!(error instanceof CodeRefused) || !this.membership || this.isRefused) throw error;
      notice(`You go on as ${nameOf(this.membership)}: this code is not valid any more.`);
    }
    // A reloaded page must not offer the code again.
    history.replaceState(null, "", location.pathname);
    codeField().value = "";
  }

  show() {
    const code = codeIn(location.hash);
    if (code) codeField().value = code;
    const member = code || this.isRefused ? undefined : this.membership;
    byId("name_row").hidden = byId("code_row").hidden = member !== undefined;
    byId("forget").hidden = !this.membership;
    byId("recalibrate").hidden = storedCalibrations() === 0;
    byId("invitation").textContent = member
      ? `You are ${nameOf(member)}${member.site ? ` at ${member.site}` : ""}.`
      : code ? "You are invited."
      : this.isRefused ? "The server does not know this phone any more: enter the code of a new invite."
      : "With an invite code you join others. Without one, the phone tracks by itself.";
    byId("welcome").hidden = false;
  }

  hide() {
    byId("welcome").hidden = true;
  }
}
