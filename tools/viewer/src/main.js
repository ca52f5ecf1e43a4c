// The page: text from the report, the view from the scene, and what joins them.

import { Color } from "three";
import { element, pairs, swatch } from "./dom.js";
import { coordinate, count, counted, degrees, measure } from "./format.js";
import { readScene } from "./scene.js";
import { write } from "./text.js";
import { View } from "./view.js";

const at = (id) => document.getElementById(id);
const data = (id) => JSON.parse(at(id).textContent);
const dark = matchMedia("(prefers-color-scheme: dark)");
// From weak to strong; ends that stand out from the surface, light in the dark and dark in the light.
const RAMPS = { light: ["#7fb2c9", "#3c8dbd", "#5b4fa8", "#7b1f72", "#3d0324"], dark: ["#39598c", "#4a90a8", "#66c08f", "#c9da58", "#fff59a"] };

const report = data("report-data");
write(report);
startView().catch((error) => {
  at("stage-note").textContent = `The 3D view cannot be shown: ${error.message}. The numbers below do not need it.`;
});

async function startView() {
  const scene = await readScene(data("scene-data"), at("numbers").textContent);
  at("numbers").remove();
  at("detail").textContent = describeDetail(scene.head);
  const view = new View(at("stage"), scene);
  at("stage-note").textContent = "";
  const state = { classes: new Set(report.found.classes.map((c) => c.class)), threshold: 0, colour: "class", chosen: null };
  const page = new Page(view, scene, state);
  page.makeBoxes();
  page.listen();
  page.dress();
  page.update();
  // For checks of the page, and for the curious.
  window.crease = { view, page, state, scene };
}

function describeDetail(head) {
  const part = (some, all, one, many) => (some === all ? `all ${counted(all, one, many)}` : `the strongest ${counted(some, one, many)} of ${count(all)}`);
  const lines = `Lines: ${part(head.lines, head.all_lines, "line", "lines")}, with ${count(head.segments)} of ${counted(head.all_segments, "segment", "segments")}` +
    (head.thinned_lines > 0 ? `; ${counted(head.thinned_lines, "very long line is", "very long lines are")} drawn through some of their vertices only` : "") + ".";
  const triangles = head.arrays.find((array) => array.name === "corner").length / 3;
  const vertices = head.arrays.find((array) => array.name === "ground").length / 3;
  const surface = {
    mesh: triangles === head.all_faces ? `all ${counted(triangles, "triangle", "triangles")}` :
      `thinned to ${counted(triangles, "triangle", "triangles")} of ${count(head.all_faces)}; vertices within cubes of ${measure(head.cube)} mesh units became one`,
    points: `${counted(vertices, "vertex", "vertices")} of ${count(head.all_vertices)}, as points`,
    none: "nothing to show",
  }[head.surface];
  return `${lines} Surface: ${surface}. Coordinates are drawn relative to (${head.centre.map((x) => coordinate(x, report.mesh.median_edge)).join(", ")}).`;
}

class Page {
  constructor(view, scene, state) {
    Object.assign(this, { view, lines: scene.lines, state });
  }

  makeBoxes() {
    for (const { class: name, lines } of report.found.classes) {
      const box = element("input", { type: "checkbox", checked: "", value: name });
      box.addEventListener("change", () => {
        if (box.checked) this.state.classes.add(name);
        else this.state.classes.delete(name);
        this.update();
      });
      at("class-boxes").append(element("label", {}, box, swatch(name), `${name} (${count(lines)})`));
    }
  }

  listen() {
    const { view, state } = this;
    at("threshold").addEventListener("input", (event) => {
      state.threshold = Number(event.target.value);
      at("threshold-value").textContent = state.threshold.toFixed(3);
      this.update();
    });
    document.querySelectorAll("input[name=colour]").forEach((radio) => radio.addEventListener("change", () => {
      state.colour = radio.value;
      this.update();
    }));
    at("show-surface").addEventListener("change", (event) => view.showSurface(event.target.checked));
    at("show-hidden").addEventListener("change", (event) => view.showHidden(event.target.checked));
    at("reset").addEventListener("click", () => view.look("start"));
    document.querySelectorAll("button[data-from]").forEach((button) => button.addEventListener("click", () => view.look(button.dataset.from)));
    at("next").addEventListener("click", () => this.step(1));
    at("previous").addEventListener("click", () => this.step(-1));
    dark.addEventListener("change", () => {
      this.dress();
      this.update();
    });
    this.listenToStage();
  }

