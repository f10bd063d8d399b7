// Colours that colour-blind people can distinguish: those of Okabe and Ito, then four of Paul Tol's. Twelve agents
// cannot be distinguished by hue alone, so every agent also shows its number.

const light = [
  "#0072b2", "#d98200", "#009e73", "#b8578c", "#3795cf", "#c44e00",
  "#8f7f00", "#707070", "#332288", "#2f9485", "#882255", "#7f8a1f",
];
const dark = [
  "#3d9be0", "#e69f00", "#1fbf92", "#dd8fbd", "#7cc8f5", "#f07b2e",
  "#f0e442", "#b5b5b5", "#9a8cff", "#66d5c4", "#e0668e", "#c9d15a",
];

const wantsDark = matchMedia("(prefers-color-scheme: dark)");

const isDark = () => wantsDark.matches;
export const onThemeChange = (then: () => void) => wantsDark.addEventListener("change", then);

// Agents are numbered from 1; after twelve, the colours repeat.
export function agentColour(agent: number): string {
  const colours = isDark() ? dark : light;
  return colours[(Math.max(agent, 1) - 1) % colours.length];
}

export const colours = () =>
  isDark()
    ? { background: "#14171c", grid: "#2a3038", accepted: "#f2f2f2", refused: "#f0729a", anchor: "#e8b4ff" }
    : { background: "#fafafa", grid: "#dcdfe4", accepted: "#1a1a1a", refused: "#c2185b", anchor: "#7b1fa2" };
