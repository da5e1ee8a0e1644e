// Fold a pattern to its place: triangles turn about the edges of a tree from the middle outwards,
// by a share of their angles. What the tree misses (strain, edges that are not in it) is added in
// proportion, so that both ends are exact.

// A panel without a pattern, which stays where it is.
export class Still {
  constructor(points, triangles) {
    this.points = points;
    this.triangles = triangles;
    const count = points.length / 3;
    const middle = [0, 0, 0];
    for (let k = 0; k < points.length; k++) middle[k % 3] += points[k] / count;
    let least = Infinity;
    this.root = 0;
    for (let f = 0; f < triangles.length / 3; f++) {
      const at = 3 * triangles[3 * f];
      const away = Math.hypot(...middle.map((x, i) => points[at + i] - x));
      if (away < least) [least, this.root] = [away, f];
    }
  }

  corners(f) {
    return [...this.triangles.subarray(3 * f, 3 * f + 3)];
  }

  at(share, out) {
    out.set(this.points);
  }
}

export class Fold {
  // points (3 n), flat (2 n), triangles (3 m)
  constructor(points, flat, triangles) {
    this.points = points;
    this.flat = flat;
    this.triangles = triangles;
    const count = triangles.length / 3;
    const n = flat.length / 2;
    this.owner = new Map();
    for (let f = 0; f < count; f++)
      for (let k = 0; k < 3; k++)
        this.owner.set(triangles[3 * f + k] * n + triangles[3 * f + ((k + 1) % 3)], f);
    this.sign = this.signedArea() < 0 ? -1 : 1;
    this.normals = new Float64Array(3 * count);
    for (let f = 0; f < count; f++) this.normals.set(this.normal(f), 3 * f);
    this.root = this.middle();
    this.tree(n);
    this.often = new Float32Array(n);
    for (const v of triangles) this.often[v] += 1;
    this.motion = new Float64Array(12 * count);
    this.rest = new Float32Array(points.length);
    const end = new Float32Array(points.length);
    this.at(1, end);
    for (let k = 0; k < end.length; k++) this.rest[k] = points[k] - end[k];
  }

  signedArea() {
    let sum = 0;
    for (let f = 0; f < this.triangles.length / 3; f++) sum += this.area2(f);
    return sum;
  }

  area2(f) {
    const [a, b, c] = this.corners(f);
    const q = this.flat;
    return (
      (q[2 * b] - q[2 * a]) * (q[2 * c + 1] - q[2 * a + 1]) -
      (q[2 * b + 1] - q[2 * a + 1]) * (q[2 * c] - q[2 * a])
    );
  }

  corners(f) {
    const t = this.triangles;
    return [t[3 * f], t[3 * f + 1], t[3 * f + 2]];
  }

  point(v) {
    const p = this.points;
    return [p[3 * v], p[3 * v + 1], p[3 * v + 2]];
  }

  normal(f) {
    const [a, b, c] = this.corners(f).map((v) => this.point(v));
    return unit(cross(sub(b, a), sub(c, a)));
  }

  // The triangle whose middle is the nearest to that of the pattern.
  middle() {
    const count = this.triangles.length / 3;
    const middles = new Float64Array(2 * count);
    let x = 0;
    let y = 0;
    let total = 0;
    for (let f = 0; f < count; f++) {
      const weight = Math.abs(this.area2(f));
      for (const v of this.corners(f)) {
        middles[2 * f] += this.flat[2 * v] / 3;
        middles[2 * f + 1] += this.flat[2 * v + 1] / 3;
      }
      x += weight * middles[2 * f];
      y += weight * middles[2 * f + 1];
      total += weight;
    }
    let best = 0;
    let least = Infinity;
    for (let f = 0; f < count; f++) {
      const far = Math.hypot(middles[2 * f] - x / total, middles[2 * f + 1] - y / total);
      if (far < least && this.area2(f) !== 0) [best, least] = [f, far];
    }
    return best;
  }

