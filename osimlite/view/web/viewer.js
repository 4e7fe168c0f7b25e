"use strict";
// The page as a whole: what is selected, which pose is shown, and the motion that plays.
(() => {
  const { Curves, Mechanism, Stage, Tree, Sliders, showProperties, showFindings, showNotes, make, $, bytes } = window.osimlite;

  // Distance below which pins cover each other, pixels.
  const PIN = 14;
  const VIEWS = ["home", "front", "side", "top"];

  class Viewer {
    constructor(data) {
      this.data = data;
      this.unpack();
      this.mechanism = new Mechanism(data);
      this.stage = new Stage($("#canvas"), data, this.mechanism);
      this.tree = new Tree(this);
      this.sliders = new Sliders(this);
      this.curves = new Curves(this);
      this.title();
      this.layers();
      this.labels();
      showFindings(this);
      showNotes(this);
      this.player();
      this.mouse();
      this.keys();
      this.menus();
      this.stage.onDraw = () => this.placeLabels();
      new ResizeObserver(() => this.resize()).observe($("main"));
      this.resize();
      this.time = 0;
      if (data.motion) this.setTime(data.motion.times[0]); else this.show(data.q);
      this.stage.look(data.directions.home);
      if (data.story) this.story(data.story);
    }

    unpack() {
      const motion = this.data.motion;
      if (!motion) return;
      motion.times = new Float64Array(bytes(motion.times).buffer);
      motion.values = new Float64Array(bytes(motion.values).buffer);
      for (const path in motion.activations) motion.activations[path] = bytes(motion.activations[path]);
      if (motion.measured) motion.measured.places = new Float32Array(bytes(motion.measured.places).buffer);
      motion.largest = 0;
      for (const force of motion.forces) {
        force.values = new Float32Array(bytes(force.values).buffer);
        for (let k = 0; k < force.values.length; k += 6) {
          motion.largest = Math.max(motion.largest, Math.hypot(force.values[k], force.values[k + 1], force.values[k + 2]));
        }
      }
    }

    resize() {
      const player = $("#player");
      this.stage.covered = player.hidden ? 0 : player.offsetHeight + 12;
      this.stage.coveredAbove = $("#tools").offsetTop + $("#tools").offsetHeight;
      this.stage.resize();
    }

    title() {
      $("h1").textContent = this.data.name || "a model";
      $("#facts").textContent = this.data.facts;
      const { constraints } = this.data;
      if (constraints.length && !this.data.server) {
        $("#notice").hidden = false;
        $("#notice").textContent = `Sliders on this page do not enforce ${constraints.map((path) => path.split("/").pop()).join(", ")}; those of 'osimlite view' without --html do.`;
      }
    }

    // Show the text about the motion and the links to the other pages, and play the motion.
    story({ words, command, page, pages }) {
      $("#story nav").append(...pages.map(([title, file]) => {
        const link = make("a", { textContent: title, href: file });
        if (file === page) link.setAttribute("aria-current", "page");
        return link;
      }));
      $("#story p").textContent = words;
      // Lines break between words, and not at the hyphens of an option.
      $("#story code").append(...command.split(" ").flatMap((word) => [make("span", { textContent: word }), " "]));
      $("#story").hidden = false;
      document.body.className = "told";
      if (!matchMedia("(prefers-reduced-motion: reduce)").matches) this.play();
    }

    // ------------------------------------------------------------------------------------------------ poses
    show(q, row = -1) {
      this.q = this.mechanism.coupled(Array.from(q));
      this.stage.pose(this.q, row);
      this.sliders.show(this.q);
      this.curves.moved();
    }

    setCoordinate(k, value) {
      const place = typeof k === "number" ? k : this.data.coordinates.findIndex((c) => c.path === k || c.name === k);
      if (place < 0) throw new Error(`there is no coordinate ${k}`);
      this.pause();
      const q = this.q.slice();
      q[place] = value;
      this.show(q);
      if (this.data.server && this.data.constraints.length) this.assemble();
    }

    // Ask the server for the nearest pose that fulfils the constraints, one request at a time.
    async assemble() {
      if (this.asking) { this.askAgain = true; return; }
      this.asking = true;
      try {
        const answer = await fetch("assemble", { method: "POST", body: JSON.stringify({ values: this.q }) });
        const found = await answer.json();
        $("#notice").hidden = !found.error;
        $("#notice").textContent = found.error || "";
        if (found.values && !this.askAgain) this.show(found.values);
      } catch {
        $("#notice").hidden = false;
        $("#notice").textContent = "The program that serves this page has ended.";
      }
      this.asking = false;
      if (this.askAgain) { this.askAgain = false; this.assemble(); }
    }

    reset() {
      this.pause();
      if (this.data.motion) this.setTime(this.data.motion.times[0]); else this.show(this.data.q);
    }

    // ----------------------------------------------------------------------------------------------- motion
    setTime(time) {
      const { times, values } = this.data.motion, last = times.length - 1, n = this.data.coordinates.length;
      this.time = Math.min(Math.max(time, times[0]), times[last]);
      let low = 0, high = last;
      while (high - low > 1) {
        const middle = (low + high) >> 1;
        if (times[middle] <= this.time) low = middle; else high = middle;
      }
      const span = times[high] - times[low], part = span > 0 ? (this.time - times[low]) / span : 0;
      const q = new Array(n);
      for (let k = 0; k < n; k++) q[k] = values[low * n + k] + part * (values[high * n + k] - values[low * n + k]);
      this.show(q, part < 0.5 ? low : high);
      if ($("#follow").checked) this.stage.follow(this.stage.middle());
      $("#scrub").value = this.time;
      $("#clock").textContent = `${this.time.toFixed(3)} s`;
    }

    player() {
      const motion = this.data.motion;
      if (!motion) return;
      const last = motion.times[motion.times.length - 1];
      $("#player").hidden = false;
      Object.assign($("#scrub"), { min: motion.times[0], max: last });
      $("#scrub").addEventListener("input", (event) => { this.pause(); this.setTime(Number(event.target.value)); });
      $("#play").addEventListener("click", () => this.playing ? this.pause() : this.play());
      $("#follow").checked = motion.travels;
      $("#follow").addEventListener("change", () => { this.stage.followed = null; });
    }

    // Space plays and pauses, arrows step through the moments, and 1 to 4 choose a view.
    keys() {
      document.addEventListener("keydown", (event) => {
        if (event.ctrlKey || event.altKey || event.metaKey || !(event.target instanceof Element)) return;
        // Text fields, sliders and the tree have these keys themselves.
        if (event.target.matches("input:not([type=checkbox]), select, textarea, #tree, #tree *")) return;
        const look = VIEWS[Number(event.key) - 1], motion = this.data.motion;
        if (look) this.stage.look(this.data.directions[look]);
        else if (motion && event.key === " " && !event.target.matches("button, summary, input")) {
          event.preventDefault();
          this.playing ? this.pause() : this.play();
        } else if (motion && (event.key === "ArrowLeft" || event.key === "ArrowRight")) {
          event.preventDefault();
          this.pause();
          this.step(event.key === "ArrowRight" ? 1 : -1);
        }
      });
    }

    // Go to the next or the previous recorded moment.
    step(way) {
      const { times } = this.data.motion, near = 1e-9 * (times[times.length - 1] - times[0]);
      const next = way > 0 ? times.find((time) => time > this.time + near) : times.findLast((time) => time < this.time - near);
      if (next !== undefined) this.setTime(next);
    }

    // A menu closes when another place is clicked, or by Escape.
    menus() {
      const close = (inside) => {
        for (const menu of document.querySelectorAll("details[open]")) {
          if (menu.matches("#layers") && !menu.contains(inside)) menu.open = false;
        }
      };
      document.addEventListener("pointerdown", (event) => close(event.target));
      document.addEventListener("keydown", (event) => { if (event.key === "Escape") close(null); });
    }

    play() {
      const motion = this.data.motion, first = motion.times[0], last = motion.times[motion.times.length - 1];
      if (this.playing) return;
      this.playing = true;
      $("#play").textContent = "❚❚";
      $("#play").setAttribute("aria-label", "Pause");
      if (this.time >= last) this.setTime(first);
      let before = performance.now();
      const step = (now) => {
        if (!this.playing) return;
        let time = this.time + Math.max(0, now - before) / 1000 * Number($("#speed").value);
        before = now;
        if (time >= last) {
          if ($("#loop").checked && last > first) time = first + (time - last) % (last - first);
          else { this.setTime(last); this.pause(); return; }
        }
        this.setTime(time);
        requestAnimationFrame(step);
      };
      requestAnimationFrame(step);
    }

    pause() {
      this.playing = false;
      $("#play").textContent = "▶";
      $("#play").setAttribute("aria-label", "Play");
      this.curves.moved();
    }

    // -------------------------------------------------------------------------------------------- selection
    select(path) {
      this.selected = path;
      this.stage.select(path);
      this.tree.reveal(path);
      showProperties(this, path);
      this.curves.show(path);
    }

    mouse() {
      const canvas = $("#canvas"), hover = $("#hover");
      let down = null;
      canvas.addEventListener("pointerdown", (event) => { down = [event.clientX, event.clientY]; });
      canvas.addEventListener("pointerup", (event) => {
        if (!down || Math.hypot(event.clientX - down[0], event.clientY - down[1]) > 4) return;
        const path = this.stage.pick(event.clientX, event.clientY);
        if (path) this.select(path);
      });
      let waiting = false;
      canvas.addEventListener("pointermove", (event) => {
        if (event.buttons || this.playing || waiting) { if (event.buttons) hover.style.display = "none"; return; }
        waiting = true;
        setTimeout(() => {
          waiting = false;
          const path = this.stage.pick(event.clientX, event.clientY), box = canvas.getBoundingClientRect();
          hover.style.display = path ? "block" : "none";
          hover.replaceChildren(...this.said(path || ""));
          hover.style.left = `${event.clientX - box.left + 14}px`;
          hover.style.top = `${event.clientY - box.top + 12}px`;
        }, 60);
      });
      canvas.addEventListener("pointerleave", () => { hover.style.display = "none"; });
      for (const button of document.querySelectorAll("[data-look]")) {
        button.addEventListener("click", () => this.stage.look(this.data.directions[button.dataset.look]));
      }
    }

    // What is said of a component under the pointer: its name, its class, and its values with units.
    said(path) {
      const node = this.data.tree.find((item) => item.path === path);
      if (!node) return [path];
      const values = this.measured(path).map((words) => make("div", { textContent: words }));
      return [make("strong", { textContent: node.name }), node.kind, ...values];
    }

    // Present values of a component, with their units.
    measured(path) {
      const words = [], motion = this.data.motion, row = this.stage.row;
      const line = this.data.lines.find((item) => item.path === path && item.route != null);
      // A shape may hang on a frame, so its body is that which carries it in the scene.
      const carrier = this.stage.shapes.find((mesh) => mesh.userData.path === path && mesh.userData.layer !== "contact")?.parent.name;
      const body = this.data.tree.find((item) => item.kind === "Body" && (item.path === path || item.path === carrier));
      const tags = body?.tags || this.data.tags.Body || [];
      if (body && tags.includes("mass")) words.push(`${body.path === path ? "" : `${body.name}: `}mass ${body.values[tags.indexOf("mass")]} kg`);
      if (line) words.push(`length ${this.mechanism.length(line.route, this.q).toFixed(4)} m`);
      const level = motion?.activations[path]?.[row];
      if (level !== undefined) words.push(`activation ${(level / 255).toFixed(2)}`);
      for (const force of row >= 0 && motion ? motion.forces : []) {
        const [x, y, z] = force.values.subarray(6 * row, 6 * row + 3), size = Math.hypot(x, y, z);
        if (force.path === path && size > 0) words.push(`force ${size.toPrecision(4)} N`);
      }
      return words;
    }

    layers() {
      const words = { geometry: "bodies", contact: "contact surfaces", wrap: "wrap surfaces", markers: "markers", paths: "muscles and other paths",
        springs: "springs between points", frames: "frames", forces: "contact forces", ground: "ground and gravity" };
      const toggle = (word, on, change) => {
        const box = make("input", { type: "checkbox", checked: on });
        box.addEventListener("change", () => change(box.checked));
        return make("label", {}, box, ` ${word}`);
      };
      $("#layers div").append(
        ...Object.entries(words).map(([layer, word]) => toggle(word, this.stage.layers[layer].visible, (on) => this.stage.show(layer, on))),
        toggle("names of bodies", this.data.labelled, (on) => { this.data.labelled = on; this.placeLabels(); }),
        toggle("findings", true, (on) => { this.unpinned = !on; this.stage.showMarks(on); this.placeLabels(); }));
    }

    // ---------------------------------------------------------------------------------- words in the picture
    labels() {
      const overlay = $("#overlay");
      this.named = this.data.bodies.map((body, k) => [make("span", { textContent: body.name }), k, body.center]);
      const order = ["error", "warning", "info"];
      // Of pins that cover each other the worst is shown.
      const pins = [...this.data.pins].sort((one, other) => order.indexOf(one.severity) - order.indexOf(other.severity));
      this.pins = pins.map((pin) => {
        const span = make("span", { className: `pin ${pin.severity}` }), said = `${pin.codes} ${pin.path}`;
        span.addEventListener("click", () => this.select(pin.path));
        return { span, said, body: pin.body, at: pin.at };
      });
      this.weight = make("span", { className: "gravity", textContent: `gravity ${Math.hypot(...this.data.gravity).toFixed(2)} m/s²` });
      overlay.append(...this.named.map(([span]) => span), ...this.pins.map(({ span }) => span), this.weight);
    }

    placeLabels() {
      const put = (span, on, place) => {
        const inside = on && place && place[0] > 0 && place[0] < $("#overlay").clientWidth;
        span.style.display = inside ? "" : "none";
        if (!inside) return;
        // Words at the edge stay whole; how long they are does not change.
        const half = (span.halfWidth ||= span.offsetWidth / 2) + 2;
        const left = Math.max(half, Math.min(place[0], $("#overlay").clientWidth - half));
        Object.assign(span.style, { left: `${left}px`, top: `${place[1]}px` });
      };
      for (const [span, body, at] of this.named) put(span, this.data.labelled, this.stage.onPage(body, at));
      const heaps = [];
      for (const pin of this.pins) {
        const place = this.stage.onPage(pin.body, pin.at);
        const heap = place && heaps.find((other) => Math.hypot(other.place[0] - place[0], other.place[1] - place[1]) < PIN);
        if (heap) heap.pins.push(pin); else if (place) heaps.push({ place, pins: [pin] });
        pin.span.style.display = "none";
      }
      for (const { place, pins } of heaps) {
        const { span } = pins[0];
        span.textContent = pins.length > 1 ? pins.length : "!";
        span.title = pins.map(({ said }) => said).join("\n");
        put(span, !this.unpinned, place);
      }
      const arrow = this.stage.gravity;
      const above = arrow && arrow.position.clone().addScaledVector(this.stage.up, 0.09 * this.data.size);
      put(this.weight, arrow && this.stage.layers.ground.visible, arrow && this.stage.onPage(-1, above.toArray()));
    }

    // ------------------------------------------------------------------------- for programs that read the page
    get coordinates() { return Object.fromEntries(this.data.coordinates.map((c, k) => [c.path, this.q[k]])); }

    // The matrix from a body's frame to ground, three rows of four, as the scene graph has it.
    bodyMatrix(path) {
      const group = this.stage.bodies.find((body) => body.name === path);
      group.updateMatrixWorld(true);
      const e = group.matrixWorld.elements;
      return [e[0], e[4], e[8], e[12], e[1], e[5], e[9], e[13], e[2], e[6], e[10], e[14]];
    }

    // Corners in ground of the lines of a component.
    lineCorners(path) {
      return this.data.lines.flatMap((line, k) => line.path === path ? [this.mechanism.corners(k, this.q, this.stage.poses)] : []);
    }

    get arrows() {
      return this.stage.arrows.filter((arrow) => arrow.visible).map((arrow) => ({ path: arrow.name, at: arrow.position.toArray() }));
    }
  }

  const failed = (words) => document.body.replaceChildren(make("p", { textContent: words, style: "padding: 2em" }));
  try {
    const viewer = new Viewer(JSON.parse($("#data").textContent));
    window.osimlite.viewer = viewer;
    window.osimlite.ready = true;
  } catch (error) {
    if (/WebGL/.test(error.message)) failed("This browser cannot draw in three dimensions (WebGL is off). 'osimlite view --screenshot' needs no browser.");
    else { failed(`The page could not be shown: ${error.message}`); throw error; }
  }
})();