  listenToStage() {
    const stage = at("stage");
    let pressed = null;
    stage.addEventListener("pointerdown", (event) => {
      pressed = [event.clientX, event.clientY];
    });
    stage.addEventListener("click", (event) => {
      // The end of a drag chooses nothing.
      const dragged = pressed && Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) > 4;
      if (dragged) return;
      const box = stage.getBoundingClientRect();
      this.choose(this.view.lineAt(event.clientX - box.left - stage.clientLeft, event.clientY - box.top - stage.clientTop));
      stage.focus({ preventScroll: true });
    });
    stage.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      if (this.key(event.key, event.shiftKey)) event.preventDefault();
    });
  }

  key(key, shift) {
    const { view } = this, arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
    const others = {
      "+": () => view.zoom(1.15), "=": () => view.zoom(1.15), "-": () => view.zoom(1 / 1.15), "0": () => view.look("start"),
      Home: () => view.look("start"), n: () => this.step(1), N: () => this.step(1), p: () => this.step(-1), P: () => this.step(-1),
      Escape: () => this.choose(null),
    };
    if (arrows[key]) {
      const [right, up] = arrows[key];
      if (shift) view.move(40 * right, 40 * up);
      else view.turn(6 * right, 6 * up);
      return true;
    }
    others[key]?.();
    return key in others;
  }

  isVisible(line) {
    const { lines, state } = this;
    return state.classes.has(lines.className(line)) && (!lines.isCrease(line) || lines.arrays.strength[line] >= state.threshold);
  }

  colours() {
    const style = getComputedStyle(document.documentElement);
    return Object.fromEntries(["sharp", "weak", "boundary", "non-manifold", "stage"].map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
  }

  dress() {
    const background = this.colours().stage;
    this.view.dress(dark.matches ? { background, surface: "#59636e", points: "#77828d", chosen: "#ffffff" } :
      { background, surface: "#c3cad1", points: "#8b959f", chosen: "#111111" });
  }

  update() {
    const { lines, state, view } = this;
    const css = this.colours(), ofClass = {};
    for (const name of ["sharp", "weak", "boundary", "non-manifold"]) ofClass[name] = new Color(css[name]);
    const ramp = RAMPS[dark.matches ? "dark" : "light"].map((colour) => new Color(colour));
    const strongest = lines.count > 0 ? lines.arrays.strength.reduce((a, b) => Math.max(a, b)) || 1 : 1;
    const mixed = new Color();
    const ofStrength = (strength) => {
      const x = Math.min(strength / strongest, 1) * (ramp.length - 1), i = Math.min(Math.floor(x), ramp.length - 2);
      return mixed.lerpColors(ramp[i], ramp[i + 1], x - i);
    };
    const bySaliency = state.colour === "saliency";
    const colourOf = (line) => (bySaliency && lines.isCrease(line) ? ofStrength(lines.arrays.strength[line]) : ofClass[lines.className(line)]);
    const shown = view.show((line) => this.isVisible(line), colourOf);
    at("visible").textContent = `Showing ${count(shown.lines)} of ${counted(lines.count, "line", "lines")}.`;
    this.writeLegend(bySaliency, strongest);
    if (state.chosen !== null && !this.isVisible(state.chosen)) this.choose(null);
  }

  writeLegend(bySaliency, strongest) {
    if (!bySaliency) {
      at("legend").replaceChildren();
      return;
    }
    const ramp = element("span", { class: "ramp" });
    ramp.style.background = `linear-gradient(90deg, ${RAMPS[dark.matches ? "dark" : "light"].join(", ")})`;
    at("legend").replaceChildren("saliency 0", ramp, strongest.toFixed(2));
  }

  step(by) {
    const order = this.lines.byWorth.filter((line) => this.isVisible(line));
    if (order.length === 0) return;
    const now = order.indexOf(this.state.chosen);
    this.choose(order[now < 0 ? (by > 0 ? 0 : order.length - 1) : (now + by + order.length) % order.length]);
  }

  choose(line) {
    this.state.chosen = line;
    this.view.choose(line);
    if (line === null) {
      at("selected").replaceChildren(element("p", {}, "Click on a line, or step through them from the strongest on."));
      return;
    }
    const it = this.lines.describe(line);
    const entries = [["Id", String(it.id)], ["Class", element("span", {}, swatch(it.class), it.class)], ["Length", `${measure(it.length)} mesh units`]];
    if (it.angle !== null) entries.push(["Fold angle", degrees(it.angle)], ["Saliency", it.strength.toFixed(3)]);
    if (it.bend) entries.push(["Bend", it.bend]);
    entries.push(["Closed", it.closed ? "yes" : "no"], ["Points", count(it.points)]);
    at("selected").replaceChildren(pairs(entries));
  }
}
