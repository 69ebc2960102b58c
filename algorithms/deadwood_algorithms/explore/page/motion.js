/* The moving logs: their poses by time, drawn on the map, and packed with the scene for the report's 3-D view. */

import { canvasOf } from "./terrain.js";

const MOST_POSES = 60_000; // of the 3-D view, at even times
const STEP_S = 0.1;
const MOST_TREES = 20_000;
const DRAPE = 1024; // pixels, of the longer side
const SCALED = 65535;

/* The logs of an answer: each with its times and poses, and the last of all times. */
export class Motion {
  constructor(answer) {
    const { t, base, tip, offsets, diameter } = answer.data;
    Object.assign(this, { t, base, tip, edited: answer.variant === "after" });
    this.logs = Array.from({ length: Math.max(0, offsets.length - 1) }, (_, k) => ({
      from: offsets[k], to: offsets[k + 1], radii: diameter ? [diameter[k] / 2, diameter[k] / 4] : [0.25, 0.12],
    })).filter((each) => each.to > each.from);
    this.last = this.logs.reduce((most, each) => Math.max(most, t[each.to - 1] - t[each.from]), 0);
  }

  /* Base and tip of a log so long after its start [s]; after its last pose it is at rest. */
  ends(log, time) {
    const { t, base, tip } = this, at = t[log.from] + time;
    let low = log.from, high = log.to - 1;
    if (at >= t[high]) low = high;
    while (high - low > 1) { const middle = (low + high) >> 1; if (t[middle] <= at) low = middle; else high = middle; }
    const next = Math.min(low + 1, log.to - 1), span = t[next] - t[low], part = span > 0 ? Math.min(1, Math.max(0, (at - t[low]) / span)) : 0;
    const out = new Array(6);
    for (let c = 0; c < 3; c++) {
      out[c] = base[3 * low + c] + part * (base[3 * next + c] - base[3 * low + c]);
      out[3 + c] = tip[3 * low + c] + part * (tip[3 * next + c] - tip[3 * low + c]);
    }
    return out;
  }

  at(time) { return this.logs.map((log) => ({ ends: this.ends(log, time), radius: log.radii[0] })); }

  /* The tracks of all logs as one path in map metres. */
  trails() {
    if (this._trails) return this._trails;
    const path = new Path2D(), { base, tip } = this;
    for (const { from, to } of this.logs) for (let k = from; k < to; k++) {
      const x = (base[3 * k] + tip[3 * k]) / 2, y = (base[3 * k + 1] + tip[3 * k + 1]) / 2;
      if (k === from) path.moveTo(x, y); else path.lineTo(x, y);
    }
    return (this._trails = path);
  }
}

/* The scene in the form of the report's view: metres from the middle, heights above the lowest, including `edits`. */
export function spaceOf(scene, terrain, motion, { edits, felled, edited, deposits, drapes, colours, endColours, stumpBelow }) {
  const { columns: nx, rows: ny, cell, z: heights } = terrain, [, , , top] = scene.extent;
  let low = Infinity, high = -Infinity;
  for (const each of heights) if (Number.isFinite(each)) { low = Math.min(low, each); high = Math.max(high, each); }
  const rise = Math.max(high - low, 1), z = new Uint16Array(nx * ny);
  const middle = [nx * cell / 2, top - ny * cell / 2];
  for (let r = 0; r < ny; r++) for (let c = 0; c < nx; c++) {
    const each = heights[(ny - 1 - r) * nx + c];
    z[r * nx + c] = Number.isFinite(each) ? 1 + Math.round((each - low) / rise * 65534) : 0;
  }
  const ground = (x, y) => terrain.at(x, y) - low;
  const rows = (solids) => new Float32Array(solids.filter((each) => each.every(Number.isFinite)).flat()).buffer;
  const onGround = (points, above) => {
    const out = [];
    for (let k = 0; k + 1 < points.length; k++) {
      const [a, b] = [points[k], points[k + 1]], n = Math.max(1, Math.ceil(Math.hypot(b[0] - a[0], b[1] - a[1]) / 2));
      for (let s = k ? 1 : 0; s <= n; s++) {
        const x = a[0] + (b[0] - a[0]) * s / n, y = a[1] + (b[1] - a[1]) * s / n, h = ground(x, y);
        if (Number.isFinite(h)) out.push(x - middle[0], y - middle[1], h + above);
      }
    }
    return new Float32Array(out).buffer;
  };
  const { trees_x, trees_y, trees_dbh_cm, trees_height_m } = scene.data, trees = [], every = Math.max(1, Math.ceil(trees_x.length / MOST_TREES));
  const tree = (x, y, dbh, height) => {
    const foot = ground(x, y), r = dbh / 200;
    trees.push([x - middle[0], y - middle[1], foot, x - middle[0], y - middle[1], foot + height, r, height < stumpBelow ? r : r / 2]);
  };
  for (let k = 0; k < trees_x.length; k += every) {
    if (!edited || !felled.has(k)) tree(trees_x[k], trees_y[k], trees_dbh_cm[k], trees_height_m ? trees_height_m[k] : 20);
  }
  if (edited) for (const each of edits.plant) tree(each.x, each.y, each.dbh_cm, each.height_m);
  const lying = [...(scene.lying_logs || []), ...(edited ? edits.lying_logs : [])].flatMap(({ points, diameter_cm }) => {
    const r = (diameter_cm || 40) / 200;
    return points.slice(1).map((b, k) => {
      const a = points[k];
      return [a[0] - middle[0], a[1] - middle[1], ground(...a) + r, b[0] - middle[0], b[1] - middle[1], ground(...b) + r, r, 0.8 * r];
    });
  });
  const boulders = (scene.blocks || []).flatMap(({ x, y, diameter_m, height_m }) => ball(x - middle[0], y - middle[1], ground(x, y) + (height_m ?? diameter_m) - diameter_m / 2, diameter_m / 2));
  const barriers = [...(scene.barriers || []), ...(edited ? edits.barriers : [])];
  const down = deposits ? Array.from(deposits.x, (x, k) => {
    const y = deposits.y[k], h = ground(x, y) + 0.4;
    return [x - middle[0] - 0.9, y - middle[1], h, x - middle[0] + 0.9, y - middle[1], h, 0.45, 0.45];
  }) : [], ends = deposits ? deposits.reason.filter((_, k) => down[k].every(Number.isFinite)) : new Uint8Array(0);
  const ways = motion ? evenly(motion, [middle[0], middle[1], low]) : { step: STEP_S, low: [0, 0, 0], scale: [1, 1, 1], poses: new Uint16Array(0), speed: new Uint16Array(0), logs: [] };
  return {
    ground: { nx, ny, cell, first: [cell / 2 - middle[0], top - (ny - 0.5) * cell - middle[1]], top: rise, z: z.buffer },
    colours, drapes, end_colours: endColours, ends: Uint8Array.from(ends).buffer, trees: rows(trees), lying: rows(lying), blocks: rows(boulders), deposits: rows(down),
    barriers: barriers.map((each) => ({ feet: onGround(each.points, 0), height: each.height_m || 3 })),
    lines: scene.lines.flatMap((each) => each.parts).map((each) => onGround(each, 0.4)).filter((each) => each.byteLength > 24),
    step: ways.step, low: ways.low, scale: ways.scale, poses: ways.poses.buffer, speed: ways.speed.buffer, logs: ways.logs,
  };
}

