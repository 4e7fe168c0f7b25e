"use strict";
// The component tree, the properties of the selected component, findings, and the sliders.
(() => {
  const make = (tag, properties = {}, ...children) => {
    const element = Object.assign(document.createElement(tag), properties);
    element.append(...children);
    return element;
  };
  const $ = (selector) => document.querySelector(selector);
  const ROW = 21;
  // So many findings of one rule are shown beside each other; of more, the first.
  const SAME = 3;

  // The tree shows only the rows in sight: a model has thousands of components.
  class Tree {
    constructor(viewer) {
      this.viewer = viewer;
      this.nodes = viewer.data.tree;
      this.open = new Set([0]);
      this.children = this.nodes.map(() => []);
      this.nodes.forEach((node, k) => { if (node.parent >= 0) this.children[node.parent].push(k); });
      this.number = new Map(this.nodes.map((node, k) => [node.path, k]));
      this.marks = this.nodes.map(() => "");
      const order = ["info", "warning", "error"];
      for (const finding of viewer.data.findings) {
        // What is wrong below is seen on what holds it, too.
        for (let k = this.number.get(finding.component) ?? -1; k >= 0; k = this.nodes[k].parent) {
          if (order.indexOf(finding.severity) > order.indexOf(this.marks[k])) this.marks[k] = finding.severity;
        }
      }
      for (const [k, node] of this.nodes.entries()) if (/^\/(bodyset|jointset)$/.test(node.path)) this.open.add(k);
      this.box = $("#tree");
      this.space = make("div");
      this.box.append(this.space);
      this.box.addEventListener("scroll", () => this.draw());
      this.box.addEventListener("click", (event) => this.clicked(event));
      this.box.addEventListener("keydown", (event) => this.key(event));
      $("#search").addEventListener("input", (event) => { this.wanted = event.target.value.trim().toLowerCase(); this.refresh(); });
      this.refresh();
    }

    refresh() {
      const shown = this.shown = [];
      const matching = this.wanted ? new Set() : null;
      if (matching) {
        this.nodes.forEach((node, k) => {
          if (!`${node.path} ${node.kind}`.toLowerCase().includes(this.wanted)) return;
          for (let n = k; n >= 0 && !matching.has(n); n = this.nodes[n].parent) matching.add(n);
        });
      }
      const walk = (k, depth) => {
        if (matching && !matching.has(k)) return;
        shown.push([k, depth]);
        if (matching || this.open.has(k)) for (const child of this.children[k]) walk(child, depth + 1);
      };
      if (this.nodes.length) walk(0, 0);
      this.draw();
    }

    draw() {
      const first = Math.max(0, Math.floor(this.box.scrollTop / ROW) - 5);
      const count = Math.ceil((this.box.clientHeight || 800) / ROW) + 10;
      this.space.style.height = `${this.shown.length * ROW}px`;
      this.space.style.position = "relative";
      this.space.replaceChildren(...this.shown.slice(first, first + count).map(([k, depth], row) => {
        const node = this.nodes[k], inner = this.children[k].length > 0;
        const element = make("div", {
          className: `node ${this.marks[k]} ${node.path === this.viewer.selected ? "selected" : ""}`, title: node.path,
        },
          make("span", { className: "twist", textContent: inner ? (this.open.has(k) || this.wanted ? "▾" : "▸") : "" }),
          make("span", { className: "name", textContent: node.name }),
          make("span", { className: "kind", textContent: node.kind }));
        element.style.cssText = `position:absolute;left:0;right:0;top:${(first + row) * ROW}px;height:${ROW}px;padding-left:${4 + 12 * depth}px`;
        element.dataset.number = k;
        element.setAttribute("role", "treeitem");
        return element;
      }));
    }

    clicked(event) {
      const row = event.target.closest(".node");
      if (!row) return;
      const k = Number(row.dataset.number);
      if (event.target.className === "twist") this.toggle(k);
      else this.viewer.select(this.nodes[k].path);
    }

    toggle(k) {
      if (this.open.has(k)) this.open.delete(k); else this.open.add(k);
      this.refresh();
    }

    key(event) {
      const at = this.shown.findIndex(([k]) => this.nodes[k].path === this.viewer.selected);
      const k = at < 0 ? 0 : this.shown[at][0];
      if (event.key === "ArrowDown" || event.key === "ArrowUp") {
        const next = this.shown[Math.min(Math.max(at + (event.key === "ArrowDown" ? 1 : -1), 0), this.shown.length - 1)];
        this.viewer.select(this.nodes[next[0]].path);
      } else if (event.key === "ArrowRight" && !this.open.has(k)) this.toggle(k);
      else if (event.key === "ArrowLeft" && this.open.has(k)) this.toggle(k);
      else return;
      event.preventDefault();
    }

    reveal(path) {
      const k = this.number.get(path);
      if (k === undefined) return;
      for (let n = this.nodes[k].parent; n >= 0; n = this.nodes[n].parent) this.open.add(n);
      this.refresh();
      const row = this.shown.findIndex(([n]) => n === k), top = row * ROW;
      if (top < this.box.scrollTop || top > this.box.scrollTop + this.box.clientHeight - 2 * ROW) {
        this.box.scrollTop = Math.max(0, top - 0.4 * this.box.clientHeight);
      }
      this.draw();
    }
  }

  // Text whose paths may be broken behind a slash only, so that no word of them is.
  const breakable = (text) => text.split(/(?<=[^\s'"][/\\])/).flatMap((part, k) => k ? [make("wbr"), part] : [part]);

  const finding = (viewer, item) => {
    const box = make("div", { className: `finding ${item.severity}` },
      make("strong", { textContent: `${item.code} ` }), ...breakable(item.message));
    if (item.place) box.append(make("div", { className: "path", textContent: item.place }));
    box.addEventListener("click", () => viewer.select(item.component || "/"));
    return box;
  };

  const showProperties = (viewer, path) => {
    const node = viewer.data.tree[viewer.tree.number.get(path)], box = $("#details > div");
    if (!node) return;
    const tags = viewer.data.tags[node.kind] || [];
    const rows = node.values.map((value, k) => make("tr", { className: node.given.includes(k) ? "" : "default" },
      make("td", { textContent: node.tags ? node.tags[k] : tags[k] }), make("td", { textContent: value })));
    const found = viewer.data.findings.filter((item) => (item.component || "/") === path);
    const remarks = viewer.data.remarks.filter(([where]) => where === path);
    box.replaceChildren(
      make("strong", { textContent: `${node.name} ` }), make("span", { className: "hint", textContent: node.kind }),
      make("p", { className: "path", textContent: path }), ...found.map((item) => finding(viewer, item)),
      ...remarks.map(([, said]) => make("p", { className: "hint", textContent: `not drawn: ${said}` })),
      make("table", {}, ...rows));
    box.scrollTop = 0;
  };

  // What cannot be drawn, until a component is selected.
  const showNotes = (viewer) => {
    $("#details > div").append(...viewer.data.notes.map((said) => make("p", { className: "hint" }, ...breakable(said))));
  };

  const showFindings = (viewer) => {
    const found = viewer.data.findings;
    if (!found.length) return;
    $("#findings").hidden = false;
    $("#findings h2").textContent = `Findings (${found.length})`;
    const order = ["error", "warning", "info"], groups = new Map();
    for (const item of found) groups.set(item.code, [...(groups.get(item.code) || []), item]);
    const worst = ([, items]) => Math.min(...items.map((item) => order.indexOf(item.severity)));
    for (const [code, items] of [...groups].sort((one, other) => worst(one) - worst(other))) {
      const boxes = items.map((item) => finding(viewer, item)), rest = boxes.splice(items.length > SAME ? 1 : SAME);
      $("#findings > div").append(...boxes);
      // A model whose meshes are missing has the same finding a hundred times.
      if (rest.length) $("#findings > div").append(make("details", { className: "more" },
        make("summary", { textContent: `${rest.length} more of ${code}` }), ...rest));
    }
  };

  class Sliders {
    constructor(viewer) {
      this.viewer = viewer;
      const degrees = 180 / Math.PI;
      this.rows = viewer.data.coordinates.map((coordinate, k) => {
        const scale = coordinate.unit === "rad" ? degrees : 1, unit = coordinate.unit === "rad" ? "°" : coordinate.unit;
        const range = make("input", { type: "range", step: "any", min: coordinate.range[0] * scale, max: coordinate.range[1] * scale });
        const number = make("input", { type: "number", step: "any" });
        range.setAttribute("aria-label", coordinate.name);
        number.setAttribute("aria-label", `${coordinate.name} (${unit})`);
        range.disabled = number.disabled = coordinate.still !== "";
        const name = make("span", { className: "name", textContent: coordinate.name, title: coordinate.path });
        name.addEventListener("click", () => viewer.select(coordinate.path));
        const row = make("div", { className: "slider" + (coordinate.still ? " still" : ""), title: coordinate.still },
          name, number, make("span", { className: "unit", textContent: unit }), range);
        row.dataset.coordinate = coordinate.path;
        range.addEventListener("input", () => viewer.setCoordinate(k, Number(range.value) / scale));
        number.addEventListener("change", () => {
          if (number.value !== "" && Number.isFinite(Number(number.value))) viewer.setCoordinate(k, Number(number.value) / scale);
        });
        return { row, range, number, scale };
      });
      $("#sliders > div").append(...this.rows.map(({ row }) => row));
      $("#reset").addEventListener("click", () => viewer.reset());
    }

    show(q) {
      this.rows.forEach(({ range, number, scale }, k) => {
        const value = q[k] * scale;
        range.value = value;
        if (document.activeElement !== number) number.value = Number(value.toFixed(scale === 1 ? 4 : 2));
      });
    }
  }

  Object.assign(window.osimlite, { Tree, Sliders, showProperties, showFindings, showNotes, make, $ });
})();
