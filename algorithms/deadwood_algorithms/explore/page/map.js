/* The map: a movable view, tiles of the relief, and the objects on them, drawn on one canvas when something changes. */

import { inside, Squares } from "./layers.js";
import { canvasOf } from "./terrain.js";
import { nameOf } from "./answers.js";

const MOST_TILES = 260;
const MANY_TREES = 12_000; // in view: above this number, one picture is used
const OVERVIEW = 2048; // pixels, of that picture's longer side
const CLOSEST = 60; // pixels a metre

export class SlopeMap {
  constructor(canvas, config, say) {
    Object.assign(this, { canvas, config, say, brush: canvas.getContext("2d"), tiles: new Map(), waiting: false });
    this.view = { x: 0, y: 0, scale: 1 };
    this.shown = { trees: true, barriers: true, lines: true, hits: true, deposits: true, contours: false, slope: false, holders: true };
    this.content = { variants: [], edits: null, draft: null, release: null, holders: [], moving: null, cross: false };
    this.scene = null;
    this.felled = new Set();
    this.measure();
    new ResizeObserver(() => { this.measure(); this.draw(); }).observe(canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
  }

  /* A scene was loaded. */
  load(scene, terrain) {
    const fresh = !this.scene;
    this.scene = scene;
    this.terrain = terrain;
    this.tiles.clear();
    this.stamp = stampOf(scene); // otherwise the browser would show a cached relief of another scene
    this.squares = new Squares(scene.data.trees_x, scene.data.trees_y, scene.extent, 16);
    this.overview = null;
    if (fresh) this.whole();
    this.draw();
  }

  // --- the view ---------------------------------------------------------------------------------------------------

  /* Width and height, cached: asking the canvas for each of a thousand points would take longer than drawing them. */
  measure() { this.size = [this.canvas.clientWidth, this.canvas.clientHeight]; }

  /* The panes side by side, each with the variant that it shows: {x, width, variant}. */
  get panes() {
    const [width] = this.size, shown = this.content.variants;
    const side = width / Math.max(shown.length, 1);
    return shown.length > 1 ? shown.map((variant, k) => ({ x: k * side, width: side, variant })) : [{ x: 0, width, variant: shown[0] }];
  }

  paneAt(px) { return this.panes.find((each) => px < each.x + each.width) || this.panes.at(-1); }

  /* Map metres of a place on the canvas. */
  place(px, py) {
    const pane = this.paneAt(px), { x, y, scale } = this.view;
    return [x + (px - pane.x - pane.width / 2) / scale, y - (py - this.size[1] / 2) / scale];
  }

  seen(x, y, pane = this.panes[0]) {
    return [pane.x + pane.width / 2 + (x - this.view.x) * this.view.scale, this.size[1] / 2 - (y - this.view.y) * this.view.scale];
  }

  whole() {
    if (!this.scene) return;
    const [, , w, h] = this.scene.extent, [width, height] = this.size, pane = this.panes[0].width || width;
    this.moveTo({ x: w / 2, y: h / 2, scale: 0.94 * Math.min(pane / w, height / h) || 1 });
  }

  moveTo(view) {
    const [, , w, h] = this.scene.extent, [width, height] = this.size;
    const least = 0.35 * Math.min(width / w, height / h) || 0.01;
    this.view = {
      x: Math.min(Math.max(view.x, 0), w), y: Math.min(Math.max(view.y, 0), h),
      scale: Math.min(Math.max(view.scale, least), CLOSEST),
    };
    this.draw();
    this.moved?.();
  }

  pan(dx, dy) { this.moveTo({ ...this.view, x: this.view.x - dx / this.view.scale, y: this.view.y + dy / this.view.scale }); }

  /* Zooms, keeping the place under the pointer fixed. */
  zoom(factor, px, py) {
    const [x, y] = this.place(px, py), before = this.view.scale;
    this.moveTo({ ...this.view, scale: before * factor });
    const part = before / this.view.scale;
    this.moveTo({ ...this.view, x: x + (this.view.x - x) * part, y: y + (this.view.y - y) * part });
  }

  glide(change) {
    const still = matchMedia("(prefers-reduced-motion: reduce)").matches, start = performance.now(), length = still ? 0 : 140;
    let done = 0;
    const step = (now) => {
      const part = length ? Math.min(1, Math.max(0, (now - start) / length)) : 1;
      change(part - done);
      done = part;
      if (part < 1) requestAnimationFrame(step);
    };
    step(length ? start + 16 : start);
  }

  // --- tiles of the relief ------------------------------------------------------------------------------------------

  tile(level, column, row) {
    const name = `${level}/${column}/${row}`;
    let tile = this.tiles.get(name);
    if (tile) {
      this.tiles.delete(name); // so that the order of the map is that of the last use
    } else {
      tile = new Image();
      tile.decoding = "async";
      tile.onload = () => { tile.ready = true; this.draw(); };
      tile.onerror = () => { tile.lacking = true; };
      tile.src = `tiles/${name}.png?scene=${this.stamp}`;
    }
    this.tiles.set(name, tile);
    if (this.tiles.size > MOST_TILES) this.tiles.delete(this.tiles.keys().next().value);
    return tile;
  }

  relief(brush, pane, ratio) {
    const { cell, rows, columns, extent } = this.scene, size = this.scene.tile || 256, top = extent[3];
    const levels = Math.max(1, this.scene.levels || 1), [, height] = this.size;
    const pixel = this.view.scale * cell * ratio; // of the screen per cell
    const wanted = Math.min(levels - 1, Math.max(0, Math.floor(-Math.log2(pixel) + 0.4)));
    const [west, north] = this.place(pane.x, 0), [, south] = this.place(pane.x, height);
    const east = west + pane.width / this.view.scale;
    brush.imageSmoothingEnabled = pixel * 2 ** wanted < 3;
    for (let level = levels - 1; level >= wanted; level--) {
      if (level !== levels - 1 && level > wanted + 1) continue; // the coarsest is always there, the next coarser helps
      const span = size * cell * 2 ** level;
      const c1 = Math.min(Math.ceil(columns / (size * 2 ** level)) - 1, Math.floor(east / span));
      const r1 = Math.min(Math.ceil(rows / (size * 2 ** level)) - 1, Math.floor((top - south) / span));
      for (let r = Math.max(0, Math.floor((top - north) / span)); r <= r1; r++)
        for (let c = Math.max(0, Math.floor(west / span)); c <= c1; c++) {
          const tile = level === wanted || level === levels - 1 ? this.tile(level, c, r) : this.tiles.get(`${level}/${c}/${r}`);
          if (!tile || !tile.ready) continue;
          const [x, y] = this.seen(c * span, top - r * span, pane), wide = tile.naturalWidth * cell * 2 ** level * this.view.scale;
          const tall = tile.naturalHeight * cell * 2 ** level * this.view.scale;
          brush.drawImage(tile, snap(x, ratio), snap(y, ratio), snap(x + wide, ratio) - snap(x, ratio), snap(y + tall, ratio) - snap(y, ratio));
        }
    }
    brush.imageSmoothingEnabled = true;
  }

  // --- drawing ------------------------------------------------------------------------------------------------------

  draw() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => { this.waiting = false; this.paint(); });
  }

  paint() {
    this.measure();
    const { canvas, brush } = this, ratio = Math.min(window.devicePixelRatio || 1, 2), [width, height] = this.size;
    if (!width) return;
    const [wide, tall] = [Math.round(width * ratio), Math.round(height * ratio)];
    if (canvas.width !== wide || canvas.height !== tall) { canvas.width = wide; canvas.height = tall; }
    this.dark = matchMedia("(prefers-color-scheme: dark)").matches;
    brush.setTransform(ratio, 0, 0, ratio, 0, 0);
    brush.fillStyle = this.dark ? "#101418" : "#e3e7ea";
    brush.fillRect(0, 0, width, height);
    if (!this.scene) return;
    for (const pane of this.panes) {
      brush.save();
      brush.beginPath();
      brush.rect(pane.x, 0, pane.width, height);
      brush.clip();
      this.pane(brush, pane, ratio);
      brush.restore();
    }
    for (const pane of this.panes.slice(1)) {
      brush.fillStyle = this.dark ? "#e4e7ea" : "#1b1f23";
      brush.fillRect(pane.x - 1, 0, 2, height);
    }
    this.frame(brush);
  }

  pane(brush, pane, ratio) {
    const { shown, content, config } = this, variant = pane.variant || {};
    this.relief(brush, pane, ratio);
    // pale, as under the report's maps, for contrast; in the dark theme a grey from which the darkest hits differ
    const [, , wide, tall] = this.scene.extent, { scale } = this.view;
    brush.fillStyle = this.dark ? "rgba(116, 122, 128, 0.55)" : "rgba(238, 238, 238, 0.39)";
    brush.fillRect(...this.seen(0, tall, pane), wide * scale, tall * scale);
    if (shown.slope) this.image(brush, pane, this.terrain.slope(config.slope), 0, 0, this.terrain.cell, true);
    if (shown.contours) this.contours(brush, pane);
    if (shown.hits && variant.picture) {
      const { picture, column, row } = variant.picture;
      this.image(brush, pane, picture, column, row, this.scene.cell, false);
    }
    if (shown.trees) this.trees(brush, pane, variant, ratio);
    if (shown.barriers) this.barriers(brush, pane, variant);
    if (shown.lines) for (const line of this.scene.lines) for (const part of line.parts) this.string(brush, pane, part, config.colours.line, 3, "#ffffff", 5.5);
    if (shown.lines) for (const line of this.scene.lines) this.label(brush, pane, line);
    if (content.release) this.release(brush, pane);
    if (shown.deposits) this.deposits(brush, pane, variant);
    if (shown.holders && variant.edited !== false) this.holders(brush, pane);
    if (content.moving && (this.panes.length === 1 || content.moving.edited === variant.edited)) this.moving(brush, pane);
    if (content.draft) this.draft(brush, pane);
    if (variant.label) this.badge(brush, pane, variant.label);
  }

  /* A picture whose north-west corner is that cell; pixels stay sharp when zoomed in, except in smooth pictures. */
  image(brush, pane, picture, column, row, cell, smooth) {
    const [x, y] = this.seen(column * cell, this.scene.extent[3] - row * cell, pane), size = cell * this.view.scale;
    brush.imageSmoothingEnabled = smooth || size < 1;
    brush.drawImage(picture, x, y, picture.width * size, picture.height * size);
    brush.imageSmoothingEnabled = true;
  }

  metres(brush, pane, work) {
    const [x, y] = this.seen(0, 0, pane), { scale } = this.view;
    brush.save();
    brush.transform(scale, 0, 0, -scale, x, y);
    work(1 / scale);
    brush.restore();
  }

  contours(brush, pane) {
    const { fine, bold } = this.terrain.contours();
    this.metres(brush, pane, (pixel) => {
      brush.strokeStyle = this.dark ? "rgba(255, 236, 205, 0.62)" : "rgba(92, 56, 16, 0.55)";
      if (this.view.scale * this.terrain.cell > 1.2) { brush.lineWidth = 0.6 * pixel; brush.stroke(fine); }
      brush.lineWidth = 1.3 * pixel;
      brush.stroke(bold);
    });
  }

  box(pane, more = 12) {
    const [x0, y1] = this.place(pane.x, -more), [, y0] = this.place(pane.x, this.size[1] + more), m = more / this.view.scale;
    return [x0 - m, y0, x0 + pane.width / this.view.scale + m, y1];
  }

  trees(brush, pane, variant, ratio) {
    const { trees_x: x, trees_y: y, trees_dbh_cm: dbh, trees_height_m: high } = this.scene.data, { scale } = this.view;
    const edited = variant.edited !== false, colour = this.config.colours.tree, box = this.box(pane);
    const gone = edited ? this.felled : new Set();
    if (this.squares.many(...box) > MANY_TREES) {
      this.overview ||= this.farTrees();
      brush.drawImage(this.overview, ...this.seen(0, this.scene.extent[3], pane), this.scene.extent[2] * scale, this.scene.extent[3] * scale);
    } else {
      const least = Math.min(1.1, 0.35 * scale + 0.35), discs = new Path2D(), low = new Path2D();
      brush.fillStyle = colour;
      this.squares.each(...box, (k) => {
        if (gone.has(k)) return;
        if (high[k] < this.config.stump_below_m) { // to scale, and never as large as a tree
          const [px, py] = this.seen(x[k], y[k], pane), r = Math.max(dbh[k] / 200 * scale, 0.6);
          low.rect(px - r, py - r, 2 * r, 2 * r);
          return;
        }
        const [px, py] = this.seen(x[k], y[k], pane), r = Math.max(dbh[k] / 200 * scale, least * (0.7 + dbh[k] / 55));
        if (r * ratio < 2) { brush.fillRect(px - 0.9 * r, py - 0.9 * r, 1.8 * r, 1.8 * r); return; } // too small to be distinguished from a disc
        discs.moveTo(px + r, py);
        discs.arc(px, py, r, 0, 2 * Math.PI);
      });
      brush.strokeStyle = "rgba(255, 255, 255, 0.85)";
      brush.lineWidth = 0.8;
      brush.fill(discs);
      if (scale > 3) brush.stroke(discs);
      brush.fillStyle = this.config.colours.stump;
      brush.fill(low);
    }
    if (!edited || !this.content.edits) return;
    for (const k of gone) this.cross(brush, ...this.seen(x[k], y[k], pane), Math.max(3.5, dbh[k] / 200 * scale));
    for (const tree of this.content.edits.plant) {
      const [px, py] = this.seen(tree.x, tree.y, pane), r = Math.max(3.2, tree.dbh_cm / 200 * scale);
      disc(brush, px, py, r, colour, "#ffffff", 1.2);
      disc(brush, px, py, r + 3, null, this.config.colours.changed, 2);
    }
  }

  /* All trees as one picture, for views that hold very many. */
  farTrees() {
    const [, , w, h] = this.scene.extent, size = OVERVIEW / Math.max(w, h), { trees_x: x, trees_y: y, trees_dbh_cm: dbh, trees_height_m: high } = this.scene.data;
    const picture = canvasOf(Math.ceil(w * size), Math.ceil(h * size)), brush = picture.getContext("2d");
    brush.fillStyle = this.config.colours.tree;
    for (let k = 0; k < x.length; k++) {
      if (this.felled.has(k)) continue;
      const stump = high[k] < this.config.stump_below_m, side = stump ? 0.6 : 0.8 + dbh[k] / 60;
      brush.fillStyle = stump ? this.config.colours.stump : this.config.colours.tree;
      brush.fillRect(x[k] * size - side / 2, (h - y[k]) * size - side / 2, side, side);
    }
    return picture;
  }

  cross(brush, px, py, r) {
    for (const [colour, width] of [["#ffffff", 4], [this.config.colours.changed, 2]]) {
      brush.strokeStyle = colour;
      brush.lineWidth = width;
      brush.beginPath();
      brush.moveTo(px - r, py - r); brush.lineTo(px + r, py + r);
      brush.moveTo(px - r, py + r); brush.lineTo(px + r, py - r);
      brush.stroke();
    }
  }

  string(brush, pane, points, colour, width, halo, haloWidth) {
    brush.lineJoin = brush.lineCap = "round";
    brush.beginPath();
    points.forEach(([x, y], k) => (k ? brush.lineTo(...this.seen(x, y, pane)) : brush.moveTo(...this.seen(x, y, pane))));
    if (halo) { brush.strokeStyle = halo; brush.lineWidth = haloWidth; brush.stroke(); }
    brush.strokeStyle = colour;
    brush.lineWidth = width;
    brush.stroke();
  }

  barriers(brush, pane, variant) {
    const { colours } = this.config, { scene, content } = this;
    const wood = (diameter) => Math.max(2.5, diameter / 100 * this.view.scale);
    for (const each of scene.lying_logs || []) this.string(brush, pane, each.points, colours.lying, wood(each.diameter_cm || 40));
    for (const each of scene.blocks || []) {
      const [px, py] = this.seen(each.x, each.y, pane);
      disc(brush, px, py, Math.max(2.4, (each.diameter_m || 1) / 2 * this.view.scale), colours.block, "#ffffff", 0.8);
    }
    for (const each of scene.barriers || []) this.string(brush, pane, each.points, colours.barrier, 3.2, "#ffffff", 5.2);
    if (variant.edited === false || !content.edits) return;
    for (const each of content.edits.lying_logs) {
      this.string(brush, pane, each.points, colours.lying, wood(each.diameter_cm), colours.changed, wood(each.diameter_cm) + 3);
    }
    for (const each of content.edits.barriers) this.string(brush, pane, each.points, colours.barrier, 3.2, colours.changed, 6.5);
  }

  label(brush, pane, line) {
    if (this.scene.lines.length > 60) return;
    const within = [];
    for (const part of line.parts) for (let k = 0; k + 1 < part.length; k++) for (let s = 0; s <= 8; s++) {
      const [px, py] = this.seen(part[k][0] + (part[k + 1][0] - part[k][0]) * s / 8, part[k][1] + (part[k + 1][1] - part[k][1]) * s / 8, pane);
      if (px > pane.x + 20 && px < pane.x + pane.width - 80 && py > 30 && py < this.size[1] - 80) within.push([px, py]);
    }
    if (!within.length) return;
    const [px, py] = within[Math.floor(within.length / 2)];
    this.text(brush, nameOf(line), px + 6, py - 11, "600 13px system-ui, sans-serif");
  }

  release(brush, pane) {
    const { shape } = this.content.release, colour = this.config.colours.release;
    brush.beginPath();
    if (shape.circle) {
      const [x, y, r] = shape.circle;
      brush.arc(...this.seen(x, y, pane), Math.max(3, r * this.view.scale), 0, 2 * Math.PI);
    } else {
      shape.polygon.forEach(([x, y], k) => (k ? brush.lineTo(...this.seen(x, y, pane)) : brush.moveTo(...this.seen(x, y, pane))));
      brush.closePath();
    }
    brush.fillStyle = "rgba(136, 34, 85, 0.16)";
    brush.fill();
    brush.strokeStyle = "#ffffff";
    brush.lineWidth = 4;
    brush.stroke();
    brush.strokeStyle = colour;
    brush.lineWidth = 2;
    brush.stroke();
    if (shape.circle) {
      const [x, y, r] = shape.circle;
      disc(brush, ...this.seen(x, y, pane), 2.5, colour, "#ffffff", 1);
      disc(brush, ...this.seen(x + r, y, pane), 4.5, "#ffffff", colour, 2);
    }
  }

  deposits(brush, pane, variant) {
    const ends = variant.deposits;
    if (!ends) return;
    const { x, y, reason } = ends, r = Math.min(4, Math.max(1.9, 0.9 + 0.35 * this.view.scale));
    if (variant.moves) {
      brush.beginPath();
      for (const [ax, ay, bx, by] of variant.moves) { brush.moveTo(...this.seen(ax, ay, pane)); brush.lineTo(...this.seen(bx, by, pane)); }
      const dense = Math.min(0.35, Math.max(0.08, 25 / variant.moves.length)); // many lines must not hide the cells
      brush.strokeStyle = `rgba(${this.dark ? "255, 255, 255" : "20, 20, 20"}, ${dense})`;
      brush.lineWidth = 1;
      brush.stroke();
    }
    const paths = this.config.stops.map(() => new Path2D());
    for (let k = 0; k < x.length; k++) {
      if (!Number.isFinite(x[k] + y[k])) continue;
      const path = paths[reason[k]], [px, py] = this.seen(x[k], y[k], pane);
      if (path) sign(path, this.config.stops[reason[k]].shape, px, py, r);
    }
    brush.lineWidth = 0.9;
    this.config.stops.forEach(({ colour }, k) => {
      brush.fillStyle = colour;
      brush.strokeStyle = "rgba(255, 255, 255, 0.9)";
      brush.stroke(paths[k]);
      brush.fill(paths[k]);
    });
  }

  holders(brush, pane) {
    const { trees_x: x, trees_y: y, trees_dbh_cm: dbh } = this.scene.data;
    for (const { tree, n } of this.content.holders) {
      const planted = this.content.edits?.plant[tree - x.length]; // numbered after those of the layer
      if (tree >= x.length && !planted) continue;
      const [at, wide] = planted ? [[planted.x, planted.y], planted.dbh_cm] : [[x[tree], y[tree]], dbh[tree]];
      const [px, py] = this.seen(...at, pane), r = Math.max(4, wide / 200 * this.view.scale + 2) + Math.min(6, Math.sqrt(n));
      disc(brush, px, py, r, "rgba(255, 214, 0, 0.35)", "#1b1f23", 3.4);
      disc(brush, px, py, r, null, "#ffd600", 2);
    }
  }

  moving(brush, pane) {
    const { logs, trails } = this.content.moving, { scale } = this.view;
    brush.lineCap = "round";
    if (trails) {
      this.metres(brush, pane, (pixel) => { brush.strokeStyle = "rgba(255, 255, 255, 0.5)"; brush.lineWidth = 0.8 * pixel; brush.stroke(trails); });
    }
    for (const [colour, more] of [["#1b1f23", 2], [this.config.colours.moving, 0]]) {
      brush.strokeStyle = colour;
      for (const { ends, radius } of logs) {
        brush.lineWidth = Math.max(2.2, 2 * radius * scale) + more;
        brush.beginPath();
        brush.moveTo(...this.seen(ends[0], ends[1], pane));
        brush.lineTo(...this.seen(ends[3], ends[4], pane));
        brush.stroke();
      }
    }
  }

  draft(brush, pane) {
    const { points, closed, rectangle, hover } = this.content.draft, { changed } = this.config.colours;
    brush.setLineDash([6, 4]);
    if (rectangle) {
      const [[ax, ay], [bx, by]] = rectangle.map((each) => this.seen(...each, pane));
      brush.fillStyle = "rgba(213, 94, 0, 0.12)";
      brush.fillRect(ax, ay, bx - ax, by - ay);
      brush.strokeStyle = changed;
      brush.lineWidth = 2;
      brush.strokeRect(ax, ay, bx - ax, by - ay);
    } else {
      const way = hover ? [...points, hover] : points;
      this.string(brush, pane, closed && way.length > 2 ? [...way, way[0]] : way, changed, 2, "rgba(255, 255, 255, 0.8)", 4);
      for (const each of points) disc(brush, ...this.seen(...each, pane), 4, "#ffffff", changed, 2);
    }
    brush.setLineDash([]);
  }

  badge(brush, pane, label) {
    this.text(brush, label, pane.x + pane.width / 2, this.size[1] - 74, "600 15px system-ui, sans-serif", "center");
  }

  /* Scale bar, north arrow, and the cross of the keyboard. */
  frame(brush) {
    const [width, height] = this.size, narrow = width < 600;
    const most = (narrow ? 90 : 150) / this.view.scale, power = 10 ** Math.floor(Math.log10(most));
    const bar = Math.max(...[1, 2, 5].map((each) => each * power).filter((each) => each <= most)), long = bar * this.view.scale;
    const x = this.inset || 14, y = height - 16;
    const [ink, halo] = this.inks();
    for (const [colour, thick] of [[halo, 7], [ink, 3.5]]) {
      brush.strokeStyle = colour;
      brush.lineWidth = thick;
      brush.lineCap = "butt";
      brush.beginPath();
      brush.moveTo(x - (thick > 4 ? 2 : 0), y);
      brush.lineTo(x + long + (thick > 4 ? 2 : 0), y);
      brush.stroke();
    }
    this.text(brush, bar >= 1000 ? `${bar / 1000} km` : `${bar} m`, x + long / 2, y - 11, "600 12px system-ui, sans-serif", "center");
    const nx = width - 26, ny = 46;
    brush.beginPath();
    brush.moveTo(nx, ny - 30); brush.lineTo(nx + 8, ny - 6); brush.lineTo(nx, ny - 12); brush.lineTo(nx - 8, ny - 6);
    brush.closePath();
    brush.strokeStyle = halo;
    brush.lineWidth = 4;
    brush.stroke();
    brush.fillStyle = ink;
    brush.fill();
    this.text(brush, this.say("north_letter"), nx, ny + 4, "700 13px system-ui, sans-serif", "center");
    if (!this.content.cross) return;
    for (const pane of this.panes) {
      const [px, py] = this.seen(this.view.x, this.view.y, pane);
      for (const [colour, wide] of [["#ffffff", 4], ["#0a5c99", 2]]) {
        brush.strokeStyle = colour;
        brush.lineWidth = wide;
        brush.beginPath();
        for (const [a, b] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) { brush.moveTo(px + 5 * a, py + 5 * b); brush.lineTo(px + 15 * a, py + 15 * b); }
        brush.stroke();
      }
    }
  }

  inks() { return this.dark ? ["#ffffff", "#101418"] : ["#111111", "#ffffff"]; }

  text(brush, words, x, y, font, align = "left") {
    const [ink, halo] = this.inks();
    Object.assign(brush, { font, textAlign: align, textBaseline: "middle", lineJoin: "round", strokeStyle: halo, lineWidth: 4, fillStyle: ink });
    brush.strokeText(words, x, y);
    brush.fillText(words, x, y);
  }

  // --- queries ---------------------------------------------------------------------------------------------

  treesWithin(ring) {
    const xs = ring.map((each) => each[0]), ys = ring.map((each) => each[1]), found = [];
    const { trees_x: x, trees_y: y } = this.scene.data;
    this.squares.each(Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys), (k) => {
      if (inside(ring, x[k], y[k])) found.push(k);
    });
    return found;
  }

  treeAt(x, y, pixels = 14) { return this.squares.nearest(x, y, Math.max(pixels / this.view.scale, 0.3)); }

  within(x, y) { return x >= 0 && y >= 0 && x <= this.scene.extent[2] && y <= this.scene.extent[3]; }
}

