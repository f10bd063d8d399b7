// Joining a site: a one-time code is exchanged for an agent's key, which is kept in this browser's storage.

import type { Membership } from "../messages";
import { forget, store, stored } from "../storage";

const kStorageKey = "pangea.membership";

// The code in a link made by `pangea-gateway invite`: https://server:8443/#join=CODE
export function codeIn(hash: string): string | undefined {
  return new URLSearchParams(hash.replace(/^#/, "")).get("join") ?? undefined;
}

// The stored membership; undefined if there is none or it is not valid.
export function parseMembership(json: string | undefined): Membership | undefined {
  try {
    const { agent, key, site, name } = JSON.parse(json ?? "null") ?? {};
    const good = Number.isInteger(agent) && agent >= 1 && agent <= 65535 && /^[0-9a-f]{64}$/.test(key);
    return good ? { agent, key, site: String(site ?? ""), name: String(name ?? "") } : undefined;
  } catch {
    return undefined;
  }
}

// Calls `onChange` when another tab has joined or left.
export function watchMembership(onChange: () => void) {
  addEventListener("storage", ({ key }) => key === kStorageKey && onChange());
}

export const storedMembership = () => parseMembership(stored(kStorageKey));
export const forgetMembership = () => forget(kStorageKey);
// False if the browser does not keep it.
export const keepMembership = (membership: Membership) => store(kStorageKey, JSON.stringify(membership));

// The server refused the code.
export class CodeRefused extends Error {}

// Throws an error with the server's text for the visitor.
export async function join(code: string, name: string): Promise<Membership> {
  const request = fetch("/v1/join", {
    method: "POST",
    headers: { "Content-Type": "application/json" },
    body: JSON.stringify({ code, name }),
  });
  const answer = await request.catch(() => {
    throw new Error("The server cannot be reached: is this device in its network?");
  });
  const said = await answer.json().catch(() => ({}));
  if (answer.status === 403) throw new CodeRefused(said.error ?? "The server refused the code.");
  if (!answer.ok) throw new Error(said.error ?? `The server does not answer (${answer.status}).`);
  const membership = parseMembership(JSON.stringify({ ...said, name }));
  if (!membership) throw new Error("The server's answer has no key in it.");
  return membership;
}
