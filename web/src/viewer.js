// The viewer: the canvas with its controls, labels, heat maps, and what is under the pointer.

import { colour, gradient } from "./colours.js";
import { Stage } from "./scene.js";
import { isInches, length, onUnit, plain, unitName, withUnit } from "./units.js";

const INCH = 25.4;
// Names that are drawn while something moves: those of the parts that are the largest on the screen.
const MOVING = 80;
// Ends of seams up to which all have their numbers; else those of the part that was chosen.
const FEW = 60;
// How far behind a face, relative to the size, the edge that it ends at may seem to be.
const NEAR = 0.01;
// Pixels from the border of what is seen of a part that a name should keep.
const ROOM = 7;
const LABELS = { deviation: "deviation", strain: "strain", curvature: "Gaussian curvature", bending: "bending" };

const FRAME = `
<div class="stage">
  <canvas class="space" tabindex="0" role="img" aria-label="The parts in space: arrows turn, plus and minus zoom, a click chooses a part"></canvas>
  <canvas class="labels" aria-hidden="true"></canvas>
  <output class="hint" hidden></output>
</div>
<form class="controls" autocomplete="off">
  <fieldset class="choice"><legend>Show</legend>
    <label><input type="radio" name="what" value="result" checked>result</label>
    <label><input type="radio" name="what" value="design">design</label>
    <label><input type="radio" name="what" value="both">both</label>
  </fieldset>
  <label class="slider">fold <input type="range" name="fold" min="0" max="1" step="0.01" value="1"></label>
  <label class="slider">explode <input type="range" name="explode" min="0" max="1" step="0.01" value="0"></label>
  <label class="slider">joined <input type="range" name="joined" min="1" step="1"><output></output></label>
  <label>colours <select name="colours"><option value="">parts</option></select></label>
  <span class="range" hidden><input type="number" name="low" step="any" aria-label="least value">
    <i class="bar"></i><input type="number" name="high" step="any" aria-label="largest value"><span class="of"></span></span>
  <label><input type="checkbox" name="names" checked>names</label>
  <label><input type="checkbox" name="bends" checked>bends</label>
  <label><input type="checkbox" name="seams" checked>seams</label>
  <label class="units"><input type="checkbox" name="inches">inch</label>
  <button type="button" name="home">reset view</button>
</form>`;

export class Viewer {
  constructor(data, place, choose, setUnit) {
    this.data = data;
    this.choose = choose;
    this.chosen = null;
    place.innerHTML = FRAME;
    this.space = place.querySelector(".space");
    this.sheet = place.querySelector(".labels");
    this.hint = place.querySelector(".hint");
    this.form = place.querySelector("form");
    this.stage = new Stage(data, this.space);
    this.visible = new Map();
    this.names = new Map();
    this.values();
    this.controls(setUnit);
    this.pointer();
    this.keys();
    this.stage.listeners.frame.push(() => this.label());
    this.stage.listeners.rest.push(() => this.settle());
    new ResizeObserver(() => this.stage.fit()).observe(this.space.parentElement);
    const theme = () => {
      this.names.clear();
      this.stage.paint(getComputedStyle(document.documentElement));
      this.colour();
    };
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", theme);
    theme();
    onUnit(() => this.range());
  }

  // Ranges of the values that can be shown, without the two per cent that are the farthest out.
  values() {
    this.ranges = {};
    for (const name of Object.keys(this.data.values)) {
      const every = this.data.panels.flatMap((panel) => (panel.values[name] ? [...panel.values[name]] : []));
      const sorted = every.filter(Number.isFinite).sort((a, b) => a - b);
      if (!sorted.length) continue;
      const share = (x) => sorted[Math.min(Math.floor(x * sorted.length), sorted.length - 1)];
      let [low, high] = name === "curvature" || name === "bending" ? [share(0.02), share(0.98)] : [0, sorted.at(-1)];
      if (low < 0) [low, high] = [-Math.max(-low, high), Math.max(-low, high)];
      else low = 0;
      this.ranges[name] = { low, high, standard: [low, high] };
      const option = new Option(LABELS[name] ?? name, name);
      option.title = this.data.values[name].text;
      this.form.elements.colours.append(option);
    }
  }