/* Poses at even times, in whole steps of the box that holds them, and speeds [cm/s]. */
function evenly(motion, origin) {
  const durations = motion.logs.map((each) => motion.t[each.to - 1] - motion.t[each.from]);
  const step = Math.max(STEP_S, durations.reduce((sum, each) => sum + each, 0) / MOST_POSES), all = [], logs = [];
  motion.logs.forEach((log, k) => {
    const n = Math.floor(durations[k] / step) + 2;
    for (let s = 0; s < n; s++) all.push(motion.ends(log, Math.min(s * step, durations[k])).map((each, c) => each - origin[c % 3]));
    logs.push({ id: k + 1, n, r: log.radii, groups: [] });
  });
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (const each of all) each.forEach((value, c) => { low[c % 3] = Math.min(low[c % 3], value); high[c % 3] = Math.max(high[c % 3], value); });
  const scale = low.map((each, c) => Math.max(high[c] - each, 1e-3) / SCALED), poses = new Uint16Array(all.length * 6), speed = new Uint16Array(all.length);
  all.forEach((each, p) => each.forEach((value, c) => { poses[6 * p + c] = Math.round((value - low[c % 3]) / scale[c % 3]); }));
  let start = 0;
  for (const { n } of logs) {
    for (let s = 0; s + 1 < n; s++) {
      const a = all[start + s], b = all[start + s + 1], far = [0, 1, 2].map((c) => (b[c] + b[c + 3] - a[c] - a[c + 3]) / 2);
      speed[start + s] = Math.min(SCALED, Math.round(100 * Math.hypot(...far) / step));
    }
    start += n;
  }
  return { step, low, scale, poses, speed, logs };
}

/* Texture of the terrain in the 3-D view: the relief from the map's coarse tiles, alone and with the hits over it. */
export async function drapesOf(map, terrain, variant) {
  const { scene } = map, { cell, levels, rows, columns } = scene, size = scene.tile || 256;
  const wide = terrain.columns * terrain.cell, tall = terrain.rows * terrain.cell, ratio = DRAPE / Math.max(wide, tall);
  const picture = canvasOf(Math.round(wide * ratio), Math.round(tall * ratio)), brush = picture.getContext("2d");
  const level = Math.min((levels || 1) - 1, Math.max(0, Math.ceil(-Math.log2(ratio * cell)))), span = size * cell * 2 ** level;
  brush.fillStyle = "#beb9b0";
  brush.fillRect(0, 0, picture.width, picture.height);
  const across = Math.ceil(columns / (size * 2 ** level)), down = Math.ceil(rows / (size * 2 ** level)), tiles = [];
  for (let r = 0; r < down; r++) for (let c = 0; c < across; c++) tiles.push([map.tile(level, c, r), c, r]);
  await Promise.all(tiles.map(([tile]) => tile.decode().catch(() => {})));
  for (const [tile, c, r] of tiles) {
    if (!tile.naturalWidth) continue;
    brush.drawImage(tile, c * span * ratio, r * span * ratio, tile.naturalWidth * cell * 2 ** level * ratio, tile.naturalHeight * cell * 2 ** level * ratio);
  }
  const relief = picture.toDataURL("image/png");
  if (variant?.picture) {
    const { picture: hits, column, row } = variant.picture;
    brush.imageSmoothingEnabled = false;
    brush.drawImage(hits, column * cell * ratio, row * cell * ratio, hits.width * cell * ratio, hits.height * cell * ratio);
  }
  return { relief, hits: picture.toDataURL("image/png") };
}

/* A sphere as truncated cones on top of each other, as the report's view draws boulders. */
function ball(x, y, z, r) {
  const angle = (k) => Math.PI * (k / 6 - 0.5);
  return Array.from({ length: 6 }, (_, k) => [x, y, z + r * Math.sin(angle(k)), x, y, z + r * Math.sin(angle(k + 1)), r * Math.cos(angle(k)), r * Math.cos(angle(k + 1))]);
}
