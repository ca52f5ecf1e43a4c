// Opens a page in Chromium, as a user does from a folder, and sees that it works: it draws, hides lines, tells of a line that is
// clicked on, follows the keyboard, and says nothing on the console. Screenshots show what it looked like.
//
// node check.mjs PAGE.html FOLDER_FOR_SCREENSHOTS

import assert from "node:assert/strict";
import { mkdirSync, readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { pathToFileURL } from "node:url";
import { chromium } from "playwright-core";

const [file, shots] = process.argv.slice(2);
const axe = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
mkdirSync(shots, { recursive: true });

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-background-networking", "--disable-component-update",
    "--disable-sync", "--no-first-run", "--disable-quic"],
});

try {
  for (const scheme of ["light", "dark"]) await check(scheme);
  await checkNarrow();
} finally {
  await browser.close();
}
console.log("the page works");

async function open(options) {
  const page = await browser.newPage(options);
  const said = [], asked = [];
  page.on("console", (message) => {
    // What the software renderer says of itself is not ours.
    if (["error", "warning"].includes(message.type()) && !/GPU stall due to ReadPixels/.test(message.text())) said.push(message.text());
  });
  page.on("pageerror", (error) => said.push(error.message));
  page.on("request", (request) => asked.push(request.url()));
  const began = Date.now();
  await page.goto(pathToFileURL(file).href);
  await page.waitForFunction(() => window.crease?.view.drawn > 0, null, { timeout: 60000 });
  console.log(`drawn ${Date.now() - began} ms after it was opened`);
  return { page, said, asked };
}

async function check(scheme) {
  const { page, said, asked } = await open({ viewport: { width: 1360, height: 900 }, colorScheme: scheme, reducedMotion: "reduce" });
  const shot = (name) => page.screenshot({ path: `${shots}/${scheme}-${name}.png` });
  await settled(page);
  await shot("whole");
  assert.ok((await page.title()).startsWith("Feature lines of "), "it has a title");
  assert.equal(await page.locator("html").getAttribute("lang"), "en");

  // It draws: many pixels differ from the background, and some have the colour of a class.
  const all = await pixels(page);
  assert.ok(all.drawn > 0.02, `${all.drawn} of the picture is drawn`);
  assert.ok(all.coloured > 100, `${all.coloured} pixels are of lines`);

  // The slider hides weak lines.
  const before = await page.evaluate(() => window.crease.view.lines.geometry.instanceCount);
  const middle = await page.evaluate(() => {
    const strengths = [...window.crease.scene.lines.arrays.strength].filter((x) => x > 0).sort((a, b) => a - b);
    return (strengths[strengths.length >> 1] + strengths[0]) / 2;
  });
  await setSlider(page, middle);
  const after = await page.evaluate(() => window.crease.view.lines.geometry.instanceCount);
  assert.ok(after > 0 && after < before, `${after} of ${before} segments are left`);
  assert.ok((await pixels(page)).coloured < all.coloured, "fewer pixels are of lines");
  await shot("strong");
  await setSlider(page, 0);
  assert.equal(await page.evaluate(() => window.crease.view.lines.geometry.instanceCount), before);

  // A class can be left out.
  const box = page.locator("#class-boxes input").first();
  await box.uncheck();
  assert.ok((await page.evaluate(() => window.crease.view.lines.geometry.instanceCount)) < before);
  await box.check();

  // By saliency, the colours are others.
  await page.locator("input[name=colour][value=saliency]").check();
  await settled(page);
  assert.notEqual((await pixels(page)).digest, all.digest);
  await shot("saliency");
  await page.locator("input[name=colour][value=class]").check();

  // A click on a line tells what it is.
  await page.locator("#show-hidden").check();
  const line = await page.evaluate(() => window.crease.scene.lines.byWorth[0]);
  const [x, y] = await page.evaluate((line) => window.crease.view.placeOf(line), line);
  await page.locator("#stage").scrollIntoViewIfNeeded();
  const stage = await page.locator("#stage").boundingBox();
  await page.mouse.click(stage.x + x, stage.y + y);
  const told = await page.locator("#selected").innerText();
  for (const word of ["Id", "Class", "Length", "Fold angle", "Saliency"]) assert.ok(told.includes(word), `${word} is not in ${told}`);
  await settled(page);
  await shot("chosen");
  await page.keyboard.press("Escape");
  assert.ok((await page.locator("#selected").innerText()).startsWith("Click"));
  await page.locator("#show-hidden").uncheck();

  await checkKeys(page);
  assert.deepEqual(await violations(page), [], "what axe says");
  await page.screenshot({ path: `${shots}/${scheme}-page.png`, fullPage: true });
  assert.deepEqual(said, [], "what the console says");
  assert.deepEqual(asked.filter((url) => !url.startsWith("file:") && !url.startsWith("data:") && !url.startsWith("blob:")), [], "what it asked the network for");
  await page.close();
}