  controls(setUnit) {
    const { form, stage } = this;
    const own = form.elements;
    form.addEventListener("submit", (event) => event.preventDefault());
    own.joined.max = stage.copies.length;
    own.joined.value = stage.copies.length;
    if (stage.copies.length < 2) own.joined.closest("label").hidden = own.explode.closest("label").hidden = true;
    own.fold.addEventListener("input", () => stage.move(Number(own.fold.value), stage.explosion));
    own.explode.addEventListener("input", () => stage.move(stage.share, Number(own.explode.value)));
    own.joined.addEventListener("input", () => this.join());
    for (const one of own.what) one.addEventListener("change", () => this.what());
    own.colours.addEventListener("change", () => {
      this.range();
      this.colour();
    });
    for (const name of ["low", "high"])
      own[name].addEventListener("change", () => {
        const range = this.ranges[own.colours.value];
        const value = own[name].value.trim();
        const number = Number(value) * this.factor();
        range[name] = value === "" || !Number.isFinite(number) ? range.standard[name === "low" ? 0 : 1] : number;
        this.range();
        this.colour();
      });
    if (!this.data.panels.some((panel) => panel.flat)) own.fold.closest("label").hidden = true;
    if (!this.data.panels.some((panel) => panel.angles.length)) own.bends.closest("label").hidden = true;
    if (!this.data.seams.length) own.seams.closest("label").hidden = true;
    own.names.addEventListener("change", () => this.settle());
    own.seams.addEventListener("change", () => this.settle());
    own.bends.addEventListener("change", () => this.what());
    own.inches.addEventListener("change", () => setUnit(own.inches.checked));
    own.home.addEventListener("click", () => {
      own.fold.value = 1;
      own.explode.value = 0;
      own.joined.value = own.joined.max;
      stage.move(1, 0);
      this.join();
      stage.look();
    });
    this.join();
  }

  join() {
    const { joined } = this.form.elements;
    this.stage.show(Number(joined.value));
    joined.nextElementSibling.textContent = `${joined.value} of ${joined.max}`;
  }

  what() {
    const { stage } = this;
    const what = this.form.elements.what.value;
    for (const one of stage.group) one.visible = what !== "design";
    for (const one of stage.lines.slice(1)) one.visible &&= this.form.elements.bends.checked;
    stage.designs.visible = what !== "result";
    const glass = what === "both";
    Object.assign(stage.designs.material, { transparent: glass, depthWrite: !glass });
    stage.designs.material.uniforms.opacity.value = glass ? 0.35 : 1;
    stage.designs.material.needsUpdate = true;
    stage.ask();
  }

  // Millimetres per unit of the numbers in the range.
  factor() {
    return this.form.elements.colours.value === "deviation" && isInches() ? INCH : 1;
  }

  unit(name) {
    const { unit } = this.data.values[name];
    return unit === "mm" ? unitName() : unit;
  }

  range() {
    const own = this.form.elements;
    const name = own.colours.value;
    const box = this.form.querySelector(".range");
    box.hidden = !name;
    if (!name) return;
    const { low, high } = this.ranges[name];
    own.low.value = plain(low / this.factor(), 4);
    own.high.value = plain(high / this.factor(), 4);
    box.querySelector(".bar").style.background = gradient(low, high);
    box.querySelector(".of").textContent = this.unit(name);
  }

  colour() {
    const { data, stage } = this;
    const name = this.form.elements.colours.value;
    if (name) {
      const { low, high } = this.ranges[name];
      stage.colour((panel, v, out) => colour(data.panels[panel].values[name]?.[v] ?? NaN, low, high, out));
      return;
    }
    const style = getComputedStyle(document.documentElement);
    const accent = rgb(style.getPropertyValue("--accent"));
    stage.colour((panel, v, out) => {
      const own = data.panels[panel];
      if (this.chosen === null || own.part !== this.chosen) return own.colour;
      for (let k = 0; k < 3; k++) out[k] = 0.35 * own.colour[k] + 0.65 * accent[k];
      return out;
    });
  }

