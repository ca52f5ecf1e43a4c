// Numbers as a person reads them, as on the terminal.

const grouped = new Intl.NumberFormat("en");

export const count = (n) => grouped.format(n);

export const counted = (n, one, many) => `${count(n)} ${n === 1 ? one : many}`;

// Four significant figures, no fewer digits than stand before the point.
export function measure(x) {
  const size = Math.abs(x);
  if (x === 0) return "0";
  if (size < 1e-4 || size >= 1e15) return x.toExponential(3);
  const decimals = Math.max(0, 3 - Math.floor(Math.log10(size)));
  return new Intl.NumberFormat("en", { minimumFractionDigits: decimals, maximumFractionDigits: decimals }).format(x);
}

export function bytes(n) {
  if (n === null || n === undefined) return "not available";
  const unit = [[1e12, "TB"], [1e9, "GB"], [1e6, "MB"], [1e3, "kB"]].find(([size]) => n >= size);
  if (!unit) return counted(n, "byte", "bytes");
  const x = n / unit[0];
  return `${x.toFixed(x < 10 ? 1 : 0)} ${unit[1]}`;
}

export function span(seconds) {
  if (seconds === null || seconds === undefined) return "not available";
  if (seconds < 10) return `${seconds.toFixed(2)} s`;
  if (seconds < 60) return `${seconds.toFixed(1)} s`;
  const two = (n) => String(Math.floor(n)).padStart(2, "0");
  if (seconds < 3600) return `${Math.floor(seconds / 60)} min ${two(seconds % 60)} s`;
  return `${Math.floor(seconds / 3600)} h ${two((seconds / 60) % 60)} min`;
}

export const percent = (part, whole) => (whole > 0 ? `${((100 * part) / whole).toFixed(1)} %` : "-");

export const degrees = (x) => (x === null || x === undefined ? "" : `${x.toFixed(1)}°`);

// A coordinate to a thousandth of an edge: what is finer says nothing.
export function coordinate(x, edge) {
  const decimals = edge > 0 ? Math.min(Math.max(3 - Math.floor(Math.log10(edge)), 0), 12) : 6;
  return x.toFixed(decimals);
}
