// The name of an anchor, from what somebody has typed.

const kMaxBytes = 50; // kMaxAnchorName of core/anchor.h

const fits = (name: string) => new TextEncoder().encode(name).length <= kMaxBytes;

// Without control characters, and cut to kMaxBytes.
export function anchorName(text: string): string {
  const name = [...text.replace(/[\u0000-\u001f\u007f-\u009f]/g, " ").trim()];
  while (!fits(name.join(""))) name.pop();
  return name.join("");
}
