"use strict";
// The three-dimensional picture: surfaces on bodies, lines, frames, arrows, ground, light, camera.
(() => {
  const { bytes, point, Tubes } = window.osimlite;
  const T = window.THREE;
  const FORCE = 0xd55e00, MEASURED = 0x009e73, TOUCHING = 0xf7b538, SELECTED = 0x1f6feb, CHOSEN = 0x00a86b, MARKS = { error: 0xd1242f, warning: 0xd98e00, info: 0x57606a };

  const floats = (text) => new Float32Array(bytes(text).buffer);
  const toned = ([r, g, b]) => new T.Color().setRGB(r, g, b, T.SRGBColorSpace);
  const matrix4 = (m, target = new T.Matrix4()) =>
    target.set(m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8], m[9], m[10], m[11], 0, 0, 0, 1);
  const vector = (v) => new T.Vector3(v[0], v[1], v[2]);

  class Stage {
    constructor(canvas, data, mechanism) {
      this.data = data;
      this.mechanism = mechanism;
      this.canvas = canvas;
      this.renderer = new T.WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
      this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
      this.scene = new T.Scene();
      this.scene.background = new T.Color(0xe4e9f0);
      this.up = vector(data.up);
      this.camera = new T.PerspectiveCamera(32, 1, 0.001, 1000);
      this.camera.up.copy(this.up);
      this.controls = new T.OrbitControls(this.camera, canvas);
      this.controls.addEventListener("change", () => this.wanted());
      this.glows = {};
      this.layers = {};
      for (const name of [...data.layers, "forces", "ground"]) {
        this.layers[name] = new T.Group();
        this.layers[name].name = name;
        this.layers[name].visible = name === "forces" || name === "ground" || data.shown.includes(name);
        const items = data.items.filter((item) => item.layer === name);
        if (name === "wrap" && items.length && !items.some((item) => item.visible)) this.layers[name].visible = false;
      }
      this.marks = {};
      for (const finding of data.findings) {
        const worst = this.marks[finding.component];
        const order = ["error", "warning", "info"];
        if (!worst || order.indexOf(finding.severity) < order.indexOf(worst)) {
          this.marks[finding.component] = finding.severity;
        }
      }
      this.light();
      this.build();
      this.ground();
      this.scene.add(this.layers.ground, this.layers.forces, this.layers.paths, this.layers.springs);
    }

    light() {
      const key = new T.DirectionalLight(0xffffff, 1.75), fill = new T.DirectionalLight(0xdfe8ff, 0.45);
      key.position.set(-2, 3, 3);
      fill.position.set(3, 0.5, 2);
      this.lamps = new T.Group();
      this.lamps.add(key, fill);
      const sky = new T.HemisphereLight(0xffffff, 0x9a948c, 1.0);
      sky.position.copy(this.up);
      this.scene.add(this.lamps, sky);
    }

    build() {
      const data = this.data;
      const geometries = data.surfaces.map((surface) => {
        const geometry = new T.BufferGeometry();
        geometry.setAttribute("position", new T.BufferAttribute(floats(surface.points), 3));
        geometry.setAttribute("normal", new T.BufferAttribute(new Int8Array(bytes(surface.normals).buffer), 3, true));
        geometry.setIndex(new T.BufferAttribute(new Uint32Array(bytes(surface.triangles).buffer), 1));
        return geometry;
      });
      // One group per body and layer, so that a pose is one matrix per group.
      this.bodies = [...data.bodies.map((body) => body.path), "/ground"].map((path) => {
        const group = new T.Group();
        group.name = path;
        group.matrixAutoUpdate = false;
        this.scene.add(group);
        return group;
      });
      this.shapes = [];
      this.layered = {};
      for (const item of data.items) {
        const material = new T.MeshStandardMaterial({
          color: toned(item.color), roughness: 0.72, metalness: 0, side: T.DoubleSide,
          transparent: item.opacity < 1, opacity: item.opacity, depthWrite: item.opacity >= 1,
        });
        const mesh = new T.Mesh(geometries[item.surface], material);
        mesh.name = item.path;
        mesh.userData = item;
        mesh.matrixAutoUpdate = false;
        matrix4(item.matrix, mesh.matrix);
        if (item.scenery) mesh.renderOrder = -2;
        this.bodyGroup(item.body).add(mesh);
        this.shapes.push(mesh);
        (this.layered[item.layer] ||= []).push(mesh);
        mesh.visible = item.visible && this.layers[item.layer].visible;
      }
      this.frames();
      this.tubes("paths");
      this.tubes("springs");
      this.tubes("geometry");
      this.pushes();
      this.seen();
      this.paint();
    }

    bodyGroup(body) { return this.bodies[body < 0 ? this.bodies.length - 1 : body]; }

    frames() {
      const colors = [0xcc3333, 0x2e8b57, 0x3366cc];
      this.layered.frames = [];
      for (const frame of this.data.axes) {
        colors.forEach((color, axis) => {
          const m = frame.matrix;
          const from = [m[3], m[7], m[11]], step = [m[axis], m[4 + axis], m[8 + axis]];
          const geometry = new T.BufferGeometry().setFromPoints(
            [vector(from), vector(from.map((x, k) => x + frame.length * step[k]))]);
          const line = new T.Line(geometry, new T.LineBasicMaterial({ color }));
          line.name = frame.path;
          line.userData = { path: frame.path, layer: "frames", visible: true };
          line.visible = this.layers.frames.visible;
          this.bodyGroup(frame.body).add(line);
          this.layered.frames.push(line);
        });
      }
    }

    // All lines of a layer as one surface.
    tubes(layer) {
      const lines = [...this.data.lines.entries()].filter(([, line]) => line.layer === layer && line.visible);
      if (!lines.length) return;
      const tubes = new Tubes(lines, this.mechanism.tubes);
      this.layers[layer].add(tubes.mesh);
      if (layer === "geometry") this.scene.add(this.layers.geometry);
      (this.tubed ||= []).push(tubes);
    }

    // Markers as they were measured, each with a line to the one of the model that goes with it.
    seen() {
      const given = this.data.motion?.measured, layer = this.layers.markers;
      if (!given) return;
      const material = new T.MeshStandardMaterial({ color: MEASURED, roughness: 0.4 });
      const thin = new T.LineBasicMaterial({ color: MEASURED });
      layer.visible = true;
      this.scene.add(layer);
      this.measured = given.markers.map((marker) => {
        const gem = new T.Group();
        for (const way of [1, -1]) gem.add(new T.Mesh(new T.ConeGeometry(1, way, 8).translate(0, 0.5 * way, 0), material));
        gem.scale.setScalar(0.008 * this.data.size);
        const ends = new T.BufferAttribute(new Float32Array(6), 3);
        const line = new T.Line(new T.BufferGeometry().setAttribute("position", ends), thin);
        line.frustumCulled = false;
        layer.add(gem, line);
        return { marker, gem, line, ends };
      });
    }

    meet(row) {
      (this.measured || []).forEach(({ marker, gem, line, ends }, k) => {
        const first = 3 * (row * this.measured.length + k), place = row < 0 ? [NaN] : this.data.motion.measured.places.subarray(first, first + 3);
        gem.visible = line.visible = !Number.isNaN(place[0]);
        if (!gem.visible) return;
        gem.position.set(...place);
        const own = point(this.poses[marker.body < 0 ? this.poses.length - 1 : marker.body], marker.at);
        ends.array.set([...place, own[0], own[1], own[2]]);
        ends.needsUpdate = true;
      });
    }

    pushes() {
      const motion = this.data.motion;
      this.arrows = (motion ? motion.forces : []).map((force) => {
        const group = new T.Group();
        group.name = force.path;
        group.userData = force;
        const material = new T.MeshStandardMaterial({ color: FORCE, roughness: 0.5, depthTest: false, transparent: true });
        const shaft = new T.Mesh(new T.CylinderGeometry(1, 1, 1, 14).translate(0, 0.5, 0), material);
        const head = new T.Mesh(new T.ConeGeometry(1, 1, 18).translate(0, 0.5, 0), material);
        // Seen through whatever stands before it: forces act inside of what they act on.
        shaft.renderOrder = head.renderOrder = 10;
        group.add(shaft, head);
        this.layers.forces.add(group);
        return group;
      });
    }

    ground() {
      const { size, floor, gravity, motion } = this.data;
      const step = size > 4 ? 10 ** Math.ceil(Math.log10(size / 8)) : size > 1 ? 0.5 : size > 0.3 ? 0.1 : 0.02;
      const count = Math.ceil((3 * Math.max(size, step) + (motion?.way || 0)) / step), end = count * step, ends = [];
      // In pieces: what draws in software leaves out a line that goes on behind the camera.
      for (let x = -count; x <= count; x++) {
        for (let from = -24; from < 24; from++) {
          for (const to of [from, from + 1]) ends.push(vector([x * step, 0, to * end / 24]));
          for (const to of [from, from + 1]) ends.push(vector([to * end / 24, 0, x * step]));
        }
      }
      const grid = new T.GridHelper();
      grid.geometry = new T.BufferGeometry().setFromPoints(ends);
      grid.material = new T.LineBasicMaterial({ color: 0xa9b5c3, depthTest: false, depthWrite: false });
      grid.matrixAutoUpdate = false;
      matrix4(floor.matrix, grid.matrix);
      grid.userData = { visible: true };
      // Drawn between scenery and all else: what is drawn of the ground may be higher than where it pushes.
      grid.renderOrder = -1;
      this.bodyGroup(floor.body).add(grid);
      this.layered.ground = [grid];
      const axes = [0xcc3333, 0x2e8b57, 0x3366cc].map((color, axis) => {
        const end = new T.Vector3().setComponent(axis, 0.15 * size);
        return new T.Line(
          new T.BufferGeometry().setFromPoints([new T.Vector3(), end]), new T.LineBasicMaterial({ color }));
      });
      this.layers.ground.add(...axes);
      const strength = Math.hypot(...gravity);
      if (strength > 0) {
        const arrow = new T.Group(), material = new T.MeshStandardMaterial({ color: 0x9aa5b1 });
        const length = 0.16 * size;
        const shaft = new T.Mesh(new T.CylinderGeometry(0.0035 * size, 0.0035 * size, length, 12), material);
        const head = new T.Mesh(new T.ConeGeometry(0.012 * size, 0.04 * size, 16), material);
        head.position.y = 0.5 * length;
        arrow.add(shaft, head);
        arrow.quaternion.setFromUnitVectors(new T.Vector3(0, 1, 0), vector(gravity).normalize());
        arrow.name = "gravity";
        this.gravity = arrow;
        this.layers.ground.add(arrow);
      }
    }

    // Show a pose: coordinate values, and the moment of the motion whose forces are shown, or -1.
    pose(q, row = -1) {
      this.q = q;
      const poses = this.poses = this.mechanism.poses(q);
      this.bodies.forEach((group, k) => {
        matrix4(poses[k], group.matrix);
        group.matrixWorldNeedsUpdate = true;
      });
      this.row = row;
      (this.tubed || []).forEach((tubes) => this.lay(tubes));
      this.push(row);
      this.meet(row);
      this.wanted();
    }

    lay(tubes) {
      tubes.lay((place) => this.mechanism.corners(place, this.q, this.poses), (line) => this.glow(line.path)[0] === SELECTED ? 1.4 : 1);
      this.color(tubes);
    }

    // Colour lines: what is selected, what something was found at, muscles by their activation, as OpenSim does.
    color(tubes) {
      const tendon = toned(this.mechanism.tubes.tendon);
      tubes.color(Object.fromEntries(tubes.lines.map(([place, line]) => {
        const [glow, strength] = this.glow(line.path), levels = this.data.motion?.activations[line.path];
        if (glow === SELECTED) return [place, [new T.Color(CHOSEN), tendon]];
        // Blue is what rests.
        if (levels && this.row >= 0) return [place, [toned([levels[this.row] / 255, 0, 1 - levels[this.row] / 255]), tendon]];
        return [place, [strength ? new T.Color(glow) : toned(line.color), strength ? new T.Color(glow) : tendon]];
      })));
    }

    push(row) {
      const motion = this.data.motion, up = new T.Vector3(0, 1, 0);
      const loaded = new Set();
      for (const arrow of this.arrows) {
        const record = arrow.userData, six = row < 0 ? null : record.values.subarray(6 * row, 6 * row + 6);
        const force = six ? vector(six) : new T.Vector3(), size = force.length();
        arrow.visible = size > 0.005 * motion.largest;
        if (size > 0) loaded.add(record.surface);
        if (!arrow.visible) continue;
        const pose = this.poses[record.body < 0 ? this.poses.length - 1 : record.body];
        // A force F with the moment M about the body's origin acts along the line through F x M / F².
        const on = force.clone().cross(vector(six.subarray(3))).divideScalar(size * size);
        on.add(new T.Vector3(pose[3], pose[7], pose[11]));
        const near = vector(point(pose, record.near));
        arrow.position.copy(on).addScaledVector(force, near.sub(on).dot(force) / (size * size));
        arrow.quaternion.setFromUnitVectors(up, force.divideScalar(size));
        const length = 0.5 * this.data.size * size / motion.largest, thick = Math.min(0.009 * this.data.size, 0.12 * length);
        const head = Math.min(length, 5 * thick);
        arrow.children[0].scale.set(thick, Math.max(length - head, 1e-6), thick);
        arrow.children[1].position.y = length - head;
        arrow.children[1].scale.set(2.4 * thick, head, 2.4 * thick);
      }
      for (const mesh of this.layered.contact || []) {
        const is = loaded.has(mesh.userData.path);
        if (is !== mesh.userData.loaded) mesh.material.color.copy(is ? new T.Color(TOUCHING) : toned(mesh.userData.color));
        mesh.userData.loaded = is;
      }
    }

    // How something glows: what is selected, and what the validator found something at.
    glow(path) {
      return this.glows[path] ||= this.glowOf(path);
    }

    glowOf(path) {
      const within = (above) => path === above || (above !== "/" && path.startsWith(above + "/"));
      if (this.selected && within(this.selected)) return [SELECTED, 0.55];
      let worst = null;
      for (const [component, severity] of this.hideMarks ? [] : Object.entries(this.marks)) {
        if (component && within(component) && (worst === null || severity === "error")) worst = severity;
      }
      return worst && worst !== "info" ? [MARKS[worst], 0.4] : [0, 0];
    }

    paint() {
      this.glows = {};
      for (const mesh of this.shapes) {
        const [color, strength] = this.glow(mesh.userData.path);
        mesh.material.emissive.setHex(color);
        mesh.material.emissiveIntensity = strength;
      }
      (this.tubed || []).forEach((tubes) => this.color(tubes));
      this.wanted();
    }

    select(path) {
      this.selected = path;
      this.paint();
      (this.tubed || []).forEach((tubes) => this.lay(tubes));
      this.showWraps();
    }

    showMarks(on) { this.hideMarks = !on; this.paint(); }

    show(layer, on) {
      this.layers[layer].visible = on;
      for (const object of this.layered[layer] || []) object.visible = on && object.userData.visible;
      // Models that hide each of their wrap surfaces would have nothing to show: whoever asks for them gets them all.
      if (layer === "wrap") this.allWraps = true;
      this.showWraps();
      this.wanted();
    }

    // What the selected path bends around is shown with it.
    showWraps() {
      const own = new Set(this.data.lines.filter((line) => line.path === this.selected).flatMap((line) => line.wraps || []));
      const on = this.layers.wrap.visible;
      for (const mesh of this.layered.wrap || []) {
        mesh.visible = own.has(mesh.userData.path) || (on && (this.allWraps || mesh.userData.visible));
      }
    }

    // Look at the model from a direction, all of it in sight.
    look(direction) {
      const { center, size } = this.data;
      const middle = vector(center), back = vector(direction).normalize();
      if (this.followed) middle.add(this.followed).sub(vector(this.data.motion.middle));
      const tall = Math.min(this.free ?? 1, this.camera.aspect) * Math.tan(0.5 * this.camera.fov * Math.PI / 180);
      this.controls.target.copy(middle);
      this.camera.position.copy(middle).addScaledVector(back, 0.56 * size / tall);
      this.camera.near = 0.005 * size;
      this.camera.far = 200 * size;
      this.camera.updateProjectionMatrix();
      if (this.gravity) {
        const side = new T.Vector3().crossVectors(this.up, back);
        if (side.lengthSq() < 1e-9) side.set(1, 0, 0);
        this.gravity.position.copy(middle).addScaledVector(side.normalize(), -0.45 * size).addScaledVector(this.up, (0.3 - 0.5 * (this.lowered || 0)) * size);
      }
      this.controls.update();
      this.wanted();
    }

    // Move the camera along with a point.
    follow(target) {
      const step = target.clone().sub(this.followed || target);
      this.followed = target.clone();
      this.camera.position.add(step);
      this.controls.target.add(step);
      this.gravity?.position.add(step);
    }

    // The middle of the bodies that move.
    middle() {
      const sum = new T.Vector3(), { moves } = this.data.motion;
      moves.forEach((body) => sum.add(new T.Vector3(this.poses[body][3], this.poses[body][7], this.poses[body][11])));
      return sum.divideScalar(moves.length);
    }

    // The component under a point of the page, or null.
    pick(x, y) {
      const box = this.canvas.getBoundingClientRect(), ray = new T.Raycaster();
      ray.params.Line.threshold = 0.004 * this.data.size;
      const at = new T.Vector2(2 * (x - box.left) / box.width - 1, 1 - 2 * (y - box.top) / box.height);
      ray.setFromCamera(at, this.camera);
      const lines = (this.tubed || []).map((tubes) => tubes.mesh).filter((mesh) => mesh.parent.visible);
      // Arrows are drawn over all else, and so they are found before it.
      const arrows = this.layers.forces.visible ? this.arrows.filter((arrow) => arrow.visible) : [];
      const arrow = ray.intersectObjects(arrows, true)[0]?.object.parent;
      if (arrow) return arrow.name;
      const hits = ray.intersectObjects([...this.shapes.filter((mesh) => mesh.visible), ...lines], false);
      // What shines through gives way to what is behind it.
      const hit = hits.find((h) => !(h.object.material.opacity < 0.45)) || hits[0];
      if (!hit) return null;
      const { tubes, path } = hit.object.userData;
      return tubes ? this.data.lines[tubes.owner(hit.faceIndex)].path : path;
    }

    // Where a point of a body is on the page, or null behind the camera.
    onPage(body, at) {
      const p = vector(point(this.poses[body < 0 ? this.poses.length - 1 : body], at)).project(this.camera);
      const box = this.canvas.getBoundingClientRect();
      return p.z > 1 ? null : [0.5 * (p.x + 1) * box.width, 0.5 * (1 - p.y) * box.height];
    }

    resize() {
      const { clientWidth, clientHeight } = this.canvas.parentElement;
      this.renderer.setSize(clientWidth, clientHeight, false);
      this.camera.aspect = clientWidth / Math.max(clientHeight, 1);
      // What stands at the lower or the upper edge covers nothing of the model, which is shown between them.
      const covered = Math.min(this.covered || 0, 0.5 * clientHeight);
      const above = Math.min(this.coveredAbove || 0, 0.25 * clientHeight);
      this.camera.setViewOffset(clientWidth, clientHeight, 0, 0.5 * (covered - above), clientWidth, clientHeight);
      this.free = 1 - (covered + above) / Math.max(clientHeight, 1);
      this.lowered = covered / Math.max(clientHeight, 1);
      this.camera.updateProjectionMatrix();
      this.wanted();
    }

    // Draw soon, once.
    wanted() {
      if (this.waiting) return;
      this.waiting = true;
      requestAnimationFrame(() => {
        this.waiting = false;
        this.lamps.quaternion.copy(this.camera.quaternion);
        this.renderer.render(this.scene, this.camera);
        this.frames_drawn = (this.frames_drawn || 0) + 1;
        if (this.onDraw) this.onDraw();
      });
    }
  }

  Object.assign(window.osimlite, { Stage });
})();
