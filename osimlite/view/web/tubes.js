"use strict";
// Lines as tubes: muscles with fibers in the middle and thin, pale tendons at their ends, springs, sticks.
(() => {
  const T = window.THREE;
  // Corners of a ring; rings along the fibers of a muscle; rings that round off both ends.
  const ROUND = 10, FIBERS = 14, ENDS = 6;

  class Tubes {
    // lines: [place, line] each, with what `Line` of the scene says.
    constructor(lines) {
      this.lines = lines;
      this.rings = lines.map(([, line]) => ENDS + (line.points ? line.points.length : line.most) + (line.fibers ? FIBERS + 3 : 0));
      const count = this.rings.reduce((sum, n) => sum + n, 0), index = [];
      // Which line each ring belongs to, and whether it is one of fibers.
      this.owners = new Int32Array(count);
      this.fibers = new Uint8Array(count);
      let first = 0;
      lines.forEach(([place], k) => {
        this.owners.fill(place, first, first + this.rings[k]);
        for (let ring = first; ring < first + this.rings[k] - 1; ring++) {
          for (let j = 0; j < ROUND; j++) {
            const a = ring * ROUND + j, b = ring * ROUND + (j + 1) % ROUND;
            index.push(a, b, a + ROUND, b, b + ROUND, a + ROUND);
          }
        }
        first += this.rings[k];
      });
      const geometry = new T.BufferGeometry();
      for (const name of ["position", "normal", "color"]) {
        geometry.setAttribute(name, new T.BufferAttribute(new Float32Array(3 * ROUND * count), 3));
      }
      geometry.setIndex(new T.BufferAttribute(new Uint32Array(index), 1));
      this.mesh = new T.Mesh(geometry, new T.MeshStandardMaterial({ roughness: 0.6, vertexColors: true }));
      this.mesh.frustumCulled = false;
      this.mesh.userData = { tubes: this };
    }

    // The line that a triangle belongs to: rings have two triangles for each corner, but for the last of a line.
    owner(triangle) {
      let first = 0;
      for (const [k, rings] of this.rings.entries()) {
        first += 2 * ROUND * (rings - 1);
        if (triangle < first) return this.lines[k][0];
      }
      return -1;
    }

    // Put the rings where the corners of the lines are. corners(place): of a line; grown(line): how much thicker it is.
    lay(corners, grown) {
      const { position, normal } = this.mesh.geometry.attributes;
      let ring = 0;
      this.lines.forEach(([place, line], k) => {
        const stations = rounded(stationsOf(line, corners(place).map((c) => new T.Vector3(...c))), grown(line));
        const end = ring + this.rings[k];
        let along = null, across = null;
        for (let s = 0; ring < end; ring++, s++) {
          // Rings that are left over lie where the last one is.
          const here = stations[Math.min(s, stations.length - 1)];
          if (s < stations.length) {
            along = here.along;
            if (across) across.addScaledVector(along, -across.dot(along));
            if (!across || across.lengthSq() < 1e-12) across = aside(along);
            across.normalize();
          }
          const third = along.clone().cross(across);
          for (let j = 0, at = ring * ROUND; j < ROUND; j++, at++) {
            const c = Math.cos(2 * Math.PI * j / ROUND), d = Math.sin(2 * Math.PI * j / ROUND);
            const out = [0, 1, 2].map((x) => c * across.getComponent(x) + d * third.getComponent(x));
            normal.setXYZ(at, ...out);
            position.setXYZ(at, ...out.map((o, x) => here.at.getComponent(x) + here.radius * o));
          }
          this.fibers[ring] = here.fibers;
        }
      });
      position.needsUpdate = normal.needsUpdate = true;
      this.mesh.geometry.boundingSphere = this.mesh.geometry.boundingBox = null;
    }

    // Colour the rings. colors: by the place of a line, that of its fibers and that of its tendons.
    color(colors) {
      const { color } = this.mesh.geometry.attributes;
      this.owners.forEach((place, ring) => {
        const { r, g, b } = colors[place][this.fibers[ring] ? 0 : 1];
        for (let at = ring * ROUND; at < (ring + 1) * ROUND; at++) color.setXYZ(at, r, g, b);
      });
      color.needsUpdate = true;
    }

    // The colour of a line's thickest part, red, green, blue as the picture has them.
    colorOf(place) {
      const ring = this.owners.findIndex((owner, k) => owner === place && this.fibers[k]);
      return [...this.mesh.geometry.attributes.color.array.slice(3 * ROUND * ring, 3 * ROUND * ring + 3)];
    }
  }

  // Where a line has rings: the middle, the radius, whether fibers are there. Half of the tendon is at each end.
  function stationsOf(line, corners) {
    const at = [0];
    corners.slice(1).forEach((corner, k) => at.push(at[k] + corner.distanceTo(corners[k])));
    const whole = at[at.length - 1];
    if (!line.fibers || !(whole > 0)) return corners.map((corner) => ({ at: corner, radius: line.radius, fibers: 1 }));
    const first = Math.min(0.5 * line.tendon, 0.4 * whole), last = whole - first;
    const between = (x) => {
      const k = Math.max(1, at.findIndex((end) => end >= x)), span = at[k] - at[k - 1];
      return corners[k - 1].clone().lerp(corners[k], span > 0 ? (x - at[k - 1]) / span : 0);
    };
    const thick = (x) => line.radius + (line.fibers - line.radius) * Math.sin(Math.PI * (x - first) / (last - first)) ** 0.7;
    const belly = Array.from({ length: FIBERS + 1 }, (_, k) => first + (last - first) * k / FIBERS);
    const inside = at.map((x, k) => [x, corners[k]]).filter(([x]) => x > first && x < last);
    const tendon = (x, corner) => ({ at: corner, radius: line.radius, fibers: 0 });
    return [
      ...at.flatMap((x, k) => x < first ? [tendon(x, corners[k])] : []), ...(first > 0 ? [tendon(first, between(first))] : []),
      ...[...belly.map((x) => [x, between(x)]), ...inside].sort((a, b) => a[0] - b[0])
        .map(([x, corner]) => ({ at: corner, radius: Math.max(line.radius, thick(x) || 0), fibers: 1 })),
      ...(first > 0 ? [tendon(last, between(last))] : []), ...at.flatMap((x, k) => x > last ? [tendon(x, corners[k])] : []),
    ];
  }

  // The same with directions, grown, and with round ends.
  function rounded(stations, grown) {
    const count = stations.length;
    let before = new T.Vector3(0, 1, 0);
    const rings = stations.map(({ at, radius, fibers }, k) => {
      const steps = [stations[Math.min(k + 1, count - 1)].at.clone().sub(at), at.clone().sub(stations[Math.max(k - 1, 0)].at)];
      const along = new T.Vector3();
      for (const step of steps) if (step.lengthSq() > 1e-16) along.add(step.normalize());
      before = along.lengthSq() > 1e-12 ? along.normalize() : before.clone();
      return { at, radius: grown * radius, fibers, along: before };
    });
    const cap = (ring, way) => [[1, 0], [0.7, 0.7], [0.3, 0.95]].map(([out, wide]) => (
      { ...ring, at: ring.at.clone().addScaledVector(ring.along, way * out * ring.radius), radius: wide * ring.radius }));
    return [...cap(rings[0], -1), ...rings, ...cap(rings[count - 1], 1).reverse()];
  }

  // A direction at right angles to another.
  function aside(along) {
    const { x, y, z } = along, least = Math.min(Math.abs(x), Math.abs(y), Math.abs(z));
    const other = new T.Vector3(Number(Math.abs(x) === least), 0, 0);
    if (!other.x) other.setComponent(Math.abs(y) === least ? 1 : 2, 1);
    return other.cross(along);
  }

  Object.assign(window.osimlite, { Tubes });
})();
