// Makes src/report/viewer.html of the sources here: one file that needs nothing else. The digest of the sources is written
// into it; tests/report.rs compares it, so that a page that is older than its sources is noticed.

import { createHash } from "node:crypto";
import { readFileSync, readdirSync, writeFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const here = (name) => fileURLToPath(new URL(name, import.meta.url));
const target = process.argv[2] ?? here("../../src/report/viewer.html");

// Name and content of each, in the order of the names.
function digest() {
  const names = ["build.mjs", "package-lock.json", "package.json", ...readdirSync(here("src")).map((name) => `src/${name}`)].sort();
  const hash = createHash("sha256");
  for (const name of names) hash.update(`${name}\0`).update(readFileSync(here(name))).update("\0");
  return hash.digest("hex");
}

const bundle = await build({
  entryPoints: [here("src/main.js")], bundle: true, minify: true, format: "iife", target: "es2022", write: false, legalComments: "none", charset: "utf8",
});
const script = bundle.outputFiles[0].text;
if (/<\/script|<!--|@@[A-Z]+@@/i.test(script)) throw new Error("the script would end its own element, or holds a mark");
const style = (await build({ entryPoints: [here("src/style.css")], minify: true, write: false })).outputFiles[0].text;
const version = JSON.parse(readFileSync(here("node_modules/three/package.json"), "utf8")).version;
const licence = readFileSync(here("node_modules/three/LICENSE"), "utf8").trim();
const about = `<!--
Made by tools/viewer/build of sources with sha256 ${digest()}. Do not edit.

Contains three.js ${version}:

${licence}
-->`;
// Functions, because a replacement text may hold $ signs.
const page = readFileSync(here("src/page.html"), "utf8")
  .replace("<!--@@ABOUT@@-->", () => about)
  .replace("@@STYLE@@", () => style.trim())
  .replace("@@SCRIPT@@", () => script.trim());
writeFileSync(target, page);
console.log(`${target}: ${page.length} bytes`);