// Arrows turn, Shift and arrows move, plus and minus zoom, 0 brings it back; Tab gets to every control.
async function checkKeys(page) {
  const place = () => page.evaluate(() => [...window.crease.view.camera.position.toArray(), ...window.crease.view.controls.target.toArray()].map((x) => x.toFixed(6)).join());
  await page.locator("#reset").click();
  await page.locator("#stage").focus();
  const start = await place();
  for (const key of ["ArrowLeft", "ArrowUp", "Shift+ArrowRight", "+", "-"]) {
    const before = await place();
    await page.keyboard.press(key);
    assert.notEqual(await place(), before, `${key} does something`);
  }
  await page.keyboard.press("0");
  assert.equal(await place(), start, "0 resets the view");
  await page.keyboard.press("n");
  assert.ok((await page.locator("#selected").innerText()).includes("Class"), "N chooses a line");
  await page.keyboard.press("Escape");
  const reached = new Set();
  await page.locator("#stage").focus();
  for (let i = 0; i < 40; i += 1) {
    await page.keyboard.press("Tab");
    reached.add(await page.evaluate(() => document.activeElement.id || document.activeElement.name || document.activeElement.value || document.activeElement.tagName));
  }
  for (const id of ["threshold", "colour", "show-surface", "show-hidden", "reset", "next", "previous", "measure"]) assert.ok(reached.has(id), `${id} is reached by Tab`);
}

async function checkNarrow() {
  const { page } = await open({ viewport: { width: 390, height: 800 } });
  await settled(page);
  const wide = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
  assert.equal(wide, 0, "nothing sticks out on a narrow screen");
  await page.screenshot({ path: `${shots}/narrow.png` });
  await page.close();
}

async function violations(page) {
  // Its own world: the policy of the page forbids scripts from elsewhere, and stays as it is.
  await page.evaluate(axe);
  const found = await page.evaluate(() => window.axe.run(document, { runOnly: ["wcag2a", "wcag2aa", "wcag21aa", "best-practice"] }));
  return found.violations.map((v) => `${v.id}: ${v.nodes.map((node) => node.html.slice(0, 120)).join(" | ")}`);
}

async function setSlider(page, value) {
  await page.locator("#threshold").evaluate((slider, value) => {
    slider.value = value;
    slider.dispatchEvent(new Event("input", { bubbles: true }));
  }, value);
  await settled(page);
}

// Until what was asked for is drawn.
async function settled(page) {
  await page.waitForFunction(() => !window.crease.view.waiting);
}

// How much of the canvas is not background, how many pixels have a strong colour, and a digest of all.
async function pixels(page) {
  return page.evaluate(() => {
    const canvas = document.querySelector("#stage canvas");
    const copy = document.createElement("canvas");
    [copy.width, copy.height] = [canvas.width, canvas.height];
    const context = copy.getContext("2d");
    context.drawImage(canvas, 0, 0);
    const { data } = context.getImageData(0, 0, copy.width, copy.height);
    let drawn = 0, coloured = 0, digest = 0;
    for (let i = 0; i < data.length; i += 4) {
      const [r, g, b] = data.subarray(i, i + 3);
      if (Math.abs(r - data[0]) + Math.abs(g - data[1]) + Math.abs(b - data[2]) > 12) drawn += 1;
      if (Math.max(r, g, b) - Math.min(r, g, b) > 60) coloured += 1;
      digest = (Math.imul(digest, 31) + r * 65536 + g * 256 + b) | 0;
    }
    return { drawn: (4 * drawn) / data.length, coloured, digest };
  });
}
