// Everything on the page but the 3D view.

import { histogram } from "./charts.js";
import { element, pairs, swatch, table } from "./dom.js";
import { bytes, coordinate, count, counted, degrees, measure, percent, span } from "./format.js";

const at = (id) => document.getElementById(id);
const fill = (id, ...children) => at(id).replaceChildren(...children.filter(Boolean));

export function write(report) {
  const { input, mesh, found } = report;
  document.title = `Feature lines of ${input.name.split("/").filter(Boolean).pop() ?? input.name}`;
  fill("title", document.title);
  fill("lead", `${counted(found.lines, "line", "lines")}, ${measure(found.length)} mesh units in total, in a mesh of ` +
    `${counted(mesh.faces, "triangle", "triangles")}`);
  writeFound(found);
  writeHistograms(report);
  writeInput(report);
  writeDefects(report.defects);
  writeWork(report);
  fill("outputs", table("Files, as they were named", ["file", "size"],
    report.outputs.map((file) => [file.path, file.bytes === null ? "a report, as this page" : bytes(file.bytes)])));
  fill("footer", `Written by ${report.program.name} ${report.program.version}. Drawn with three.js (MIT licence; its notice is in the source of this page).`);
}

function writeFound(found) {
  const figure = (value, name) => element("div", {}, element("dd", {}, value), element("dt", {}, name));
  const figures = element("dl", { class: "figures" },
    figure(count(found.lines), "lines"), figure(measure(found.length), "mesh units of length"),
    figure(count(found.corners), "corners"), figure(count(found.closed), "closed loops"));
  const row = (c) => [element("span", {}, swatch(c.class), c.class), count(c.lines), measure(c.length), percent(c.length, found.length),
    degrees(c.mean_angle), degrees(c.least_angle), degrees(c.most_angle)];
  fill("found", figures, found.lines > 0 && table("Lines by class; lengths in mesh units, fold angles are means of lines",
    ["class", "lines", "length", "share of length", "fold, mean", "smallest", "largest"], found.classes.map(row)));
}

function writeHistograms({ histograms }) {
  const draw = () => {
    const what = document.querySelector("input[name=measure]:checked").value;
    fill("histograms",
      histogram("Fold angle of creases, degrees", "degrees", histograms.angle, what, (x) => String(x)),
      histogram("Length of lines, mesh units", "mesh units", histograms.length, what, (x) => compact(x)),
      histogram("Saliency of creases, 0 to 1", "saliency", histograms.strength, what, (x) => String(x)));
  };
  document.querySelectorAll("input[name=measure]").forEach((radio) => radio.addEventListener("change", draw));
  draw();
}

const compact = (x) => new Intl.NumberFormat("en", { maximumSignificantDigits: 3 }).format(x);

function writeInput({ input, parameters, limits, mesh, command }) {
  const method = parameters.thresholds === null ? parameters.method :
    `${parameters.method}: salience from ${parameters.thresholds.salience}, sharp edges from l2 ${parameters.thresholds.edge_l2}, corners from l3 ${parameters.thresholds.corner_l3}`;
  const extent = mesh.max.map((x, i) => measure(x - mesh.min[i])).join(" × ");
  const place = (p) => p.map((x) => coordinate(x, mesh.median_edge)).join(", ");
  const entries = [
    ["Command", element("code", {}, command.join(" "))],
    ["Mesh", `${counted(mesh.faces, "triangle", "triangles")}, ${counted(mesh.vertices, "vertex", "vertices")}${input.converted ? "; converted before it was read" : ""}`],
    ["Extent", `${extent} mesh units, from (${place(mesh.min)}) to (${place(mesh.max)})`],
    ["Median edge", `${measure(mesh.median_edge)} mesh units (mean ${measure(mesh.mean_edge)}, from ${measure(mesh.shortest_edge)} to ${measure(mesh.longest_edge)})`],
    ["Method", method],
    ["Sigma", `${measure(parameters.sigma)} mesh units (${parameters.sigma_edges.toFixed(2)} median edges)`],
    ["Weakest crease", parameters.min_angle > 0 ? `${parameters.min_angle}°` : "as noise and curvature around each place allow"],
    ["Shortest line", `${parameters.min_length_sigmas.toFixed(2)} sigmas`],
    ["Borders", parameters.boundaries ? "reported" : "not reported"],
    ["Lines run", parameters.geometry === "fitted" ? "where the surfaces on both sides meet" : "along edges of the mesh"],
    ["Threads", `${limits.threads}, io ${limits.io}`],
    ["Memory allowed", limits.memory_bytes === null ? "any" : bytes(limits.memory_bytes)],
  ];
  const list = element("div", { class: "wide" }, pairs(entries));
  const files = input.files.map((file) => [file.path, bytes(file.bytes)]);
  const shown = table("Files read", ["file", "size"], files.slice(0, 20));
  const rest = files.length > 20 && element("details", {}, element("summary", {}, `${count(files.length - 20)} more files`),
    table("Other files read", ["file", "size"], files.slice(20)));
  fill("input", list, element("p", {}), shown, rest);
}