  // Breadth first: parent, edge and angle of each triangle, in an order in which parents come first.
  tree(n) {
    const count = this.triangles.length / 3;
    this.parent = new Int32Array(count).fill(-1);
    this.edge = new Int32Array(2 * count);
    this.angle = new Float64Array(count);
    this.order = [];
    const known = new Uint8Array(count);
    const roots = [this.root];
    for (let f = 0; f < count; f++) roots.push(f);
    for (const root of roots) {
      if (known[root]) continue;
      known[root] = 1;
      const queue = [root];
      for (let at = 0; at < queue.length; at++) {
        const f = queue[at];
        this.order.push(f);
        const own = this.corners(f);
        for (let k = 0; k < 3; k++) {
          const a = own[k];
          const b = own[(k + 1) % 3];
          const other = this.owner.get(b * n + a);
          if (other === undefined || known[other]) continue;
          known[other] = 1;
          this.parent[other] = f;
          this.edge[2 * other] = a;
          this.edge[2 * other + 1] = b;
          const [one, two] = [f, other].map((g) => this.normals.subarray(3 * g, 3 * g + 3));
          const along = unit(sub(this.point(b), this.point(a)));
          this.angle[other] = Math.atan2(dot(cross(one, two), along), dot(one, two));
          queue.push(other);
        }
      }
    }
  }

  // Write the points (3 n) for a share of the angles: 0 is flat, 1 is in place.
  at(share, out) {
    const { motion, flat, triangles, parent, edge, angle } = this;
    for (const f of this.order) {
      const m = 12 * f;
      if (parent[f] < 0) {
        motion.set(this.frame(f), m);
        continue;
      }
      const p = 12 * parent[f];
      const a = edge[2 * f];
      const b = edge[2 * f + 1];
      const ax = flat[2 * a];
      const ay = flat[2 * a + 1];
      let dx = flat[2 * b] - ax;
      let dy = flat[2 * b + 1] - ay;
      const length = Math.hypot(dx, dy) || 1;
      dx /= length;
      dy /= length;
      const c = Math.cos(share * angle[f]);
      const s = Math.sin(share * angle[f]);
      // The rotation about the edge: rows (xx, xy, ys), (xy, yy, -xs), (-ys, xs, c).
      const xx = c + dx * dx * (1 - c);
      const xy = dx * dy * (1 - c);
      const yy = c + dy * dy * (1 - c);
      const xs = dx * s;
      const ys = dy * s;
      const sx = ax - xx * ax - xy * ay;
      const sy = ay - xy * ax - yy * ay;
      const sz = ys * ax - xs * ay;
      for (let i = 0; i < 12; i += 4) {
        const x = motion[p + i];
        const y = motion[p + i + 1];
        const z = motion[p + i + 2];
        motion[m + i] = x * xx + y * xy - z * ys;
        motion[m + i + 1] = x * xy + y * yy + z * xs;
        motion[m + i + 2] = x * ys - y * xs + z * c;
        motion[m + i + 3] = x * sx + y * sy + z * sz + motion[p + i + 3];
      }
    }
    out.fill(0);
    for (let f = 0; f < triangles.length / 3; f++) {
      const m = 12 * f;
      for (let k = 0; k < 3; k++) {
        const v = triangles[3 * f + k];
        const x = flat[2 * v];
        const y = flat[2 * v + 1];
        for (let i = 0; i < 3; i++)
          out[3 * v + i] += motion[m + 4 * i] * x + motion[m + 4 * i + 1] * y + motion[m + 4 * i + 3];
      }
    }
    for (let v = 0; v < this.often.length; v++)
      for (let i = 0; i < 3; i++)
        out[3 * v + i] = out[3 * v + i] / (this.often[v] || 1) + share * this.rest[3 * v + i];
  }

  // The motion that lays a triangle of the pattern on its place: rows of a matrix, 3 x 4.
  frame(f) {
    const [a, b, c] = this.corners(f);
    const q = this.flat;
    const way = unit([q[2 * b] - q[2 * a], q[2 * b + 1] - q[2 * a + 1], 0]);
    const across = [-this.sign * way[1], this.sign * way[0], 0];
    const x = unit(sub(this.point(b), this.point(a)));
    const z = this.normals.subarray(3 * f, 3 * f + 3);
    const y = cross(z, x);
    const rows = [];
    const middle = [0, 1, 2].map((i) => (this.point(a)[i] + this.point(b)[i] + this.point(c)[i]) / 3);
    const from = [0, 1].map((i) => (q[2 * a + i] + q[2 * b + i] + q[2 * c + i]) / 3);
    for (let i = 0; i < 3; i++) {
      const row = [0, 1, 2].map((j) => x[i] * way[j] + y[i] * across[j] + z[i] * (j === 2 ? this.sign : 0));
      rows.push(...row, middle[i] - row[0] * from[0] - row[1] * from[1]);
    }
    return rows;
  }
}

const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

function unit(a) {
  const length = Math.hypot(a[0], a[1], a[2]) || 1;
  return [a[0] / length, a[1] / length, a[2] / length];
}
