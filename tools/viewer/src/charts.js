// Histograms as stacked bars by class, each with its numbers in a table.

import { drawing, element, table } from "./dom.js";
import { count, measure } from "./format.js";

const WIDTH = 420, HEIGHT = 170, LEFT = 46, BOTTOM = 22, TOP = 8;

// `what` is "lines" or "length". Bars stand side by side whatever the width of a bin; `tick` writes a bound.
export function histogram(title, unit, data, what, tick) {
  const bins = data.bounds.length - 1;
  const totals = Array.from({ length: bins }, (_, i) => data.classes.reduce((sum, series) => sum + series[what][i], 0));
  const figure = element("figure", {}, element("figcaption", {}, title));
  if (bins < 1 || !totals.some((n) => n > 0)) {
    figure.append(element("p", { class: "note" }, "No lines of this kind."));
    return figure;
  }
  const scale = niceScale(Math.max(...totals));
  const x = (i) => LEFT + ((WIDTH - LEFT) * i) / bins;
  const y = (n) => HEIGHT - BOTTOM - ((HEIGHT - BOTTOM - TOP) * n) / scale.top;
  const svg = drawing("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", "aria-label": `${title}; the table below has the numbers` });
  for (let n = 0; n <= scale.top * 1.001; n += scale.step) {
    svg.append(
      drawing("line", { class: "grid", x1: LEFT, x2: WIDTH, y1: y(n), y2: y(n) }),
      drawing("text", { x: LEFT - 6, y: y(n) + 4, "text-anchor": "end" }, short(n)));
  }
  for (let i = 0; i < bins; i += 1) {
    let below = 0;
    for (const series of data.classes) {
      const n = series[what][i];
      if (n > 0) {
        const bar = drawing("rect", { x: x(i) + 0.5, width: Math.max(x(i + 1) - x(i) - 1, 0.5), y: y(below + n), height: y(below) - y(below + n) });
        bar.style.fill = `var(--${series.class})`;
        svg.append(bar);
        below += n;
      }
    }
  }
  const every = Math.max(1, Math.ceil(bins / 6));
  for (let i = 0; i <= bins; i += every) {
    svg.append(drawing("text", { x: x(i), y: HEIGHT - BOTTOM + 15, "text-anchor": "middle" }, tick(data.bounds[i])));
  }
  svg.append(drawing("line", { class: "axis", x1: LEFT, x2: WIDTH, y1: y(0), y2: y(0) }));
  const rows = totals.flatMap((total, i) => total === 0 ? [] :
    [[`${tick(data.bounds[i])} to ${tick(data.bounds[i + 1])}`, ...data.classes.map((series) => what === "lines" ? count(series[what][i]) : measure(series[what][i]))]]);
  figure.append(svg, element("details", {}, element("summary", {}, "Numbers"),
    table(`${title}: ${what === "lines" ? "lines" : "length in mesh units"} in each bin`, [unit, ...data.classes.map((series) => series.class)], rows)));
  return figure;
}

// The end of an axis and its steps: one, two or five times a power of ten, some four of them.
function niceScale(most) {
  const power = 10 ** Math.floor(Math.log10(most / 4));
  const step = [1, 2, 5, 10].map((n) => n * power).find((n) => most / n <= 4.5) ?? 10 * power;
  return { step, top: Math.ceil(most / step - 1e-9) * step };
}

const short = (n) => new Intl.NumberFormat("en", { notation: "compact", maximumSignificantDigits: 3 }).format(n);
