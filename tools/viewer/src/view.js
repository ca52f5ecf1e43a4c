// The 3D view: surface, lines, camera, picking. Nothing moves by itself, and nothing is drawn unless something changed.

import {
  AmbientLight, Box3, BufferAttribute, BufferGeometry, Color, DirectionalLight, DoubleSide, LineBasicMaterial, LineSegments, Mesh, MeshLambertMaterial, PerspectiveCamera, Points,
  PointsMaterial, Raycaster, Scene, Vector2, Vector3, WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import { LineSegments2 } from "three/addons/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/addons/lines/LineSegmentsGeometry.js";

// Pixels beside a line at which a click still means it.
const REACH = 8;
// A line this share of the distance behind the surface can still be seen: the surface is thinned, lines are not.
const BEHIND = 0.01;
// More segments than this are drawn one pixel wide: wide ones are six triangles each, too much where there is no graphics card.
const WIDE = 20000;
// Share of the picture that the whole mesh fills.
const FILLED = 0.94;
// Directions to look from.
const FROM = { start: [-0.55, -0.8, 0.75], top: [0, -0.001, 1], front: [0, -1, 0.001], side: [1, 0, 0.001] };

export class View {
  constructor(stage, data) {
    this.stage = stage;
    this.data = data;
    this.renderer = new WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
    this.renderer.domElement.setAttribute("aria-hidden", "true");
    stage.prepend(this.renderer.domElement);
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(38, 1, 1, 10);
    this.camera.up.set(0, 0, 1);
    this.lamp = new DirectionalLight(0xffffff, 2);
    this.ambient = new AmbientLight(0xffffff, 1.35);
    this.scene.add(this.lamp, this.lamp.target, this.ambient);
    this.box = new Box3();
    this.surface = this.makeSurface();
    this.lines = this.makeLines();
    this.chosen = null;
    if (this.surface) this.scene.add(this.surface);
    if (this.lines) this.scene.add(this.lines, this.thin);
    this.radius = Math.max(this.box.isEmpty() ? 1 : this.box.getSize(new Vector3()).length() / 2, 1e-9);
    this.middle = this.box.isEmpty() ? new Vector3() : this.box.getCenter(new Vector3());
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.controls.addEventListener("change", () => this.draw());
    this.controls.zoomToCursor = true;
    new ResizeObserver(() => this.fit()).observe(stage);
    this.fit();
    this.look("start");
  }

  makeSurface() {
    const { places, corner, head } = this.data;
    if (head.surface === "none") return null;
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(places, 3));
    this.box.expandByObject(new Points(geometry));
    if (head.surface === "points") {
      return new Points(geometry, new PointsMaterial({ size: 1.5, sizeAttenuation: false }));
    }
    geometry.setIndex(new BufferAttribute(corner, 1));
    // The surface gives way by a hair, so that lines on it are in front of it.
    return new Mesh(geometry, new MeshLambertMaterial({
      flatShading: true, side: DoubleSide, polygonOffset: true, polygonOffsetFactor: 2, polygonOffsetUnits: 4,
    }));
  }

  makeLines() {
    const { lines } = this.data;
    if (lines.lineOf.length === 0) return null;
    const geometry = new LineSegmentsGeometry();
    geometry.setPositions(lines.segments.slice());
    geometry.setColors(new Float32Array(lines.segments.length));
    geometry.computeBoundingSphere();
    geometry.computeBoundingBox();
    this.box.union(geometry.boundingBox);
    this.shown = lines.lineOf.slice();
    // The same numbers, as pairs of points.
    const thin = new BufferGeometry();
    thin.setAttribute("position", new BufferAttribute(geometry.attributes.instanceStart.data.array, 3));
    thin.setAttribute("color", new BufferAttribute(geometry.attributes.instanceColorStart.data.array, 3));
    thin.boundingSphere = geometry.boundingSphere;
    this.thin = new LineSegments(thin, new LineBasicMaterial({ vertexColors: true }));
    return new LineSegments2(geometry, new LineMaterial({ linewidth: 2, vertexColors: true }));
  }

  // Shows the lines that `isVisible` tells, in the colours of `colourOf`. Returns how many lines and segments these are.
  show(isVisible, colourOf) {
    if (!this.lines) return { lines: 0, segments: 0 };
    const { lines } = this.data;
    const places = this.lines.geometry.attributes.instanceStart.data, colours = this.lines.geometry.attributes.instanceColorStart.data;
    const seen = new Uint8Array(lines.count), rgb = new Float32Array(3 * lines.count);
    let shownLines = 0, shown = 0;
    for (let line = 0; line < lines.count; line += 1) {
      seen[line] = isVisible(line) ? 1 : 0;
      shownLines += seen[line];
      if (seen[line]) colourOf(line).toArray(rgb, 3 * line);
    }
    for (let segment = 0; segment < lines.lineOf.length; segment += 1) {
      const line = lines.lineOf[segment];
      if (!seen[line]) continue;
      for (let i = 0; i < 6; i += 1) {
        places.array[6 * shown + i] = lines.segments[6 * segment + i];
        colours.array[6 * shown + i] = rgb[3 * line + (i % 3)];
      }
      this.shown[shown] = line;
      shown += 1;
    }
    const { position, color } = this.thin.geometry.attributes;
    for (const changed of [places, colours, position, color]) changed.needsUpdate = true;
    this.lines.geometry.instanceCount = shown;
    this.thin.geometry.setDrawRange(0, 2 * shown);
    this.lines.visible = shown > 0 && shown <= WIDE;
    this.thin.visible = shown > WIDE;
    this.draw();
    return { lines: shownLines, segments: shown };
  }

  // Colours that follow the page.
  dress({ background, surface, points, chosen }) {
    this.renderer.setClearColor(new Color(background));
    if (this.surface) this.surface.material.color.set(this.data.head.surface === "points" ? points : surface);
    this.accent = chosen;
    if (this.chosen) this.chosen.material.color.set(chosen);
    this.draw();
  }

  showSurface(visible) {
    if (this.surface) this.surface.visible = visible;
    this.draw();
  }

  showHidden(through) {
    this.through = through;
    for (const lines of [this.lines, this.thin]) if (lines) lines.material.depthTest = !through;
    this.draw();
  }

  // Marks a line, or none.
  choose(line) {
    if (this.chosen) {
      this.scene.remove(this.chosen);
      this.chosen.geometry.dispose();
      this.chosen.material.dispose();
      this.chosen = null;
    }
    if (line !== null) {
      const geometry = new LineSegmentsGeometry();
      geometry.setPositions(this.data.lines.segmentsOf(line));
      this.chosen = new LineSegments2(geometry, new LineMaterial({ linewidth: 6, color: this.accent, depthTest: false, transparent: true }));
      this.chosen.renderOrder = 1;
      this.scene.add(this.chosen);
    }
    this.draw();
  }

  // The line at a place of the stage, in pixels from its corner, or null.
  lineAt(x, y) {
    if (!this.lines || this.lines.geometry.instanceCount === 0) return null;
    const { clientWidth: width, clientHeight: height } = this.stage;
    // Thin lines are picked as if they were wide; what is not drawn does not know how large the picture is.
    this.lines.material.resolution.set(width, height);
    const ray = new Raycaster();
    ray.params.Line2 = { threshold: REACH };
    ray.setFromCamera(new Vector2((2 * x) / width - 1, 1 - (2 * y) / height), this.camera);
    ray.camera = this.camera;
    const hits = ray.intersectObject(this.lines);
    if (hits.length === 0) return null;
    let limit = Infinity;
    if (!this.through && this.surface?.visible && this.surface.isMesh) {
      const [ground] = ray.intersectObject(this.surface);
      if (ground) limit = ground.distance + 2 * this.data.head.cube + BEHIND * ground.distance;
    }
    // Of the lines that can be seen, the one nearest to the click on the screen.
    const place = new Vector3();
    const off = (hit) => {
      place.copy(hit.pointOnLine).project(this.camera);
      return Math.hypot(((place.x + 1) * width) / 2 - x, ((1 - place.y) * height) / 2 - y);
    };
    const near = hits.filter((hit) => hit.distance <= limit).map((hit) => [off(hit), hit]);
    near.sort((a, b) => a[0] - b[0]);
    return near.length === 0 ? null : this.shown[near[0][1].faceIndex];
  }

  // Where the middle of a line is on the stage, in pixels.
  placeOf(line) {
    const { lines } = this.data, at = (lines.firstPoint[line] + lines.firstPoint[line + 1]) >> 1;
    const p = new Vector3().fromArray(lines.arrays.place, 3 * at).project(this.camera);
    return [((p.x + 1) * this.stage.clientWidth) / 2, ((1 - p.y) * this.stage.clientHeight) / 2];
  }

  // Looks at the whole from one side.
  look(from) {
    const away = new Vector3().fromArray(FROM[from]).normalize();
    const right = new Vector3().crossVectors(this.camera.up, away).normalize(), up = new Vector3().crossVectors(away, right);
    const high = Math.tan((this.camera.fov / 2) * (Math.PI / 180)) * FILLED, wide = high * this.camera.aspect;
    const places = this.data.places.length > 0 ? this.data.places : this.data.lines.arrays.place;
    const place = new Vector3(), middle = this.middle.clone();
    let distance = 0;
    // So far away that all of it is in the picture; moved so that there is as much room on all sides; and as near again as can be.
    for (let round = 0; round < 3; round += 1) {
      const most = { right: 0, left: 0, up: 0, down: 0 };
      let needed = this.radius * 0.1;
      for (let i = 0; i < places.length; i += 3) {
        place.fromArray(places, i).sub(middle);
        const depth = place.dot(away), x = place.dot(right), y = place.dot(up);
        needed = Math.max(needed, depth + Math.abs(x) / wide, depth + Math.abs(y) / high);
        if (distance > depth) {
          const share = distance / (distance - depth);
          most.right = Math.max(most.right, x * share);
          most.left = Math.min(most.left, x * share);
          most.up = Math.max(most.up, y * share);
          most.down = Math.min(most.down, y * share);
        }
      }
      distance = needed;
      if (round === 1) middle.addScaledVector(right, (most.right + most.left) / 2).addScaledVector(up, (most.up + most.down) / 2);
    }
    this.controls.target.copy(middle);
    this.camera.position.copy(away).multiplyScalar(distance).add(middle);
    this.controls.update();
    this.draw();
  }

  // Turns by degrees, moves by pixels, zooms by a factor.
  turn(right, up) {
    this.controls.rotateLeft((-right * Math.PI) / 180);
    this.controls.rotateUp((-up * Math.PI) / 180);
  }

  move(right, up) {
    this.controls.pan(-right, up);
  }

  zoom(factor) {
    if (factor > 1) this.controls.dollyIn(factor);
    else this.controls.dollyOut(1 / factor);
  }

  fit() {
    const { clientWidth: width, clientHeight: height } = this.stage;
    if (width === 0 || height === 0) return;
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    this.draw();
  }

  draw() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      const away = this.camera.position.distanceTo(this.middle);
      this.camera.near = Math.max(away - 1.5 * this.radius, this.radius / 2000);
      this.camera.far = away + 1.5 * this.radius;
      this.camera.updateProjectionMatrix();
      // The light comes from above the left shoulder, wherever one looks from.
      this.lamp.position.set(-0.6, 0.9, 1).applyQuaternion(this.camera.quaternion);
      this.renderer.render(this.scene, this.camera);
      this.drawn = (this.drawn ?? 0) + 1;
    });
  }
}
