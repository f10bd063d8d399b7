// report.html in a headless browser: every chart answers the pointer, legends take series away, in
// light and dark, with no network and nothing but the file.

import { execFileSync } from "node:child_process";
import { pathToFileURL } from "node:url";
import { becomes, check, launch, openPage, options, run } from "../../viewer/page/test/harness.mjs";

const textOf = (locator) => locator.evaluate((node) => node.innerText.replace(/\s+/g, " "));

// Where a series is drawn at `share` of its points, in pixels of the window.
const pointOf = (page, section, index, share) =>
  page.evaluate(([id, i, at]) => {
    const line = document.querySelectorAll(`#${id} .line`)[i];
    line.ownerSVGElement.scrollIntoView({ block: "center" });
    const { points } = line.querySelector("polyline");
    const { x, y } = points[Math.floor(at * (points.length - 1))];
    return new DOMPoint(x, y).matrixTransform(line.ownerSVGElement.getScreenCTM());
  }, [section, index, share]);

async function hover(page, section, index, share) {
  const { x, y } = await pointOf(page, section, index, share);
  await page.mouse.move(x, y);
}

await run(async () => {
  execFileSync(`${options.bin}/pangea-session`, ["report", options.log, "--out", options.out], { stdio: "ignore" });
  const browser = await launch();
  const url = pathToFileURL(`${options.out}/report.html`).href;
  const requests = [];
  const page = await openPage(browser, "about:blank");
  page.on("request", (request) => requests.push(request.url()));
  await page.goto(url);
  check("nothing but the file is asked for", requests.join() === url, requests.join());

  // Over time: every series at one x.
  const load = page.locator("#load");
  const names = await load.locator(".line").evaluateAll((lines) => lines.map(({ dataset }) => dataset.name));
  check("the load's series have names", names.length >= 5 && names.includes("fusion"), names.join(", "));
  await hover(page, "load", names.indexOf("fusion"), 0.5);
  const said = await textOf(load.locator(".tip"));
  check("hovering says the time and every process' load", /^\d+\.\d+ s /.test(said) && names.every((n) => said.includes(n)), said);
  // The value is the one that was drawn: fusion's y, read off the axis.
  const value = await page.evaluate((index) => {
    const svg = document.querySelector("#load svg");
    const [low, high, from, to] = svg.dataset.y.split(" ").map(Number);
    const { points } = svg.querySelectorAll(".line")[index].querySelector("polyline");
    return low + ((points[Math.floor(0.5 * (points.length - 1))].y - from) / (to - from)) * (high - low);
  }, names.indexOf("fusion"));
  const shown = Number(/fusion (-?[\d.]+) %/.exec(said)?.[1]);
  check("the value is the series'", Math.abs(shown - value) <= 0.51, `${shown}, drawn ${value}`);

  const button = load.locator(".legend button", { hasText: "fusion" });
  await button.click();
  check("the legend takes a series away", !(await load.locator('.line[data-name="fusion"]').isVisible()));
  check("and says so", (await button.getAttribute("aria-pressed")) === "false");
  await hover(page, "load", names.indexOf("posegraph"), 0.5);
  const without = await textOf(load.locator(".tip"));
  check("what was taken away is not asked", !without.includes("fusion") && without.includes("posegraph"), without);
  await button.press("Enter");
  check("a key brings it back", await load.locator('.line[data-name="fusion"]').isVisible());
  await page.mouse.move(0, 0);
  check("the tip goes with the pointer", await load.locator(".tip").isHidden());

  // Top view: the nearest line; fusions: the bar.
  await hover(page, "trajectories", 0, 0.5);
  const top = await textOf(page.locator("#trajectories .tip").first());
  check("a trajectory says whose it is and where", /-?\d+\.\d+ m agent \d.* -?\d+\.\d+ m/.test(top), top);
  const frames = await page.locator("#fusions .line").evaluateAll((lines) => lines.map(({ dataset }) => dataset.name));
  const fused = frames.findIndex((name) => /^agent 2.*in agent 1's map frame/.test(name));
  await hover(page, "fusions", fused, 0.3);
  const bar = await textOf(page.locator("#fusions .tip"));
  check("a bar says in whose frame the map is", /s agent 2.* in agent 1's map frame/.test(bar), bar);

  // Dark, and narrow.
  const ink = (where) => where.evaluate(() => getComputedStyle(document.querySelector(".chart text")).fill);
  const light = await ink(page);
  await page.emulateMedia({ colorScheme: "dark" });
  await hover(page, "load", names.indexOf("fusion"), 0.5);
  check("dark has light ink", (await ink(page)) !== light, `${light}, ${await ink(page)}`);
  await page.screenshot({ path: `${options.out}/report_dark.png` });
  await page.setViewportSize({ width: 390, height: 800 });
  await hover(page, "load", names.indexOf("fusion"), 0.98);
  await becomes(page, "on a phone the tip is within the page", () => {
    const { left, right } = document.querySelector("#load .tip").getBoundingClientRect();
    return left >= 0 && right <= innerWidth;
  });
  check("nothing is wider than a phone", await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth));

  // Without scripts the charts are there.
  const plain = await openPage(browser, url, { javaScriptEnabled: false });
  check("without scripts the charts are drawn", (await plain.locator(".chart .line").count()) >= 10);
  await browser.close();
});