const DEFECTS = [
  ["left_out_missing", "faces left out: they name vertices that do not exist"],
  ["left_out_unusable", "faces left out: they have coordinates that are not finite"],
  ["unusable_vertices", "vertices with coordinates that are not finite"],
  ["degenerate_faces", "faces without area"],
  ["repeated_corner", "faces that name a vertex twice"],
  ["duplicate_faces", "duplicates of other faces"],
  ["boundary_edges", "boundary edges, with one face only"],
  ["nonmanifold_edges", "non-manifold edges, with three or more faces"],
  ["opposed_edges", "edges between faces of opposite winding"],
  ["unreferenced_vertices", "vertices that no face uses"],
];

function writeDefects(defects) {
  const rows = DEFECTS.filter(([name]) => defects[name] > 0).map(([name, words]) => [words, count(defects[name])]);
  fill("defects", rows.length > 0 ? table("Defects seen", ["defect", "count"], rows) : element("p", {}, "None were seen."));
}

function writeWork({ work, limits }) {
  const tiles = `${counted(work.tiles, "tile", "tiles")}, halo overhead ${(100 * work.halo_overhead).toFixed(1)} %` +
    (work.regrown > 0 ? `, ${counted(work.regrown, "region", "regions")} regrown` : "");
  const entries = [
    ["Tiles", tiles],
    work.resumed_tiles > 0 && ["Resumed", `${count(work.resumed_tiles)} of ${counted(work.all_tiles, "tile", "tiles")} were done before`],
    work.temporary_bytes > 0 && ["Temporary files", `at most ${bytes(work.temporary_bytes)} at a time${work.rewritten ? "; the mesh was rewritten in spatial order" : ""}`],
    ["Waiting", `the loader ${span(work.waits.for_memory_seconds)} for memory and ${span(work.waits.for_workers_seconds)} for workers; the workers, together, ` +
      `${span(work.waits.for_tiles_seconds)} for tiles and ${span(work.waits.for_committer_seconds)} for their results to be taken`],
    ["Wall time", span(work.wall_seconds)],
    ["CPU time", span(work.cpu_seconds)],
    ["Peak memory", `${bytes(work.peak_allocated_bytes)}${limits.memory_bytes === null ? "" : ` of ${bytes(limits.memory_bytes)}`} allocated; resident ${bytes(work.peak_resident_bytes)}` +
      (work.peak_anonymous_bytes === null ? "" : `, ${bytes(work.peak_anonymous_bytes)} without mapped files`)],
  ].filter(Boolean);
  const row = (s) => [s.stage, span(s.wall_seconds), span(s.cpu_seconds), bytes(s.read_bytes), bytes(s.written_bytes), bytes(s.allocated_bytes)];
  fill("work", element("div", { class: "wide" }, pairs(entries)), element("p", {}),
    table("Stages, in the order in which they began", ["stage", "wall time", "CPU time", "from disk", "written", "allocated"], work.stages.map(row)));
}
