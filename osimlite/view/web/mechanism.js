"use strict";
// Where bodies and paths are, how long the paths are and how they pull: all found by osimlite's own kernels.
// Matrices are arrays of 12 numbers, three rows of four, from a frame to ground.
(() => {
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));

  const point = (m, [x, y, z]) => [
    m[0] * x + m[1] * y + m[2] * z + m[3],
    m[4] * x + m[5] * y + m[6] * z + m[7],
    m[8] * x + m[9] * y + m[10] * z + m[11]];

  class Mechanism {
    constructor({ program, lines }) {
      Object.assign(this, program, { lines, kernels: window.osimlite.kernels });
      const n = this.order.length;
      this.s = new Int32Array(bytes(program.structure).buffer);
      this.x = new Float64Array(bytes(program.numbers).buffer);
      this.w = new Float64Array(program.work);
      this.y = new Float64Array(2 * n);
      this.f = new Float64Array(Math.max(3 * program.most_corners, 2 * n));
      this.given = [this.s, this.x, this.w, this.y, this.f];
    }

    // Have the kernels put everything where coordinate values have it, unless it is there.
    place(q) {
      if (this.q === q) return;
      this.q = q;
      this.order.forEach((c, k) => { this.y[k] = q[c]; });
      this.kernels.place_links(...this.given);
    }

    // Coordinate values with those of dependent coordinates made to fit; couplers may depend on each other.
    coupled(q) {
      const { s, w, y, order, couplers, layout, kernels } = this, values = q.slice();
      let changed = couplers.length > 0;
      this.q = null;
      order.forEach((c, k) => { y[k] = q[c]; });
      for (let round = 0; changed && round < couplers.length; round++) {
        changed = false;
        for (const [record, dependent, error] of couplers) {
          const before = y[dependent];
          y[dependent] = 0;
          kernels.laws[s[layout.laws + s[record]]](...this.given, record);
          y[dependent] = values[order[dependent]] = w[error];
          changed ||= y[dependent] !== before;
        }
      }
      return values;
    }

    // Matrices of all bodies, ground's last.
    poses(q) {
      const { w, layout } = this;
      this.place(q);
      return this.bodies.map(([link, b]) => {
        if (link < 0) return b;
        const m = new Array(12), at = layout.links + layout.link * link;
        for (let i = 0; i < 3; i++) {
          const r = at + 3 * i;
          for (let j = 0; j < 4; j++) m[4 * i + j] = w[r] * b[j] + w[r + 1] * b[4 + j] + w[r + 2] * b[8 + j];
          m[4 * i + 3] += w[at + layout.position + i];
        }
        return m;
      });
    }

    // Corners in ground of line number k.
    corners(k, q, poses) {
      const { route, points } = this.lines[k];
      if (points) return points.map((p) => point(poses[p.body < 0 ? poses.length - 1 : p.body], p.at));
      this.length(route, q);
      const { f } = this, found = [], count = this.kernels.laws[this.traces[route]](...this.given, this.items[route]);
      for (let n = 0; n < 3 * count; n += 3) found.push([f[n], f[n + 1], f[n + 2]]);
      return found;
    }

    // Length of path k, m.
    length(k, q) {
      const { s, layout, items } = this;
      this.place(q);
      this.kernels.laws[s[items[k] + layout.law]](...this.given, items[k]);
      return this.w[s[items[k] + layout.record]];
    }

    // Length of path k (m), and its moment arm: what 1 N does as coordinate c moves, and what must move with it.
    over(k, c, q) {
      const { s, w, y, f, kernels, given } = this, n = q.length, own = this.order.indexOf(c), u = y.subarray(n);
      this.place(q);
      kernels.move_links(...given);
      const length = this.length(k, q);
      f.fill(0);
      kernels.clear_wrenches(s, w);
      kernels.pull_path(...given, this.items[k], 1);
      kernels.add_generalized_forces(s, w, f.subarray(n));
      u[own] = 1;
      if (this.bound) {
        kernels.evaluate_constraints(...given);
        kernels.project_speeds(s, w, y, f, 0, 0, Infinity);
      }
      // One that cannot move has none.
      const arm = Math.abs(u[own]) > 1e-12 ? u.reduce((sum, speed, j) => sum + f[n + j] * speed, 0) / u[own] : NaN;
      u.fill(0);
      return { length, arm };
    }
  }

  Object.assign(window.osimlite, { Mechanism, bytes, point });
})();