  // Mark a part, which may be made of several panels.
  mark(part) {
    this.chosen = part;
    this.stage.mark(part === null ? [] : this.data.parts[part].panels);
    this.colour();
  }

  markSeam(seam) {
    this.seam = seam;
    this.stage.markSeam(seam);
  }

  pointer() {
    const { space } = this;
    let down = null;
    let asked = null;
    space.addEventListener("pointerdown", (event) => (down = [event.clientX, event.clientY]));
    space.addEventListener("pointerup", (event) => {
      const still = down && Math.hypot(event.clientX - down[0], event.clientY - down[1]) < 5;
      down = null;
      if (still) this.choose(this.stage.pick(...this.at(event))?.panel ?? null);
    });
    space.addEventListener("pointermove", (event) => {
      const first = asked === null;
      asked = event;
      if (first)
        requestAnimationFrame(() => {
          if (down === null) this.tell(asked);
          asked = null;
        });
    });
    space.addEventListener("pointerleave", () => (this.hint.hidden = true));
  }

  at(event) {
    const box = this.space.getBoundingClientRect();
    return [(2 * (event.clientX - box.left)) / box.width - 1, 1 - (2 * (event.clientY - box.top)) / box.height];
  }

  // Say what is under the pointer.
  tell(event) {
    const found = this.stage.pick(...this.at(event));
    this.hint.hidden = !found;
    if (!found) return;
    const panel = this.data.panels[found.panel];
    const lines = [panel.name];
    for (const name of Object.keys(this.ranges)) {
      const value = this.value(panel.values[name], found);
      if (!Number.isFinite(value)) continue;
      const { unit } = this.data.values[name];
      const said = unit === "mm" ? withUnit(value, 3) : `${plain(value)} ${unit}`;
      lines.push(`${LABELS[name] ?? name} ${said}`);
    }
    const bend = this.bendNear(panel, found);
    if (bend !== null) {
      const [angle, radius] = [panel.angles[bend], panel.radii[bend]];
      lines.push(`bend ${angle > 0 ? "down" : "up"} ${plain(Math.abs(angle))}°${radius ? `, radius ${withUnit(radius)}` : ""}`);
    }
    this.hint.replaceChildren(...lines.map((line) => Object.assign(document.createElement("div"), { textContent: line })));
    const box = this.space.getBoundingClientRect();
    const [x, y] = [event.clientX - box.left, event.clientY - box.top];
    this.hint.style.left = `${Math.min(x + 14, box.width - this.hint.offsetWidth - 4)}px`;
    this.hint.style.top = `${Math.min(y + 14, box.height - this.hint.offsetHeight - 4)}px`;
  }

  value(values, { corners, shares }) {
    if (!values) return NaN;
    let sum = 0;
    let weight = 0;
    corners.forEach((v, k) => {
      if (!Number.isFinite(values[v])) return;
      sum += shares[k] * values[v];
      weight += shares[k];
    });
    return weight > 0.3 ? sum / weight : NaN;
  }

  // The bend line that is the nearest in the pattern, if it is near on the screen.
  bendNear(panel, { corners, shares, far }) {
    if (!panel.angles.length) return null;
    const q = panel.flat;
    const [x, y] = [0, 1].map((i) => corners.reduce((sum, v, k) => sum + shares[k] * q[2 * v + i], 0));
    const pixel = (2 * far * Math.tan((this.stage.camera.fov * Math.PI) / 360)) / this.space.clientHeight;
    let best = null;
    let least = 8 * pixel;
    for (let k = 0; k < panel.angles.length; k++) {
      const [a, b] = [2 * panel.bends[2 * k], 2 * panel.bends[2 * k + 1]];
      const [dx, dy] = [q[b] - q[a], q[b + 1] - q[a + 1]];
      const s = Math.min(Math.max(((x - q[a]) * dx + (y - q[a + 1]) * dy) / (dx * dx + dy * dy || 1), 0), 1);
      const away = Math.hypot(q[a] + s * dx - x, q[a + 1] + s * dy - y);
      if (away < least) [least, best] = [away, k];
    }
    return best;
  }

