"use strict";
// Lines as tubes: muscles with fibers in the middle and thin, pale tendons at their ends, springs, sticks.
// The kernel lay_tube has the shape, which pictures without a browser share.
(() => {
  const T = window.THREE;
  // Corners of a ring.
  const ROUND = 10;

  class Tubes {
    // lines: [place, line] each, with what `Line` of the scene says. layout: of the rings, as the kernel writes them.
    constructor(lines, layout) {
      this.lines = lines;
      this.layout = layout;
      this.rings = lines.map(([, line]) => layout.more + (line.points ? line.points.length : line.most));
      this.laid = new Float64Array(layout.size * Math.max(...this.rings));
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
      const { position, normal } = this.mesh.geometry.attributes, { layout, laid } = this;
      let ring = 0;
      this.lines.forEach(([place, line], k) => {
        const all = corners(place), end = ring + this.rings[k];
        const count = window.osimlite.kernels.lay_tube(
          all.flat(), all.length, line.radius, line.fibers, line.tendon, grown(line), laid);
        // A path that cannot be traced here is a point.
        if (!count) laid.fill(0);
        for (let s = 0; ring < end; ring++, s++) {
          // Rings that are left over lie where the last one is.
          const here = laid.subarray(layout.size * Math.max(0, Math.min(s, count - 1)));
          const [center, along, across] = ["center", "along", "across"].map((name) => new T.Vector3().fromArray(here, layout[name]));
          const third = along.cross(across), radius = here[layout.radius];
          for (let j = 0, at = ring * ROUND; j < ROUND; j++, at++) {
            const c = Math.cos(2 * Math.PI * j / ROUND), d = Math.sin(2 * Math.PI * j / ROUND);
            const x = c * across.x + d * third.x, y = c * across.y + d * third.y, z = c * across.z + d * third.z;
            normal.setXYZ(at, x, y, z);
            position.setXYZ(at, center.x + radius * x, center.y + radius * y, center.z + radius * z);
          }
          this.fibers[ring] = here[layout.fibers];
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

  Object.assign(window.osimlite, { Tubes });
})();
