/* Pictures and indices that are made once per answer, so that drawing the map only copies them. */

import { canvasOf, rgb } from "./terrain.js";

const OPAQUE = 0.72;
export const Z95 = 1.96;

/* A raster over a box of cells, as the tool sends it: counts, rows from the north, and its north-west cell. */
export function boxOf(values, at) {
  const [rows, columns] = values.shape;
  return { values, rows, columns, column: at[0], row: at[1] };
}

function fitted(canvas, columns, rows) {
  if (!canvas) return canvasOf(Math.max(columns, 1), Math.max(rows, 1));
  if (canvas.width !== columns || canvas.height !== rows) { canvas.width = Math.max(columns, 1); canvas.height = Math.max(rows, 1); }
  return canvas;
}

/* The hits of this number of logs as a picture: the share of logs in each cell, on the scale of shares that all maps of
   the toolbox have; `ramp` are its colours, each with its share. */
export function hitsPicture(box, logs, ramp, canvas) {
  const picture = fitted(canvas, box.columns, box.rows), brush = picture.getContext("2d");
  if (!box.values.length) { brush.clearRect(0, 0, 1, 1); return picture; }
  const image = new ImageData(box.columns, box.rows), pixels = new Uint32Array(image.data.buffer);
  const alpha = Math.round(255 * OPAQUE);
  const tints = tintsOf(ramp, logs, box.values.reduce((most, each) => Math.max(most, each), 0), alpha);
  for (let k = 0; k < box.values.length; k++) pixels[k] = tints[box.values[k]];
  brush.putImageData(image, 0, 0);
  return picture;
}

/* The colour of each count up to the largest, packed: that of the nearest share of the ramp, none for 0. */
function tintsOf(ramp, logs, most, alpha) {
  const tints = new Uint32Array(most + 1), colours = ramp.map(({ colour }) => packed(colour, alpha));
  for (let count = 1, k = 0; count <= most; count++) {
    while (k + 1 < ramp.length && 2 * count / logs >= ramp[k].share + ramp[k + 1].share) k++;
    tints[count] = colours[k];
  }
  return tints;
}

/* After less before, as a picture: coloured where the interval excludes 0, else grey. Per cell only the counts of both
   runs are known, not their pairs; their difference is at most as uncertain as that of independent runs, and of logs
   that the change did not affect, none is. So the map is conservative: rather too much of it is grey. */
export function differencePicture(before, after, concerned, colours, canvas) {
  const west = Math.min(before.column, after.column), north = Math.min(before.row, after.row);
  const east = Math.max(before.column + before.columns, after.column + after.columns);
  const south = Math.max(before.row + before.rows, after.row + after.rows);
  const columns = Math.max(east - west, 1), rows = Math.max(south - north, 1);
  const picture = fitted(canvas, columns, rows), image = new ImageData(columns, rows), pixels = new Uint32Array(image.data.buffer);
  const less = colours.less.map((each) => packed(each, 215)), more = colours.more.map((each) => packed(each, 215)), grey = packed(colours.chance, 190);
  for (let j = 0; j < rows; j++) {
    const one = rowOf(before, west, north + j, columns), other = rowOf(after, west, north + j, columns);
    for (let i = 0; i < columns; i++) {
      const a = one[i], b = other[i], gain = b - a;
      if (!gain) continue;
      const far = Math.abs(gain) / (Z95 * Math.sqrt(Math.min(a, concerned) + Math.min(b, concerned)));
      pixels[j * columns + i] = far <= 1 ? grey : (gain < 0 ? less : more)[far > 2 ? 1 : 0];
    }
  }
  picture.getContext("2d").putImageData(image, 0, 0);
  return { picture, column: west, row: north };
}

/* The counts of a row of cells from a column on; 0 outside the box. */
function rowOf(box, column, row, columns) {
  const out = new Uint16Array(columns), j = row - box.row;
  if (j >= 0 && j < box.rows && box.columns) out.set(box.values.subarray(j * box.columns, (j + 1) * box.columns), box.column - column);
  return out;
}

/* A colour as a pixel of an ImageData. */
function packed(colour, alpha) {
  const [r, g, b] = rgb(colour);
  return ((alpha << 24) | (b << 16) | (g << 8) | r) >>> 0;
}

/* Points sorted into squares, so that those in view or nearest to the pointer are found quickly. */
export class Squares {
  constructor(x, y, extent, side) {
    Object.assign(this, { x, y, side });
    this.columns = Math.max(1, Math.ceil(extent[2] / side));
    this.rows = Math.max(1, Math.ceil(extent[3] / side));
    const home = new Uint32Array(x.length);
    this.start = new Uint32Array(this.columns * this.rows + 1);
    for (let k = 0; k < x.length; k++) {
      home[k] = this.row(y[k]) * this.columns + this.column(x[k]);
      this.start[home[k] + 1]++;
    }
    for (let k = 1; k < this.start.length; k++) this.start[k] += this.start[k - 1];
    this.sorted = new Uint32Array(x.length);
    const next = this.start.slice();
    for (let k = 0; k < x.length; k++) this.sorted[next[home[k]]++] = k;
  }

  column(x) { return Math.min(this.columns - 1, Math.max(0, Math.floor(x / this.side))); }
  row(y) { return Math.min(this.rows - 1, Math.max(0, Math.floor(y / this.side))); }

  /* Roughly how many are in a box; whole squares count. */
  many(x0, y0, x1, y1) {
    let sum = 0;
    for (let r = this.row(y0); r <= this.row(y1); r++)
      sum += this.start[r * this.columns + this.column(x1) + 1] - this.start[r * this.columns + this.column(x0)];
    return sum;
  }

  each(x0, y0, x1, y1, visit) {
    for (let r = this.row(y0); r <= this.row(y1); r++) {
      const from = this.start[r * this.columns + this.column(x0)], to = this.start[r * this.columns + this.column(x1) + 1];
      for (let k = from; k < to; k++) {
        const n = this.sorted[k];
        if (this.x[n] >= x0 && this.x[n] <= x1 && this.y[n] >= y0 && this.y[n] <= y1) visit(n);
      }
    }
  }

  nearest(x, y, within) {
    let best = within, found = -1;
    this.each(x - within, y - within, x + within, y + within, (k) => {
      const far = Math.hypot(this.x[k] - x, this.y[k] - y);
      if (far <= best) { best = far; found = k; }
    });
    return found;
  }
}

/* Is a place inside a closed ring of points? */
export function inside(ring, x, y) {
  let within = false;
  for (let k = 0, j = ring.length - 1; k < ring.length; j = k++) {
    const [ax, ay] = ring[k], [bx, by] = ring[j];
    if ((ay > y) !== (by > y) && x < (bx - ax) * (y - ay) / (by - ay) + ax) within = !within;
  }
  return within;
}