  keys() {
    const moves = {
      ArrowLeft: [-0.12, 0], ArrowRight: [0.12, 0], ArrowUp: [0, 0.12], ArrowDown: [0, -0.12],
    };
    this.space.addEventListener("keydown", (event) => {
      const { data } = this;
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      if (moves[event.key]) this.stage.turn(...moves[event.key]);
      else if (event.key === "+" || event.key === "=") this.stage.zoom(0.88);
      else if (event.key === "-") this.stage.zoom(1 / 0.88);
      else if (event.key === "Escape") this.choose(null);
      else if ((event.key === "n" || event.key === "p") && data.parts.length) {
        const way = event.key === "n" ? 1 : -1;
        const next = this.chosen === null ? 0 : (this.chosen + way + data.parts.length) % data.parts.length;
        this.choose(data.parts[next].panels[0] ?? null);
      } else return;
      event.preventDefault();
    });
  }

  // Find where each panel is seen, once nothing moves.
  async settle() {
    const { wide, high, owner } = await this.stage.seen();
    if (this.stage.asked) return;
    const sums = new Map();
    owner.forEach((k, at) => {
      if (k < 0) return;
      const own = sums.get(k) ?? sums.set(k, [0, 0, 0]).get(k);
      own[0] += at % wide;
      own[1] += Math.floor(at / wide);
      own[2] += 1;
    });
    // Where there is room, and there as near to the middle as possible.
    const room = roomAround(wide, owner);
    const best = new Map();
    owner.forEach((k, at) => {
      if (k < 0) return;
      const [x, y, n] = sums.get(k);
      if (n < 12) return;
      const away = Math.hypot((at % wide) - x / n, Math.floor(at / wide) - y / n);
      const known = best.get(k);
      if (!known || room[at] > known[2] || (room[at] === known[2] && away < known[0])) best.set(k, [away, at, room[at]]);
    });
    this.findSeams(wide, high, owner);
    this.visible = new Map(
      [...best].map(([k, [, at]]) => [k, [((at % wide) + 0.5) / wide, 1 - (Math.floor(at / wide) + 0.5) / high, sums.get(k)[2]]]),
    );
    this.still = true;
    this.label();
    this.still = false;
  }

