// The designs and their panels in space: few buffers for all of them, drawn when something changes.

import {
  BufferAttribute, BufferGeometry, Color, DoubleSide, LineBasicMaterial, LineSegments, Mesh, NearestFilter,
  PerspectiveCamera, Scene, ShaderMaterial, Vector3, WebGLRenderTarget, WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import { LineSegments2 } from "three/addons/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/addons/lines/LineSegmentsGeometry.js";

import { Fold, Still } from "./fold.js";

// Columns of the picture in which what is seen is looked up.
const FINE = 320;
// Milliseconds between frames from which on fewer pixels are drawn while something moves.
const SLOW = 40;
// Ends of lines up to which these are drawn then.
const MANY = 8000;

// Faces of one colour each, lit from where the viewer is; both sides look the same. This takes a
// small part of the time of the materials of three.js where there is no graphics processor.
const VERTEX = `
attribute vec3 own;
varying vec3 place;
varying vec3 shade;
void main() {
  vec4 seen = modelViewMatrix * vec4(position, 1.0);
  place = seen.xyz;
  shade = own;
  gl_Position = projectionMatrix * seen;
}`;
const FRAGMENT = `
uniform float opacity;
varying vec3 place;
varying vec3 shade;
void main() {
  vec3 normal = normalize(cross(dFdx(place), dFdy(place)));
  float light = abs(dot(normal, vec3(-0.36, 0.48, 0.8)));
  gl_FragColor = vec4(shade * (0.55 + 0.45 * light), opacity);
}`;

const faces = () =>
  new ShaderMaterial({
    vertexShader: VERTEX, fragmentShader: FRAGMENT, side: DoubleSide, uniforms: { opacity: { value: 1 } },
    polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1,
  });

// Whether a processor draws in place of a graphics processor.
function isSlow() {
  const context = document.createElement("canvas").getContext("webgl2");
  const more = context?.getExtension("WEBGL_debug_renderer_info");
  const name = more ? String(context.getParameter(more.UNMASKED_RENDERER_WEBGL)) : "";
  context?.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software|basic render/i.test(name);
}

export class Stage {
  constructor(data, canvas) {
    this.data = data;
    this.canvas = canvas;
    this.isSlow = isSlow();
    this.renderer = new WebGLRenderer({ canvas, antialias: !this.isSlow, alpha: true });
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(30, 1, 0.1, 10);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener("change", () => this.ask());
    this.controls.addEventListener("start", () => (this.touched = true));
    this.listeners = { frame: [], rest: [] };
    this.share = 1;
    this.explosion = 0;
    this.fill();
    this.look();
    this.target = new WebGLRenderTarget(FINE, FINE, { minFilter: NearestFilter, magFilter: NearestFilter });
  }

  // Panels of every copy of every design, in the order of joining.
  instances() {
    const { data } = this;
    const out = [];
    data.designs.forEach((design, d) => {
      for (const motion of design.motions)
        for (const step of data.steps) if (step.design === d) out.push({ panel: step.panel, motion: motion.flat(), step });
    });
    return out;
  }

  fill() {
    const { data } = this;
    this.folds = data.panels.map(({ points, flat, triangles }) =>
      flat ? new Fold(points, flat, triangles) : new Still(points, triangles),
    );
    this.copies = this.instances();
    let points = 0;
    let corners = 0;
    let rims = 0;
    const bends = [0, 0];
    for (const copy of this.copies) {
      const panel = data.panels[copy.panel];
      copy.first = points;
      copy.count = panel.points.length / 3;
      copy.from = corners;
      points += copy.count;
      corners += panel.triangles.length;
      copy.to = corners;
      rims += panel.rim.length;
      copy.rims = rims;
      panel.angles.forEach((angle) => (bends[angle > 0 ? 0 : 1] += 2));
      copy.bends = [...bends];
    }
    this.points = new Float32Array(3 * points);
    this.colours = new Uint8Array(3 * points);
    this.names = new Uint8Array(3 * points);
    const triangles = new Uint32Array(corners);
    const lines = [new Uint32Array(rims), ...bends.map((n) => new Uint32Array(n))];
    const at = [0, 0, 0];
    this.owner = new Uint32Array(corners / 3);
    this.copies.forEach((copy, k) => {
      const panel = data.panels[copy.panel];
      panel.triangles.forEach((v, j) => (triangles[copy.from + j] = copy.first + v));
      this.owner.fill(k, copy.from / 3, copy.to / 3);
      for (const v of panel.rim) lines[0][at[0]++] = copy.first + v;
      panel.angles.forEach((angle, j) => {
        const kind = angle > 0 ? 1 : 2;
        for (const v of panel.bends.subarray(2 * j, 2 * j + 2)) lines[kind][at[kind]++] = copy.first + v;
      });
      for (let v = copy.first; v < copy.first + copy.count; v++) {
        const name = k + 1;
        this.names.set([name & 255, (name >> 8) & 255, name >> 16], 3 * v);
      }
      copy.middle = middleOf(transformed(panel.points, copy.motion));
    });
    this.triangles = triangles;
    this.box = boxOf(this.copies.map((copy) => transformed(data.panels[copy.panel].points, copy.motion)));
    this.place = new BufferAttribute(this.points, 3);
    this.shade = new BufferAttribute(this.colours, 3, true);
    const surface = new BufferGeometry();
    surface.setAttribute("position", this.place);
    surface.setAttribute("own", this.shade);
    surface.setAttribute("name", new BufferAttribute(this.names, 3, true));
    surface.setIndex(new BufferAttribute(triangles, 1));
    this.material = faces();
    this.surface = new Mesh(surface, this.material);
    this.byName = new ShaderMaterial({
      side: DoubleSide,
      vertexShader: "attribute vec3 name; varying vec3 own; void main() { own = name; gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }",
      fragmentShader: "varying vec3 own; void main() { gl_FragColor = vec4(own, 1.0); }",
    });
    this.lines = lines.map((index) => {
      const geometry = new BufferGeometry();
      geometry.setAttribute("position", this.place);
      geometry.setIndex(new BufferAttribute(index, 1));
      return new LineSegments(geometry, new LineBasicMaterial());
    });
    this.group = [this.surface, ...this.lines];
    this.addDesigns();
    this.marked = this.thick(3);
    this.seam = this.thick(5);
    this.scene.add(...this.group, this.designs, this.marked, this.seam);
    for (const one of this.scene.children) one.frustumCulled = false;
    this.move();
  }

  addDesigns() {
    const points = [];
    const index = [];
    for (const design of this.data.designs)
      for (const motion of design.motions) {
        const first = points.length / 3;
        for (const x of transformed(design.mesh.points, motion.flat())) points.push(x);
        for (const v of design.mesh.triangles) index.push(first + v);
      }
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(new Float32Array(points), 3));
    geometry.setAttribute("own", new BufferAttribute(new Uint8Array(points.length), 3, true));
    geometry.setIndex(new BufferAttribute(new Uint32Array(index), 1));
    this.designs = new Mesh(geometry, faces());
    this.designs.visible = false;
  }

  thick(width) {
    const line = new LineSegments2(new LineSegmentsGeometry(), new LineMaterial({ linewidth: width, depthTest: true }));
    line.visible = false;
    return line;
  }

  // Colours of the theme.
  paint(style) {
    const own = (name) => new Color(style.getPropertyValue(name).trim());
    this.lines[0].material.color = own("--rim");
    this.lines[1].material.color = own("--mountain");
    this.lines[2].material.color = own("--valley");
    this.marked.material.color = own("--accent");
    this.seam.material.color = own("--seam");
    const grey = own("--design").convertLinearToSRGB().toArray().map((x) => Math.round(255 * x));
    const shade = this.designs.geometry.attributes.own;
    for (let k = 0; k < shade.array.length; k++) shade.array[k] = grey[k % 3];
    shade.needsUpdate = true;
    this.ask();
  }

  // The view of the pictures: axes are columns right, up, towards the viewer.
  look() {
    const axes = this.data.view;
    this.touched = false;
    const { middle, size } = this.around;
    const toward = new Vector3(...axes.map((row) => row[2]));
    const steep = Math.abs(toward.z) > 0.999;
    if (steep) toward.add(new Vector3(...axes.map((row) => -0.02 * row[1]))).normalize();
    this.resize();
    this.controls.target.copy(middle);
    this.camera.position.copy(middle).addScaledVector(toward, this.distance(axes, middle));
    this.camera.near = 0.01 * size;
    this.camera.far = 60 * size;
    this.controls.minDistance = 0.05 * size;
    this.controls.maxDistance = 20 * size;
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.ask();
  }

  // The distance from which everything is seen, from the direction of the last axis.
  distance(axes, middle) {
    const slope = Math.tan((this.camera.fov * Math.PI) / 360);
    const centre = middle.toArray();
    let far = 0;
    for (let v = 0; v < this.points.length; v += 3) {
      const own = [0, 0, 0];
      for (let i = 0; i < 3; i++) for (let j = 0; j < 3; j++) own[j] += axes[i][j] * (this.points[v + i] - centre[i]);
      const across = Math.max(Math.abs(own[1]), Math.abs(own[0]) / this.camera.aspect);
      far = Math.max(far, own[2] + (1.12 * across) / slope);
    }
    return far || 1;
  }

  resize() {
    const { clientWidth: wide, clientHeight: high } = this.canvas.parentElement;
    if (!wide || !high) return;
    this.renderer.setSize(wide, high, false);
    this.sharpen(true);
    this.camera.aspect = wide / high;
    this.camera.fov = wide < high ? (360 / Math.PI) * Math.atan((Math.tan(Math.PI / 12) * high) / wide) : 30;
    this.camera.updateProjectionMatrix();
    this.ask();
  }

  // A view that nobody has turned fits its window again.
  fit() {
    if (this.touched) this.resize();
    else this.look();
  }

  // Draw all pixels, or fewer of them while something moves on slow machines.
  sharpen(on) {
    const ratio = Math.min(window.devicePixelRatio, 2);
    const own = on ? (this.isSlow ? 2 : ratio) : 0.6;
    if (this.renderer.getPixelRatio() !== own) this.renderer.setPixelRatio(own);
    // Many lines take longer than the faces; the colours of parts show where they end.
    for (const line of this.lines) if (line.geometry.index.count > MANY) line.layers.set(on ? 0 : 1);
    this.isSharp = on;
  }

  turn(right, up) {
    this.touched = true;
    const offset = this.camera.position.clone().sub(this.controls.target);
    const size = offset.length();
    const azimuth = Math.atan2(offset.y, offset.x) - right;
    const height = Math.min(Math.max(Math.asin(offset.z / size) + up, -1.55), 1.55);
    offset.set(Math.cos(height) * Math.cos(azimuth), Math.cos(height) * Math.sin(azimuth), Math.sin(height));
    this.camera.position.copy(this.controls.target).addScaledVector(offset, size);
    this.controls.update();
    this.ask();
  }

  zoom(factor) {
    this.touched = true;
    const offset = this.camera.position.clone().sub(this.controls.target).multiplyScalar(factor);
    this.camera.position.copy(this.controls.target).add(offset);
    this.controls.update();
    this.ask();
  }

  // Fold to a share, and explode by a share of the size.
  move(share = this.share, explosion = this.explosion) {
    this.share = share;
    this.explosion = explosion;
    const { data, points } = this;
    const centre = this.box[0].map((x, k) => 0.5 * (x + this.box[1][k]));
    let known = -1;
    let own = null;
    const sorted = this.copies.map((_, k) => k).sort((a, b) => this.copies[a].panel - this.copies[b].panel);
    for (const k of sorted) {
      const { panel, motion, first, count, middle } = this.copies[k];
      if (panel !== known) {
        own = new Float32Array(3 * count);
        this.folds[panel].at(share, own);
        known = panel;
      }
      const shift = [0, 1, 2].map((i) => motion[4 * i + 3] + 1.2 * explosion * (middle[i] - centre[i]));
      for (let v = 0; v < count; v++) {
        const [x, y, z] = [own[3 * v], own[3 * v + 1], own[3 * v + 2]];
        for (let i = 0; i < 3; i++)
          points[3 * (first + v) + i] = motion[4 * i] * x + motion[4 * i + 1] * y + motion[4 * i + 2] * z + shift[i];
      }
    }
    this.place.needsUpdate = true;
    this.follow();
    this.drawMarks();
    this.ask();
  }

  // Keep the distance in proportion to the size of what is shown, and its middle in view.
  follow() {
    const before = this.around;
    const [low, high] = boxOf([this.points]);
    const middle = new Vector3(...low.map((x, k) => 0.5 * (x + high[k])));
    this.around = { middle, size: Math.hypot(...low.map((x, k) => high[k] - x)) || 1 };
    if (!before) return;
    const grown = this.around.size / before.size;
    const moved = this.controls.target.clone().sub(before.middle).multiplyScalar(grown).add(middle);
    const offset = this.camera.position.clone().sub(this.controls.target).multiplyScalar(grown);
    this.controls.target.copy(moved);
    this.camera.position.copy(moved).add(offset);
    this.camera.lookAt(moved);
  }

  // Show only the first panels in the order of joining.
  show(count) {
    this.shown = count;
    const last = this.copies[count - 1];
    this.surface.geometry.setDrawRange(0, last.to);
    this.lines[0].geometry.setDrawRange(0, last.rims);
    last.bends.forEach((n, k) => this.lines[k + 1].geometry.setDrawRange(0, n));
    this.drawMarks();
    this.ask();
  }

  // Colour the points of each copy: call(panel, point, out) writes red, green, blue.
  colour(call) {
    const out = [0, 0, 0];
    for (const { panel, first, count } of this.copies)
      for (let v = 0; v < count; v++) {
        const own = call(panel, v, out);
        this.colours[3 * (first + v)] = own[0];
        this.colours[3 * (first + v) + 1] = own[1];
        this.colours[3 * (first + v) + 2] = own[2];
      }
    this.shade.needsUpdate = true;
    this.ask();
  }

  // Outline panels thickly.
  mark(panels) {
    this.markedPanels = new Set(panels);
    this.drawMarks();
    this.ask();
  }

  // Draw a seam thickly; only where it is while nothing is folded or exploded.
  markSeam(seam) {
    this.markedSeam = seam;
    this.drawMarks();
    this.ask();
  }

  drawMarks() {
    if (!this.marked) return;
    const ends = [];
    this.copies.forEach((copy, k) => {
      if (!this.markedPanels?.has(copy.panel) || k >= (this.shown ?? Infinity)) return;
      const index = this.lines[0].geometry.index.array;
      for (let j = k ? this.copies[k - 1].rims : 0; j < copy.rims; j++) this.push(ends, index[j]);
    });
    set(this.marked, ends);
    const sides = [];
    const seam = this.markedSeam;
    if (seam) {
      for (const copy of this.copies) {
        const own = seam.panels.indexOf(copy.panel);
        if (own < 0) continue;
        const both = seam.panels[0] === seam.panels[1] ? [0, 1] : [own];
        for (const side of both) this.pushSeam(sides, seam, side, copy);
      }
    }
    set(this.seam, sides);
  }

  // The points of a seam are carried by the nearest points of the panel's outline.
  pushSeam(out, seam, side, copy) {
    const panel = this.data.panels[copy.panel];
    const count = seam.line.length / 6;
    const before = [];
    for (let k = 0; k < count; k++) {
      const p = seam.line.subarray(3 * (side * count + k), 3 * (side * count + k) + 3);
      const [a, b, s] = nearestEdge(panel, p);
      const point = [0, 1, 2].map((i) => {
        const x = this.points[3 * (copy.first + a) + i];
        return x + s * (this.points[3 * (copy.first + b) + i] - x);
      });
      if (k) out.push(...before, ...point);
      before.splice(0, 3, ...point);
    }
  }

  // Where the numbers of seams stand, for each copy: the middle of a side, as a share along an edge.
  get seamEnds() {
    if (this.ends) return this.ends;
    const { data } = this;
    const own = data.panels.map(() => []);
    for (const seam of data.seams)
      seam.panels.forEach((panel, side) => own[panel].push([seam, ...nearestEdge(data.panels[panel], middleAlong(seam.line, side))]));
    this.ends = this.copies.flatMap((copy, k) => own[copy.panel].map(([seam, a, b, s]) => ({ seam, copy, k, a, b, s, seen: false })));
    return this.ends;
  }

  // The place of such an end; on the canvas (-1 to 1); and how far from the viewer it is.
  endPoint({ copy, a, b, s }) {
    const [one, two] = [a, b].map((v) => new Vector3().fromArray(this.points, 3 * (copy.first + v)));
    return one.lerp(two, s);
  }

  endOnCanvas(end) {
    return this.endPoint(end).project(this.camera);
  }

  farOf(end) {
    return this.endPoint(end).distanceTo(this.camera.position);
  }

  push(out, v) {
    out.push(this.points[3 * v], this.points[3 * v + 1], this.points[3 * v + 2]);
  }

  ask() {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => {
      this.asked = false;
      this.draw();
    });
  }

  draw() {
    const now = performance.now();
    const passed = now - (this.last ?? -Infinity);
    this.last = now;
    if (passed < 300) {
      this.pace = 0.7 * (this.pace ?? passed) + 0.3 * passed;
      if (this.pace > SLOW || this.isSlow) this.sharpen(false);
    }
    this.renderer.render(this.scene, this.camera);
    for (const call of this.listeners.frame) call();
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.settle(), 150);
  }

  // Once nothing moves.
  settle() {
    if (this.asked) return;
    if (!this.isSharp) {
      this.sharpen(true);
      this.renderer.render(this.scene, this.camera);
    }
    for (const call of this.listeners.rest) call();
  }

  // The copy that is seen in each pixel of a small picture, from below upwards; -1 for none.
  async seen() {
    const wide = FINE;
    const high = Math.max(Math.round(FINE / this.camera.aspect), 1);
    this.target.setSize(wide, high);
    const bytes = new Uint8Array(4 * wide * high);
    if (!this.surface.visible) return { wide, high, owner: new Int32Array(wide * high).fill(-1) };
    const others = this.scene.children.filter((one) => one !== this.surface && one.visible);
    for (const one of others) one.visible = false;
    this.surface.material = this.byName;
    this.renderer.setRenderTarget(this.target);
    this.renderer.setClearColor(0, 0);
    this.renderer.clear();
    this.renderer.render(this.scene, this.camera);
    this.renderer.setRenderTarget(null);
    this.surface.material = this.material;
    for (const one of others) one.visible = true;
    await this.renderer.readRenderTargetPixelsAsync(this.target, 0, 0, wide, high, bytes);
    const owner = new Int32Array(wide * high);
    for (let k = 0; k < owner.length; k++)
      owner[k] = bytes[4 * k] + 256 * bytes[4 * k + 1] + 65536 * bytes[4 * k + 2] - 1;
    return { wide, high, owner };
  }

  // What a ray through a point of the canvas (-1 to 1) meets first.
  pick(x, y) {
    if (!this.surface.visible) return null;
    const from = this.camera.position;
    const to = new Vector3(x, y, 0.5).unproject(this.camera).sub(from).normalize();
    const { points: p, triangles: t } = this;
    const last = this.shown ? this.copies[this.shown - 1].to : t.length;
    let best = null;
    let least = Infinity;
    for (let k = 0; k < last; k += 3) {
      const [a, b, c] = [3 * t[k], 3 * t[k + 1], 3 * t[k + 2]];
      const ux = p[b] - p[a], uy = p[b + 1] - p[a + 1], uz = p[b + 2] - p[a + 2];
      const vx = p[c] - p[a], vy = p[c + 1] - p[a + 1], vz = p[c + 2] - p[a + 2];
      const hx = to.y * vz - to.z * vy, hy = to.z * vx - to.x * vz, hz = to.x * vy - to.y * vx;
      const det = ux * hx + uy * hy + uz * hz;
      if (det === 0) continue;
      const sx = from.x - p[a], sy = from.y - p[a + 1], sz = from.z - p[a + 2];
      const r = (sx * hx + sy * hy + sz * hz) / det;
      if (r < 0 || r > 1) continue;
      const qx = sy * uz - sz * uy, qy = sz * ux - sx * uz, qz = sx * uy - sy * ux;
      const s = (to.x * qx + to.y * qy + to.z * qz) / det;
      if (s < 0 || r + s > 1) continue;
      const far = (vx * qx + vy * qy + vz * qz) / det;
      if (far > 0 && far < least) {
        least = far;
        best = { at: k, shares: [1 - r - s, r, s] };
      }
    }
    if (!best) return null;
    const copy = this.copies[this.owner[best.at / 3]];
    const corners = [0, 1, 2].map((j) => t[best.at + j] - copy.first);
    return { copy, panel: copy.panel, corners, shares: best.shares, far: least };
  }

  // The place on the canvas (-1 to 1) of the middle of a copy's pattern.
  anchor(copy) {
    const fold = this.folds[copy.panel];
    const point = new Vector3();
    for (const v of fold.corners(fold.root)) {
      const at = 3 * (copy.first + v);
      point.x += this.points[at] / 3;
      point.y += this.points[at + 1] / 3;
      point.z += this.points[at + 2] / 3;
    }
    return point.project(this.camera);
  }
}

