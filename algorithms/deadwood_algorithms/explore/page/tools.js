/* Actions of the pointer and the keys on the map: each tool turns them into a release or a change of the forest. */

import { make, say } from "./words.js";

const NEAR = 9; // pixels, for grabbing the rim or closing an area
const STILL = 5; // pixels within which a press is a click

/* Name, key, icon, and the hint shown while the tool is selected. */
export const TOOLS = [
  { name: "move", key: "v", icon: "M10 2v16M2 10h16M7.5 4.5 10 2l2.5 2.5M7.5 15.5 10 18l2.5-2.5M4.5 7.5 2 10l2.5 2.5M15.5 7.5 18 10l-2.5 2.5" },
  { name: "circle", key: "r", icon: "M17 10a7 7 0 1 1-14 0 7 7 0 0 1 14 0zM10 9.5v1M9.5 10h1" },
  { name: "area", key: "a", icon: "M4 6.5 11 3l6 5.5-3 8H6z" },
  null,
  { name: "fell", key: "f", icon: "M10 2 5.5 9h9zM10 7l-5 7h10zM10 14v4M3 3l14 14" },
  { name: "fellarea", key: "g", icon: "M3 5h14v11H3zM7 8l5 5M12 8l-5 5" },
  { name: "plant", key: "t", icon: "M8 2 4 9h8zM8 6l-4.5 7h9zM8 13v5M16 11v6M13 14h6" },
  { name: "barrier", key: "b", icon: "M2 7h16M2 11h16M4 4v13M10 4v13M16 4v13" },
  { name: "lay", key: "l", icon: "M4 9.5 15 5a2.5 2.5 0 0 1 2 4.5L6 15a2.8 2.8 0 0 1-2-5.5zM6 9.5a3 3 0 0 1 0 5" },
];

const DRAWN = { area: { closed: true, least: 3 }, fellarea: { closed: true, least: 3 }, barrier: { closed: false, least: 2 }, lay: { closed: false, least: 2, most: 2 } };

export function icon(path) {
  const space = "http://www.w3.org/2000/svg", box = document.createElementNS(space, "svg"), way = document.createElementNS(space, "path");
  box.setAttribute("viewBox", "0 0 20 20");
  box.setAttribute("aria-hidden", "true");
  way.setAttribute("d", path);
  box.append(way);
  return box;
}

