// Elements from data. Text is set as text: whatever a file is called, it is never read as markup.

export function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  return dress(made, attributes, children);
}

export function drawing(name, attributes = {}, ...children) {
  return dress(document.createElementNS("http://www.w3.org/2000/svg", name), attributes, children);
}

function dress(made, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...children.filter((child) => child !== null && child !== undefined));
  return made;
}

export function table(caption, head, rows) {
  const row = (cells, first) =>
    element("tr", {}, ...cells.map((cell, i) =>
      i === 0 && first ? element("th", { scope: "row" }, cell) : element("td", {}, cell)));
  return element("div", { class: "table", tabindex: "0", role: "region", "aria-label": caption },
    element("table", {},
      element("caption", {}, caption),
      element("thead", {}, element("tr", {}, ...head.map((cell) => element("th", { scope: "col" }, cell)))),
      element("tbody", {}, ...rows.map((cells) => row(cells, true)))));
}

export function pairs(entries) {
  return element("dl", {}, ...entries.flatMap(([name, value]) =>
    [element("dt", {}, name), element("dd", {}, value)]));
}

export const swatch = (className) => {
  const made = element("span", { class: "swatch" });
  made.style.background = `var(--${className})`;
  return made;
};
