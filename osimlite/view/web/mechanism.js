"use strict";
// Where bodies are: each is carried by another (or ground, -1) through fixed transforms and motions along or about axes.
// Matrices are arrays of 12 numbers, three rows of four, from the body's frame to ground.
(() => {
  const { law, Routes } = window.osimlite;

  const times = (a, b) => {
    const c = new Array(12);
    for (let i = 0; i < 12; i += 4) {
      for (let j = 0; j < 4; j++) c[i + j] = a[i] * b[j] + a[i + 1] * b[4 + j] + a[i + 2] * b[8 + j];
      c[i + 3] += a[i + 3];
    }
    return c;
  };
  const along = ([x, y, z], d) => [1, 0, 0, x * d, 0, 1, 0, y * d, 0, 0, 1, z * d];
  const about = ([x, y, z], angle) => {
    const s = Math.sin(angle), c = Math.cos(angle), v = 1 - c;
    return [
      c + x * x * v, x * y * v - z * s, x * z * v + y * s, 0,
      y * x * v + z * s, c + y * y * v, y * z * v - x * s, 0,
      z * x * v - y * s, z * y * v + x * s, c + z * z * v, 0];
  };
  const point = (m, [x, y, z]) => [
    m[0] * x + m[1] * y + m[2] * z + m[3],
    m[4] * x + m[5] * y + m[6] * z + m[7],
    m[8] * x + m[9] * y + m[10] * z + m[11]];

  const pick = (q, places) => places.map((place) => q[place]);

  class Mechanism {
    constructor(data) {
      this.coordinates = data.coordinates;
      this.bodies = data.bodies.map((body) => ({
        parent: body.parent,
        chain: body.chain.map((part) => Array.isArray(part) ? part : { ...part, amount: law(part.law) }),
      }));
      this.couplers = data.couplers.map((coupler) => ({ ...coupler, value: law(coupler.law) }));
      this.lines = data.lines;
      this.routes = data.routes && new Routes(data.routes, data.coordinates.length);
    }

    // Coordinate values with those of dependent coordinates made to fit; couplers may depend on each other.
    coupled(q) {
      const values = q.slice();
      for (let round = 0; round < this.couplers.length; round++) {
        let changed = false;
        for (const coupler of this.couplers) {
          const value = coupler.value(pick(values, coupler.independent));
          changed = changed || value !== values[coupler.dependent];
          values[coupler.dependent] = value;
        }
        if (!changed) break;
      }
      return values;
    }

    // Matrices of all bodies, ground's last.
    poses(q) {
      const poses = [], ground = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0];
      for (const body of this.bodies) {
        let pose = body.parent < 0 ? ground : poses[body.parent];
        for (const part of body.chain) {
          if (Array.isArray(part)) pose = times(pose, part);
          else {
            const amount = part.amount(pick(q, part.coordinates));
            pose = times(pose, part.turns ? about(part.axis, amount) : along(part.axis, amount));
          }
        }
        poses.push(pose);
      }
      poses.push(ground);
      return poses;
    }

    // Corners in ground of line number k.
    corners(k, q, poses) {
      const { route, points } = this.lines[k];
      if (points) return points.map((p) => point(poses[p.body < 0 ? poses.length - 1 : p.body], p.at));
      if (this.routed !== poses) this.routes.pose(q, poses);
      this.routed = poses;
      return this.routes.corners(route);
    }
  }

  Object.assign(window.osimlite, { Mechanism, point });
})();
