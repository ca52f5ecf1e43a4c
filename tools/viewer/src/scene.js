// The numbers of the page as arrays.

const KINDS = { f32: Float32Array, f64: Float64Array, u32: Uint32Array, u16: Uint16Array, u8: Uint8Array };
const CLASSES = ["face", "weak", "sharp", "corner", "boundary", "non-manifold"];

export async function readScene(head, packed) {
  const bytes = Uint8Array.from(atob(packed.trim()), (c) => c.charCodeAt(0));
  const unpacked = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  const buffer = await new Response(unpacked).arrayBuffer();
  const arrays = Object.fromEntries(head.arrays.map(({ name, kind, offset, length }) => [name, new KINDS[kind](buffer, offset, length)]));
  return { head, lines: new Lines(arrays), ...ground(head, arrays) };
}

// Lines with their segments; a segment knows its line.
class Lines {
  constructor(arrays) {
    this.count = arrays.id.length;
    this.arrays = arrays;
    const segments = arrays.place.length / 3 - this.count;
    this.segments = new Float32Array(6 * segments);
    this.lineOf = new Uint32Array(segments);
    this.firstPoint = new Uint32Array(this.count + 1);
    let segment = 0, point = 0;
    for (let line = 0; line < this.count; line += 1) {
      this.firstPoint[line] = point;
      for (let i = 1; i < arrays.points[line]; i += 1, segment += 1) {
        this.segments.set(arrays.place.subarray(3 * (point + i - 1), 3 * (point + i + 1)), 6 * segment);
        this.lineOf[segment] = line;
      }
      point += arrays.points[line];
    }
    this.firstPoint[this.count] = point;
    // From the strongest on, as they are stepped through: by strength times length, then other lines by length.
    const worth = (line) => (this.isCrease(line) ? arrays.strength[line] : 1) * arrays.length[line];
    const before = (a, b) => this.isCrease(b) - this.isCrease(a) || worth(b) - worth(a) || a - b;
    this.byWorth = Array.from({ length: this.count }, (_, i) => i).sort(before);
  }

  className(line) {
    return CLASSES[this.arrays.class[line]];
  }

  isCrease(line) {
    return this.arrays.class[line] === 1 || this.arrays.class[line] === 2;
  }

  describe(line) {
    const { id, length, angle, strength, closed, bend } = this.arrays;
    return {
      id: id[line], class: this.className(line), length: length[line], closed: closed[line] === 1,
      angle: this.isCrease(line) ? angle[line] : null, strength: this.isCrease(line) ? strength[line] : null,
      bend: ["", "convex", "concave"][bend[line]], points: this.firstPoint[line + 1] - this.firstPoint[line],
    };
  }

  // The segments of a line, as pairs of places.
  segmentsOf(line) {
    const place = this.arrays.place, out = [];
    for (let p = this.firstPoint[line]; p + 1 < this.firstPoint[line + 1]; p += 1) out.push(...place.subarray(3 * p, 3 * p + 6));
    return out;
  }
}

function ground(head, { ground: stored, corner }) {
  const places = new Float32Array(stored.length);
  for (let i = 0; i < stored.length; i += 1) places[i] = head.size[i % 3] * (stored[i] / 65535 - 0.5);
  return { places, corner };
}
