/* Derived in the page from the scene's thinned heights: contours, slope, and the height under the pointer. */

const STEPS = [1, 2, 5, 10, 20, 50, 100, 200];

/* Heights (rows from the north, `cell` metres apart) with the functions that read them. */
export class Terrain {
  constructor(heights, cell, extent) {
    [this.rows, this.columns] = heights.shape;
    Object.assign(this, { z: heights, cell, top: extent[3] });
  }

  /* Height at a place by interpolation [m]; NaN outside. */
  at(x, y) {
    const i = x / this.cell - 0.5, j = (this.top - y) / this.cell - 0.5;
    if (i < -0.5 || j < -0.5 || i > this.columns - 0.5 || j > this.rows - 0.5) return NaN;
    const c = Math.min(Math.max(Math.floor(i), 0), this.columns - 2), r = Math.min(Math.max(Math.floor(j), 0), this.rows - 2);
    const u = Math.min(Math.max(i - c, 0), 1), v = Math.min(Math.max(j - r, 0), 1), k = r * this.columns + c, z = this.z;
    return (1 - v) * ((1 - u) * z[k] + u * z[k + 1]) + v * ((1 - u) * z[k + this.columns] + u * z[k + this.columns + 1]);
  }

  /* Slope at a place [deg], over two cells; NaN outside. */
  slopeAt(x, y) {
    const d = this.cell, east = (this.at(x + d, y) - this.at(x - d, y)) / (2 * d), north = (this.at(x, y + d) - this.at(x, y - d)) / (2 * d);
    return Math.atan(Math.hypot(east, north)) * 180 / Math.PI;
  }

  /* The round step of about 25 contours over the relief. */
  get step() {
    if (!this._step) {
      let low = Infinity, high = -Infinity;
      for (const each of this.z) if (Number.isFinite(each)) { low = Math.min(low, each); high = Math.max(high, each); }
      this._step = STEPS.find((each) => each >= (high - low) / 25) || 500;
    }
    return this._step;
  }

  /* Contours as paths in local metres: every step, and every fifth separately. */
  contours() {
    if (this._contours) return this._contours;
    const { rows, columns, cell, top, z, step } = this, fine = new Path2D(), bold = new Path2D();
    for (let r = 0; r + 1 < rows; r++) for (let c = 0; c + 1 < columns; c++) {
      const k = r * columns + c, corners = [z[k], z[k + 1], z[k + columns + 1], z[k + columns]];
      const low = Math.min(...corners), high = Math.max(...corners);
      if (!Number.isFinite(low + high)) continue;
      for (let n = Math.floor(low / step) + 1; n * step <= high; n++) {
        const level = n * step, ends = [];
        for (let side = 0; side < 4; side++) {
          const a = corners[side], b = corners[(side + 1) % 4];
          if ((a < level) === (b < level)) continue;
          const t = (level - a) / (b - a), [u, v] = [[t, 0], [1, t], [1 - t, 1], [0, 1 - t]][side];
          ends.push([(c + u + 0.5) * cell, top - (r + v + 0.5) * cell]);
        }
        const path = n % 5 ? fine : bold;
        for (let e = 0; e + 1 < ends.length; e += 2) { path.moveTo(...ends[e]); path.lineTo(...ends[e + 1]); }
      }
    }
    return (this._contours = { fine, bold });
  }

  /* The slope in classes as a picture of the thinned heights; classes: [{from, colour}] by rising angle [deg]. */
  slope(classes) {
    if (this._slope) return this._slope;
    const { rows, columns, cell, z } = this, picture = canvasOf(columns, rows), brush = picture.getContext("2d");
    const image = brush.createImageData(columns, rows);
    const tints = classes.map((each) => rgb(each.colour));
    for (let r = 0; r < rows; r++) for (let c = 0; c < columns; c++) {
      const w = Math.max(c - 1, 0), e = Math.min(c + 1, columns - 1), n = Math.max(r - 1, 0), s = Math.min(r + 1, rows - 1);
      const east = (z[r * columns + e] - z[r * columns + w]) / ((e - w) * cell);
      const north = (z[n * columns + c] - z[s * columns + c]) / ((s - n) * cell);
      const angle = Math.atan(Math.hypot(east, north)) * 180 / Math.PI;
      if (!Number.isFinite(angle)) continue;
      let k = -1;
      while (k + 1 < classes.length && angle >= classes[k + 1].from) k++;
      if (k >= 0) image.data.set([...tints[k], 165], 4 * (r * columns + c));
    }
    brush.putImageData(image, 0, 0);
    return (this._slope = picture);
  }
}

export function canvasOf(width, height) {
  return Object.assign(document.createElement("canvas"), { width, height });
}

export function rgb(hex) {
  return [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16));
}