  // Write the names where panels are seen; while something moves, at the middles of those.
  label() {
    const { sheet, stage } = this;
    const ratio = Math.min(window.devicePixelRatio, 2);
    const [wide, high] = [sheet.clientWidth, sheet.clientHeight];
    if (sheet.width !== Math.round(wide * ratio)) sheet.width = Math.round(wide * ratio);
    if (sheet.height !== Math.round(high * ratio)) sheet.height = Math.round(high * ratio);
    const pen = sheet.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, wide, high);
    if (!stage.surface.visible) return;
    const taken = [];
    // Beside the names of parts, or before them where a part or a seam was chosen.
    const chosen = this.chosen !== null || Boolean(this.seam);
    if (chosen) this.labelSeams(pen, taken, ratio);
    if (this.form.elements.names.checked) this.labelParts(pen, taken, ratio);
    if (!chosen) this.labelSeams(pen, taken, ratio);
  }

  // The seams whose numbers are shown.
  seamsShown() {
    const { data, stage } = this;
    if (!this.form.elements.seams.checked) return [];
    const all = this.chosen === null && !this.seam && stage.seamEnds.length <= FEW;
    return stage.seamEnds.filter(
      ({ seam, k }) =>
        k < stage.shown &&
        (all || seam === this.seam || (this.chosen !== null && seam.panels.some((panel) => data.panels[panel].part === this.chosen))),
    );
  }

  // Tell which ends of seams are seen: their panel is within two pixels of them, and nothing in front.
  findSeams(wide, high, owner) {
    const { stage } = this;
    for (const end of this.seamsShown()) {
      const place = stage.endOnCanvas(end);
      const [x, y] = [Math.floor(0.5 * (place.x + 1) * wide), Math.floor(0.5 * (place.y + 1) * high)];
      end.seen = false;
      for (let i = Math.max(x - 2, 0); i <= Math.min(x + 2, wide - 1); i++)
        for (let j = Math.max(y - 2, 0); j <= Math.min(y + 2, high - 1); j++) end.seen ||= owner[j * wide + i] === end.k;
      const first = end.seen && stage.pick(place.x, place.y);
      if (first) end.seen = first.far > stage.farOf(end) - NEAR * stage.around.size;
    }
  }

  labelSeams(pen, taken, ratio) {
    const { sheet, stage } = this;
    const numbers = [];
    for (const end of this.seamsShown()) {
      if (!end.seen) continue;
      const place = stage.endOnCanvas(end);
      const at = [0.5 * (place.x + 1) * sheet.clientWidth, 0.5 * (1 - place.y) * sheet.clientHeight];
      // Both sides of a closed seam have one number.
      if (numbers.some(([seam, x, y]) => seam === end.seam && Math.hypot(x - at[0], y - at[1]) < 24)) continue;
      if (this.write(pen, taken, ratio, String(end.seam.number), at, "--number")) numbers.push([end.seam, ...at]);
    }
  }

  // Write a text where there is room.
  write(pen, taken, ratio, text, at, colour) {
    const name = this.written(text, ratio, colour);
    const half = 0.5 * name.text;
    if (taken.some(([u, v, w]) => Math.abs(u - at[0]) < half + w + 2 && Math.abs(v - at[1]) < 13)) return false;
    taken.push([...at, half]);
    pen.drawImage(name.image, at[0] - 0.5 * name.wide, at[1] - 0.5 * name.high, name.wide, name.high);
    return true;
  }

  labelParts(pen, taken, ratio) {
    const { sheet, stage } = this;
    const [wide, high] = [sheet.clientWidth, sheet.clientHeight];
    const order = [...this.visible].sort((a, b) => b[1][2] - a[1][2]).slice(0, this.still ? Infinity : MOVING);
    for (const [k, [x, y]] of order) {
      const copy = stage.copies[k];
      const text = this.data.panels[copy.panel].short;
      let at = [x * wide, y * high];
      if (!this.still) {
        const place = stage.anchor(copy);
        at = [0.5 * (place.x + 1) * wide, 0.5 * (1 - place.y) * high];
      }
      this.write(pen, taken, ratio, text, at, "--on-part");
    }
  }

  // A name with a halo, drawn once: this takes less time than the text in every frame.
  written(text, ratio, colour) {
    const key = colour + text;
    const known = this.names.get(key);
    if (known?.ratio === ratio) return known;
    const image = document.createElement("canvas");
    const pen = image.getContext("2d");
    const font = "600 12px system-ui, sans-serif";
    pen.font = font;
    const width = pen.measureText(text).width;
    const [wide, high] = [Math.ceil(width) + 8, 20];
    [image.width, image.height] = [wide * ratio, high * ratio];
    pen.scale(ratio, ratio);
    const style = getComputedStyle(document.documentElement);
    Object.assign(pen, {
      font, textAlign: "center", textBaseline: "middle", lineWidth: 3, lineJoin: "round",
      strokeStyle: style.getPropertyValue("--halo"), fillStyle: style.getPropertyValue(colour),
    });
    pen.strokeText(text, 0.5 * wide, 0.5 * high);
    pen.fillText(text, 0.5 * wide, 0.5 * high);
    const name = { image, wide, high, text: width, ratio };
    this.names.set(key, name);
    return name;
  }
}

// Steps from each pixel to the nearest of another part, up to ROOM.
function roomAround(wide, owner) {
  const out = new Uint8Array(owner.length);
  const last = owner.length - 1;
  for (const way of [1, -1])
    for (let n = 0; n <= last; n++) {
      const at = way > 0 ? n : last - n;
      const column = at % wide;
      if (owner[at] < 0 || column === 0 || column === wide - 1) continue;
      let least = ROOM - 1;
      for (const step of [1, wide - 1, wide, wide + 1]) {
        const other = at - way * step;
        least = Math.min(least, owner[other] === owner[at] ? out[other] : 0);
      }
      out[at] = way > 0 ? least + 1 : Math.min(out[at], least + 1);
    }
  return out;
}

function rgb(text) {
  const hex = text.trim().replace("#", "");
  return [0, 2, 4].map((k) => Number.parseInt(hex.slice(k, k + 2), 16));
}