function set(line, ends) {
  line.visible = ends.length > 0;
  if (!ends.length) return;
  line.geometry.dispose();
  line.geometry = new LineSegmentsGeometry();
  line.geometry.setPositions(ends);
}

function transformed(points, motion) {
  const out = new Float32Array(points.length);
  for (let v = 0; v < points.length; v += 3)
    for (let i = 0; i < 3; i++)
      out[v + i] =
        motion[4 * i] * points[v] + motion[4 * i + 1] * points[v + 1] + motion[4 * i + 2] * points[v + 2] + motion[4 * i + 3];
  return out;
}

function middleOf(points) {
  const out = [0, 0, 0];
  for (let k = 0; k < points.length; k++) out[k % 3] += (3 * points[k]) / points.length;
  return out;
}

function boxOf(every) {
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  for (const points of every)
    for (let k = 0; k < points.length; k++) {
      low[k % 3] = Math.min(low[k % 3], points[k]);
      high[k % 3] = Math.max(high[k % 3], points[k]);
    }
  return Number.isFinite(low[0]) ? [low, high] : [[0, 0, 0], [1, 1, 1]];
}

// The point half-way along one side of a seam, whose line has the points of both.
function middleAlong(line, side) {
  const count = line.length / 6;
  const point = (k) => line.subarray(3 * (side * count + k), 3 * (side * count + k) + 3);
  const steps = [0];
  for (let k = 1; k < count; k++) {
    const [p, q] = [point(k - 1), point(k)];
    steps.push(steps[k - 1] + Math.hypot(q[0] - p[0], q[1] - p[1], q[2] - p[2]));
  }
  const half = 0.5 * steps[count - 1];
  const k = Math.max(steps.findIndex((x) => x >= half), 1);
  const share = (half - steps[k - 1]) / (steps[k] - steps[k - 1] || 1);
  const [p, q] = [point(k - 1), point(Math.min(k, count - 1))];
  return [0, 1, 2].map((i) => p[i] + share * (q[i] - p[i]));
}

function nearestEdge(panel, p) {
  const { rim, points } = panel;
  let best = [0, 0, 0];
  let least = Infinity;
  for (let k = 0; k < rim.length; k += 2) {
    const [a, b] = [rim[k], rim[k + 1]];
    let along = 0;
    let length = 0;
    for (let i = 0; i < 3; i++) {
      const step = points[3 * b + i] - points[3 * a + i];
      along += step * (p[i] - points[3 * a + i]);
      length += step * step;
    }
    const s = length ? Math.min(Math.max(along / length, 0), 1) : 0;
    let far = 0;
    for (let i = 0; i < 3; i++) {
      const x = points[3 * a + i];
      far += (x + s * (points[3 * b + i] - x) - p[i]) ** 2;
    }
    if (far < least) [least, best] = [far, [a, b, s]];
  }
  return best;
}
