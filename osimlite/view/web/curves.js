"use strict";
// A card with the curves of the selected muscle: length and moment arm over each coordinate that it crosses.
(() => {
  const { make, $ } = window.osimlite;
  const SAMPLES = 41, FEW = [0.02, 0.27, 0.51, 0.74, 0.98], NOTHING = 1e-9;
  const WIDE = 118, HIGH = 56, LEFT = 34, GAP = 20;
  const digits = (x) => Number(x.toPrecision(3)).toString();
  const svg = (tag, attributes, ...children) => {
    const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
    element.append(...children);
    return element;
  };

  class Curves {
    constructor(viewer) {
      this.viewer = viewer;
      this.box = $("#curves");
      $("#curves button").addEventListener("click", () => this.show(null));
    }

    // Show the curves of the path that a component belongs to, or nothing.
    show(path) {
      const { lines } = this.viewer.data;
      this.line = path && lines.find((line) => line.route !== undefined && (path === line.path || path.startsWith(`${line.path}/`)));
      this.box.hidden = !this.line;
      if (this.line) this.draw();
    }

    // The pose is another one: curves are drawn anew once it stays, since they belong to its other coordinates.
    moved() {
      if (!this.line) return;
      clearTimeout(this.waiting);
      if (this.viewer.playing) this.mark();
      else this.waiting = setTimeout(() => this.draw(), 80);
    }

    at(c, value) {
      const { mechanism, q } = this.viewer, moved = q.slice();
      moved[c] = value;
      return mechanism.over(this.line.route, c, mechanism.coupled(moved));
    }

    over(c, parts) {
      const [low, high] = this.viewer.data.coordinates[c].range;
      return parts.map((part) => low + part * (high - low)).map((value) => ({ value, ...this.at(c, value) }));
    }

    draw() {
      const { coordinates } = this.viewer.data, every = [...Array(SAMPLES).keys()].map((k) => k / (SAMPLES - 1));
      const crossed = coordinates.map((_, c) => c).filter((c) =>
        !coordinates[c].still && this.over(c, FEW).some(({ arm }) => Math.abs(arm) > NOTHING));
      this.charts = crossed.map((c) => this.chart(c, this.over(c, every)));
      $("#curves div").replaceChildren(...this.charts.map(({ element }) => element));
      if (!crossed.length) $("#curves div").textContent = "This path crosses no coordinate that can move.";
      this.mark();
    }

    // Two panels over one coordinate.
    chart(c, rows) {
      const coordinate = this.viewer.data.coordinates[c], turns = coordinate.unit === "rad";
      const scale = turns ? 180 / Math.PI : 1, unit = turns ? "°" : coordinate.unit;
      const panels = [["length", "cm", 100], ["arm", turns ? "cm" : "", turns ? 100 : 1]].map(([what, of, times], k) => {
        const values = rows.map((row) => times * row[what]).filter(Number.isFinite);
        let low = Math.min(...values), high = Math.max(...values);
        if (!(high - low > 1e-6)) [low, high] = [low - 0.5, high + 0.5];
        const left = LEFT + k * (WIDE + LEFT + GAP), first = rows[0].value, last = rows[rows.length - 1].value;
        const x = (value) => left + WIDE * (value - first) / (last - first), y = (value) => 16 + HIGH * (high - value) / (high - low);
        const curve = rows.map((row) => [row.value, times * row[what]]).filter(([, value]) => Number.isFinite(value));
        const parts = [
          svg("text", { x: left, y: 10 }, `${what === "arm" ? "moment arm" : "length"}${of && `, ${of}`}`),
          svg("rect", { x: left, y: 16, width: WIDE, height: HIGH }),
          svg("text", { x: left - 4, y: 23, "text-anchor": "end" }, digits(high)),
          svg("text", { x: left - 4, y: 16 + HIGH, "text-anchor": "end" }, digits(low)),
          svg("text", { x: left, y: 28 + HIGH }, `${digits(first * scale)}${unit}`),
          svg("text", { x: left + WIDE, y: 28 + HIGH, "text-anchor": "end" }, `${digits(last * scale)}${unit}`),
          svg("polyline", { points: curve.map(([value, height]) => `${x(value).toFixed(1)},${y(height).toFixed(1)}`).join(" ") }),
        ];
        if (low < 0 && high > 0) parts.push(svg("line", { x1: left, x2: left + WIDE, y1: y(0), y2: y(0) }));
        const dot = svg("circle", { r: 3 });
        return { parts: [...parts, dot], put: (value, found) => {
          dot.setAttribute("cx", x(value));
          dot.setAttribute("cy", Math.min(Math.max(y(times * found[what]), 16), 16 + HIGH));
        } };
      });
      const drawing = svg("svg", { viewBox: `0 0 ${2 * (LEFT + WIDE) + GAP + 4} ${HIGH + 32}` }, ...panels.flatMap(({ parts }) => parts));
      const name = make("strong", { textContent: coordinate.name, title: coordinate.path });
      return { c, panels, element: make("figure", {}, name, drawing) };
    }

    // Where the pose is on the curves.
    mark() {
      const { q, data, mechanism } = this.viewer;
      for (const { c, panels } of this.charts) {
        const found = this.at(c, q[c]);
        for (const { put } of panels) put(q[c], found);
      }
      const length = mechanism.length(this.line.route, q), level = data.motion?.activations[this.line.path]?.[this.viewer.stage.row];
      const activation = level === undefined ? "" : `, activation ${(level / 255).toFixed(2)}`;
      $("#curves strong").textContent = this.line.path.split("/").pop();
      $("#curves span").textContent = `${(100 * length).toFixed(2)} cm${activation}`;
    }
  }

  Object.assign(window.osimlite, { Curves });
})();
