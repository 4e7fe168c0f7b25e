"use strict";
// Where muscles and other paths run, how long they are and how they pull, found by osimlite's own kernels.
(() => {
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const STEP = 1e-5;

  class Routes {
    constructor(data, coordinates) {
      Object.assign(this, data);
      this.s = new Int32Array(bytes(data.structure).buffer);
      this.x = new Float64Array(bytes(data.numbers).buffer);
      this.w = new Float64Array(data.work);
      this.y = new Float64Array(2 * coordinates);
      this.f = new Float64Array(Math.max(3 * data.room, this.y.length));
      this.kernels = window.osimlite.kernels;
    }

    // Put bodies where a pose has them; a path that is asked for twice there is found once.
    pose(q, poses) {
      const { link, position } = this.layout;
      poses.slice(0, -1).forEach((m, k) => {
        for (let row = 0; row < 3; row++) {
          this.w.set(m.slice(4 * row, 4 * row + 3), link * k + 3 * row);
          this.w[link * k + position + row] = m[4 * row + 3];
        }
      });
      this.y.set(q);
    }

    // Length of path k, m.
    measure(k) {
      const { s, x, w, y, f } = this, item = this.items[k];
      this.kernels.laws[s[item + this.layout.law]](s, x, w, y, f, item);
      return w[s[item + this.layout.record]];
    }

    // Corners of path k in ground.
    corners(k) {
      this.measure(k);
      const { s, x, w, y, f } = this, found = [];
      const count = this.kernels.laws[this.traces[k]](s, x, w, y, f, this.items[k]);
      for (let n = 0; n < 3 * count; n += 3) found.push([f[n], f[n + 1], f[n + 2]]);
      return found;
    }

    // Length of path k (m), and its moment arm: what 1 N does as coordinate c moves, and with it what couplers move.
    over(k, c, mechanism, q) {
      const moved = (step) => {
        const values = q.slice();
        values[c] += step;
        return mechanism.coupled(values);
      };
      const poses = mechanism.poses(q), n = q.length, { link, wrench } = this.layout;
      this.pose(q, poses);
      const length = this.measure(k);
      poses.slice(0, -1).forEach((_, body) => this.w.fill(0, link * body + wrench, link * body + wrench + 6));
      this.f.fill(0);
      this.kernels.pull_path(this.s, this.x, this.w, this.y, this.f, this.items[k], 1);
      const up = moved(STEP), down = moved(-STEP), ahead = mechanism.poses(up), behind = mechanism.poses(down);
      let arm = 0;
      for (let j = 0; j < n; j++) arm += this.f[n + j] * (up[j] - down[j]);
      poses.slice(0, -1).forEach((m, body) => {
        const load = this.w.subarray(link * body + wrench, link * body + wrench + 6);
        if (!load.some((part) => part !== 0)) return;
        const d = m.map((_, place) => ahead[body][place] - behind[body][place]);
        // How the body turns, from the change of its rotation times its transpose; loads are about ground's origin.
        const turn = (i, j) => d[4 * i] * m[4 * j] + d[4 * i + 1] * m[4 * j + 1] + d[4 * i + 2] * m[4 * j + 2];
        const [a, b, e] = [turn(2, 1), turn(0, 2), turn(1, 0)];
        const shift = [d[3] - b * m[11] + e * m[7], d[7] - e * m[3] + a * m[11], d[11] - a * m[7] + b * m[3]];
        arm += load[0] * a + load[1] * b + load[2] * e + load[3] * shift[0] + load[4] * shift[1] + load[5] * shift[2];
      });
      return { length, arm: arm / (2 * STEP) };
    }
  }

  Object.assign(window.osimlite, { Routes, bytes });
})();