/* A name for the terrain of a scene, by its place and heights. */
function stampOf({ origin, extent, cell, data }) {
  let sum = 0;
  for (const [k, each] of (data.heights || []).entries()) if (Number.isFinite(each)) sum = (sum * 31 + Math.round(1000 * each) + k) % 1e12;
  return encodeURIComponent([...origin, ...extent, cell, sum].join("_"));
}

const snap = (value, ratio) => Math.round(value * ratio) / ratio;

function disc(brush, x, y, r, inner, edge, width) {
  brush.beginPath();
  brush.arc(x, y, r, 0, 2 * Math.PI);
  if (inner) { brush.fillStyle = inner; brush.fill(); }
  if (edge) { brush.strokeStyle = edge; brush.lineWidth = width; brush.stroke(); }
}

/* A deposit's sign: circle, triangle, square or cross, so that meaning does not depend on colour alone. */
function sign(path, shape, x, y, r) {
  if (shape === "triangle") { path.moveTo(x, y - r * 1.2); path.lineTo(x + r * 1.1, y + r * 0.8); path.lineTo(x - r * 1.1, y + r * 0.8); path.closePath(); }
  else if (shape === "square") path.rect(x - r * 0.9, y - r * 0.9, 1.8 * r, 1.8 * r);
  else if (shape === "cross2") { for (const [a, b] of [[1, 1], [1, -1]]) { path.moveTo(x - r * a - 0.8, y - r * b); path.lineTo(x + r * a, y + r * b); path.lineTo(x + r * a + 0.8, y + r * b); path.lineTo(x - r * a, y - r * b); path.closePath(); } }
  else { path.moveTo(x + r, y); path.arc(x, y, r, 0, 2 * Math.PI); }
}