/* The pointer on the map. `act` has the actions of the tools: release, fell, toggle, plant, barrier, lay, preview. */
export class Hand {
  constructor(map, act) {
    Object.assign(this, { map, act, tool: "circle", points: [], pointers: new Map(), drag: null, space: false });
    const { canvas } = map;
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("pointerdown", (event) => this.down(event));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    canvas.addEventListener("pointerup", (event) => this.up(event));
    canvas.addEventListener("pointercancel", (event) => this.up(event, true));
    canvas.addEventListener("pointerleave", () => { if (!this.pointers.size) this.act.hover(null); });
    canvas.addEventListener("dblclick", () => this.finish());
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      if (!map.scene) return;
      const unit = event.deltaMode === 1 ? 20 : 1;
      map.zoom(Math.exp(-Math.max(-240, Math.min(240, event.deltaY * unit)) * (event.ctrlKey ? 0.008 : 0.0018)), event.offsetX, event.offsetY);
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => this.key(event));
    canvas.addEventListener("keyup", (event) => { if (event.key === " ") this.space = false; });
    canvas.addEventListener("blur", () => { this.space = false; this.cross(false); });
    canvas.addEventListener("focus", () => { if (canvas.matches(":focus-visible")) this.cross(true); });
  }

  choose(tool) {
    this.cancel();
    this.tool = tool;
    this.map.canvas.dataset.tool = tool;
  }

  cross(on) { this.map.content.cross = on; this.map.draw(); }

  /* The current drawing is discarded. */
  cancel() {
    this.points = [];
    this.drag = null;
    this.map.content.draft = null;
    this.map.draw();
    this.act.drawing(0, false);
  }

  down(event) {
    const { map, pointers } = this;
    if (!map.scene) return;
    map.canvas.setPointerCapture(event.pointerId);
    this.cross(false);
    pointers.set(event.pointerId, [event.offsetX, event.offsetY]);
    if (pointers.size === 2) { this.letGo(); this.pinch = null; return; }
    const at = map.place(event.offsetX, event.offsetY), start = { px: event.offsetX, py: event.offsetY, at, far: 0 };
    if (this.tool === "move" || event.button === 1 || event.button === 2 || this.space) this.drag = { ...start, kind: "pan" };
    else if (event.button !== 0) return;
    else if (this.tool === "circle") {
      const shape = this.act.shape(), pane = map.paneAt(event.offsetX);
      if (shape?.circle) {
        const [cx, cy] = map.seen(shape.circle[0], shape.circle[1], pane), far = Math.hypot(event.offsetX - cx, event.offsetY - cy);
        if (Math.abs(far - shape.circle[2] * map.view.scale) < NEAR && far > NEAR) { this.drag = { ...start, kind: "rim" }; return; }
      }
      if (!map.within(...at)) { this.act.say("outside"); return; }
      this.drag = { ...start, kind: "release" };
      this.act.release(at, false);
    } else this.drag = { ...start, kind: "press", touch: event.pointerType === "touch" };
    map.canvas.classList.toggle("held", this.drag?.kind === "pan");
  }

  /* A second finger was added: the action of the first ends without effect. */
  letGo() {
    if (this.drag?.kind === "press") this.map.content.draft = this.points.length ? { points: this.points, closed: DRAWN[this.tool]?.closed } : null;
    this.drag = null;
  }

  move(event) {
    const { map, pointers, drag } = this, old = pointers.get(event.pointerId);
    if (!map.scene) return;
    const at = map.place(event.offsetX, event.offsetY);
    this.act.hover(at);
    if (old) pointers.set(event.pointerId, [event.offsetX, event.offsetY]);
    if (pointers.size >= 2) {
      const [a, b] = [...pointers.values()], apart = Math.hypot(a[0] - b[0], a[1] - b[1]), middle = [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];
      if (this.pinch) {
        map.pan(middle[0] - this.pinch.middle[0], middle[1] - this.pinch.middle[1]);
        map.zoom(apart / Math.max(this.pinch.apart, 1), ...middle);
      }
      this.pinch = { apart, middle };
      return;
    }
    if (!drag) {
      this.hovered(event, at);
      return;
    }
    drag.far = Math.max(drag.far, Math.hypot(event.offsetX - drag.px, event.offsetY - drag.py));
    if (drag.kind === "press" && drag.far > STILL && this.tool !== "fell" && this.tool !== "lay") drag.kind = "pan";
    if (drag.kind === "pan") { map.pan(event.offsetX - old[0], event.offsetY - old[1]); return; }
    if (drag.kind === "release" && drag.far > STILL / 2 && map.within(...at)) this.act.release(at, true);
    if (drag.kind === "rim") this.act.resize(at, true);
    if (drag.kind === "press" && drag.far > STILL && (this.tool === "fell" || this.tool === "lay")) {
      map.content.draft = this.tool === "fell" ? { points: [], rectangle: [drag.at, at] } : { points: [drag.at], hover: at };
      map.draw();
    }
  }

  hovered(event, at) {
    const { map } = this;
    if (this.points.length) { map.content.draft = { points: this.points, closed: DRAWN[this.tool].closed, hover: at }; map.draw(); }
    if (this.tool === "circle") {
      const shape = this.act.shape();
      if (!shape?.circle) return;
      const [cx, cy] = map.seen(shape.circle[0], shape.circle[1], map.paneAt(event.offsetX)), far = Math.hypot(event.offsetX - cx, event.offsetY - cy);
      map.canvas.style.cursor = Math.abs(far - shape.circle[2] * map.view.scale) < NEAR && far > NEAR ? "ew-resize" : "";
    } else map.canvas.style.cursor = this.tool === "fell" && map.treeAt(...at, 10) >= 0 ? "pointer" : "";
  }

  up(event, cancelled = false) {
    const { map, pointers, drag } = this;
    pointers.delete(event.pointerId);
    if (pointers.size < 2) this.pinch = null;
    if (!drag || !map.scene) return;
    const at = map.place(event.offsetX, event.offsetY);
    this.drag = null;
    map.canvas.classList.remove("held");
    if (cancelled) { this.letGo(); map.draw(); return; }
    if (drag.kind === "release" && drag.far > STILL / 2) this.act.rest();
    if (drag.kind === "rim" && drag.far > STILL / 2) this.act.rest();
    else if (drag.kind === "rim") this.click(at); // a click beside the rim is one on the slope
    if (drag.kind !== "press") return;
    if (drag.far > STILL && this.tool === "fell") {
      map.content.draft = null;
      const [[ax, ay], [bx, by]] = [drag.at, at];
      this.act.fell(map.treesWithin([[ax, ay], [bx, ay], [bx, by], [ax, by]]));
    } else if (drag.far > STILL && this.tool === "lay") {
      this.points = [drag.at, at];
      this.finish();
    } else if (drag.far <= STILL) this.click(drag.at, drag.touch ? 24 : 14);
    map.draw();
  }

  /* A click, or the key for a click at the middle of the map. */
  click(at, pixels = 14) {
    const { map, tool, points } = this;
    if (tool === "fell") {
      const tree = map.treeAt(...at, pixels);
      if (tree >= 0) this.act.toggle(tree); else this.act.say("no_tree_here");
      return;
    }
    if (!map.within(...at)) { this.act.say("outside"); return; }
    if (tool === "circle") this.act.release(at, false);
    else if (tool === "plant") this.act.plant(at);
    else if (DRAWN[tool]) {
      const near = (other) => other && Math.hypot(other[0] - at[0], other[1] - at[1]) * map.view.scale < NEAR;
      if (DRAWN[tool].closed && points.length >= 3 && near(points[0])) { this.finish(); return; }
      if (near(points.at(-1))) return; // the second click of a double click
      points.push(at);
      map.content.draft = { points, closed: DRAWN[tool].closed };
      this.act.drawing(points.length, points.length >= DRAWN[tool].least);
      if (points.length === DRAWN[tool].most) this.finish();
      map.draw();
    }
  }

  finish() {
    const { tool, points, map } = this, rule = DRAWN[tool];
    if (!rule || !points.length) return;
    if (!points.every((each) => map.within(...each))) { this.cancel(); this.act.say("outside"); return; }
    if (points.length < rule.least) { this.act.say(rule.closed ? "too_few_corners" : "too_few_points"); return; }
    this.cancel();
    if (tool === "area") this.act.area(points);
    else if (tool === "fellarea") this.act.fell(map.treesWithin(points));
    else if (tool === "barrier") this.act.barrier(points);
    else this.act.lay(points);
  }

  key(event) {
    const { map } = this, { key } = event, [width, height] = map.size, far = event.shiftKey ? 0.4 : 0.12;
    if (!map.scene || event.ctrlKey || event.metaKey || event.altKey) return;
    const ways = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
    const middle = [map.panes[0].x + map.panes[0].width / 2, height / 2];
    if (ways[key]) map.glide((part) => map.pan(ways[key][0] * far * width * part, ways[key][1] * far * height * part));
    else if (key === "+" || key === "=") map.glide((part) => map.zoom(1.5 ** part, ...middle));
    else if (key === "-" || key === "_") map.glide((part) => map.zoom(1.5 ** -part, ...middle));
    else if (key === "0" || key === "Home") map.whole();
    else if (key === "Enter" && (event.shiftKey || this.tool === "move")) this.finish();
    else if (key === "Enter") { this.cross(true); this.click([map.view.x, map.view.y], 30); }
    else if (key === "Escape") this.cancel();
    else if (key === "Backspace" && this.points.length) { this.points.pop(); this.map.content.draft = { points: this.points, closed: DRAWN[this.tool].closed }; this.act.drawing(this.points.length, false); map.draw(); }
    else if (key === " ") { this.space = true; }
    else return;
    if (ways[key]) this.cross(true);
    event.preventDefault();
  }
}

export function toolbar(root, choose, extra) {
  for (const tool of TOOLS) {
    if (!tool) { root.append(make("hr")); continue; }
    const words = say(`tool_${tool.name}`), button = make("button", { type: "button", "data-tool": tool.name, "aria-pressed": "false", title: `${words} (${tool.key.toUpperCase()})`, "aria-label": words, "aria-keyshortcuts": tool.key, onclick: () => choose(tool.name) }, icon(tool.icon), make("span", { class: "word" }, words));
    root.append(button);
  }
  root.append(make("hr"));
  for (const { name, path, shortcut, work } of extra) {
    root.append(make("button", { type: "button", id: name, disabled: true, title: `${say(name)} (${shortcut})`, "aria-label": say(name), onclick: work }, icon(path), make("span", { class: "word" }, say(name))));
  }
}
