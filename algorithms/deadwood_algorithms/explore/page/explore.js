/* State and requests of the page: the release, the changes of the forest, the answers, and the variants shown. */

import { nameOf, showBand, showDifference, showLegend, showReach, showScene, showStops, verdictOf } from "./answers.js";
import { boxOf, differencePicture, hitsPicture } from "./layers.js";
import { connect } from "./link.js";
import { SlopeMap } from "./map.js";
import { drapesOf, Motion, spaceOf } from "./motion.js";
import { numberIn, numeric, showNumber } from "./numbers.js";
import { canvasOf, rgb, Terrain } from "./terrain.js";
import { Hand, toolbar, TOOLS } from "./tools.js";
import { coordinate, count, difference, fill, make, number, say, share, config } from "./words.js";

const REST_MS = 140; // without movement of the pointer, after which more logs are requested
const PATIENCE_MS = 4000; // for a preview without an answer
const FLICKER_MS = 700;
const MOST_FELLED = 100_000;
const MOST_RADIUS = 100; // of the slider [m]
const NOTHING = Object.freeze({ fell: [], plant: [], barriers: [], lying_logs: [] });
const $ = (id) => document.getElementById(id);

fill();
document.title = say("title");
const map = new SlopeMap($("map"), config, say);
const state = {
  scene: null, terrain: null, shape: null, settings: null, edits: NOTHING, past: [], future: [],
  base: null, after: null, mode: "before", flick: 0, asked: 0, full: 0, preview: null, editing: 0, wanted: false, busy: false, band: null, bandId: "", bands: 0,
  startWhenThere: false, motion: null, time: 0, playing: false, posesFor: "", posesId: 0, gapCanvas: null,
};

let connected = false;
const PAUSE_MS = 800; // between two changes of the same kind that are undone one by one
const MOST_PAST = 200;
const MOST_LINK = 20_000; // characters of a link that restores the state

// --- the connection ---------------------------------------------------------------------------------------------------

const link = connect(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}${location.pathname.replace(/[^/]*$/, "")}socket`, {
  answered(message) {
    const work = { scene: opened, hits: hits, difference: differed, band: banded, poses: posed, kept, refused, restarted, took_over }[message.op];
    if (work) work(message);
  },
  changed(how) {
    if (how === "open") { connected = true; warn(""); document.title = say("title");
      $("again").hidden = true; link.send({ op: "open" }); return; }
    connected = false;
    busy(false);
    Object.assign(state, { preview: null, full: 0, editing: 0 });
    document.title = say(how === "elsewhere" ? "title_elsewhere" : "title");
    warn(say(`connection_${how}`), true);
    $("again").hidden = how === "lost";
  },
});
function ask(message) {
  message.id = ++state.asked;
  if (!link.send(message)) { warn(say(connected ? "connection_lost" : "not_connected")); return 0; }
  return message.id;
}

/* An error message; one that stays is not removed by the next answer, only by the user or the next message. */
let staying = false;
function warn(text, stays = false) {
  staying = stays;
  $("alert").hidden = !text;
  $("alert").querySelector("p").textContent = text;
}
function calm() { if (!staying) warn(""); }
function forgive() { staying = false; } // the user continues: the next answer may remove the message
$("alert-close").addEventListener("click", () => warn(""));
let asked_back = false; // the user knows that this page takes over
$("again").addEventListener("click", () => { asked_back = true; link.again(); });
function took_over() { if (!asked_back) warn(say("took_over"), true); asked_back = false; }

function busy(on) {
  state.busy = on;
  document.body.classList.toggle("busy", on);
  $("stage").setAttribute("aria-busy", String(on));
}

// --- the scene --------------------------------------------------------------------------------------------------------

function opened(scene) {
  for (const name of ["lines", "barriers", "lying_logs", "blocks", "fidelities"]) scene[name] ||= [];
  for (const each of scene.lines) each.parts ||= [each.points];
  const { data } = scene, empty = new Float32Array(0);
  for (const name of ["trees_x", "trees_y", "trees_dbh_cm", "trees_height_m"]) data[name] ||= empty;
  const terrain = data.heights?.length ? new Terrain(data.heights, scene.heights_step, scene.extent) : null;
  Object.assign(state, { scene, terrain });
  map.load(scene, terrain);
  if (!state.settings) {
    state.settings = settingsOf(scene);
    restore();
    if (!state.shape && scene.suggested) state.shape = { circle: scene.suggested };
    questions();
    layerBoxes();
  }
  showScene(scene);
  $("open-space").disabled = !terrain;
  refresh();
  askChanges(); // those stored in the page, or none: those of the tool may be from another page
  if (state.shape) full();
}

function settingsOf({ defaults: d = {}, limits = {} }) {
  return {
    n: Math.min(d.n || 300, limits.n_max || 3000), seed: d.seed || 0, fidelity: d.fidelity || "draft", friction: d.friction ?? null,
    rolling_friction: d.rolling_friction ?? 0.1, dbh_cm: pairOf(d.dbh_cm, [30, 80]), length_m: pairOf(d.length_m, [15, 35]),
    density_kg_m3: d.density_kg_m3 ?? 300, orientation: d.orientation || "upright",
  };
}
const pairOf = (given, otherwise) => (Array.isArray(given) ? given.slice() : Number.isFinite(given) ? [given, given] : otherwise);

/* A reload restores the state of the page, as long as the scene is the same. */
const sceneKey = () => JSON.stringify([state.scene.crs, state.scene.origin, state.scene.extent, state.scene.data.trees_x.length]);
function remember() {
  const { shape, settings, edits, mode } = state, text = JSON.stringify({ key: sceneKey(), shape, settings, edits, mode, view: map.view, layers: map.shown });
  try { sessionStorage.setItem("explore", text); } catch { /* a full or forbidden store costs only the memory of a reload */ }
  const code = encodeURIComponent(text);
  history.replaceState(null, "", code.length > MOST_LINK ? location.pathname + location.search : `#${code}`); // the address restores it, too
}
function restore() {
  try {
    const kept = JSON.parse(decodeURIComponent(location.hash.slice(1)) || sessionStorage.getItem("explore") || "null");
    if (!kept || kept.key !== sceneKey()) return;
    Object.assign(state, { shape: kept.shape, settings: { ...state.settings, ...kept.settings }, edits: { ...NOTHING, ...kept.edits }, mode: kept.mode });
    Object.assign(map.shown, kept.layers);
    map.moveTo(kept.view);
  } catch { /* the same */ }
}

// --- asking -----------------------------------------------------------------------------------------------------------

function release(n, preview) {
  const { shape, settings: s } = state;
  return {
    op: "release", shape, n, seed: s.seed, fidelity: s.fidelity, friction: s.friction, rolling_friction: s.rolling_friction, preview,
    logs: { dbh_cm: s.dbh_cm, length_m: s.length_m, density_kg_m3: s.density_kg_m3, orientation: s.orientation },
  };
}

let resting = 0;
/* While the pointer or a slider moves: few logs, one pending request, the newest next; at rest: all of them. */
function preview() {
  clearTimeout(resting);
  resting = setTimeout(full, REST_MS);
  if (!state.shape) return;
  if (state.preview && performance.now() - state.preview.since < PATIENCE_MS) { state.wanted = true; return; }
  askPreview();
}

function askPreview() {
  const id = ask(release(Math.min(30, state.settings.n), true));
  Object.assign(state, { wanted: false, full: 0, editing: 0, preview: id ? { id, since: performance.now() } : null });
  busy(Boolean(id));
}

function full() {
  clearTimeout(resting);
  if (!state.shape || !state.scene) return;
  Object.assign(state, { preview: null, wanted: false, editing: 0 });
  state.full = ask(release(state.settings.n, false));
  busy(Boolean(state.full));
  remember();
}

function edited() { return state.edits.fell.length + state.edits.plant.length + state.edits.barriers.length + state.edits.lying_logs.length > 0; }

/* The changes that apply from now on; the tool answers with the difference, also for each later release. */
function askChanges() {
  state.editing = ask({ op: "edit", ...state.edits });
  if (state.base && edited()) busy(Boolean(state.editing));
}

/* Is this the answer to the latest request, as a preview or in full? */
const isPreviewOf = (answer) => state.preview?.id === answer.id;
const complete = () => Boolean(state.base?.final && !state.base.preview);

function hits(answer) {
  const isPreview = isPreviewOf(answer);
  if (!isPreview && state.full !== answer.id) return;
  const box = boxOf(answer.data.hits, answer.at || [0, 0]);
  const old = state.base?.picture;
  if (state.base?.id !== answer.id) { stopMoving(); noBand(); }
  state.base = {
    ...answer, box, preview: isPreview, shape: state.shape, deposits: depositsOf(answer), edited: false, kind: "hits",
    picture: { picture: hitsPicture(box, answer.done, config.ramp, old?.picture), column: box.column, row: box.row },
  };
  if (!edited()) map.content.holders = holdersOf(answer);
  if (isPreview) answered();
  else if (answer.final && !edited()) settled();
  calm();
  shown();
}

/* A preview is answered: the newest place of the movement is next; the wait for rest continues. */
function answered() {
  state.preview = null;
  busy(state.wanted);
  if (state.wanted) askPreview();
}

/* All logs are listed, with the changes if there are any. */
function settled() {
  busy(false);
  speak();
  askBand();
  if (state.startWhenThere || !$("space").hidden) askPoses();
}

/* The same logs over the plausible friction: asked for when the answer is there, drawn friction by friction. */
function askBand() {
  if (!complete() || !state.scene.lines.length || state.settings.friction === null) return;
  state.bandId = `band ${++state.bands}`; // not among the numbers of requests, whose last one is the answer that is waited for
  link.send({ op: "band", id: state.bandId });
}
function noBand() { Object.assign(state, { band: null, bandId: "" }); }
function banded(answer) {
  if (answer.id !== state.bandId) return;
  state.band = answer;
  showBand(state.scene, answer);
}

const holdersOf = (answer) => (answer.holders || []).filter((each) => each.n > 0).slice(0, 12);

function depositsOf(answer) {
  const { deposits_x: x, deposits_y: y, deposits_reason: reason } = answer.data;
  return x ? { x, y, reason } : null;
}

function forget() { state.after = null; map.content.holders = []; }

function differed(answer) {
  if (!state.base || !edited() || ![state.editing, state.full, state.base.id].includes(answer.id)) return;
  const data = answer.data.hits_after || answer.data.hits, box = boxOf(data, answer.at || [0, 0]), old = state.after;
  answer.lines ||= [];
  answer.fidelity ||= state.base.fidelity;
  const deposits = depositsOf(answer);
  state.after = {
    ...answer, box, deposits, edited: true, kind: "hits", base: state.base, preview: state.base.preview,
    picture: { picture: hitsPicture(box, answer.done, config.ramp, old?.picture.picture), column: box.column, row: box.row },
  };
  if (old?.gap) state.gapCanvas = old.gap.picture.picture;
  map.content.holders = holdersOf(answer);
  if (state.mode === "before") state.mode = "after";
  if (answer.final && !state.base.preview) { state.editing = 0; settled(); }
  calm();
  shown();
}

/* The difference as a variant of the map; made when it is shown. */
function gapOf(after) {
  const { base } = after, picture = differencePicture(base.box, after.box, after.concerned ?? after.done, config.colours, state.gapCanvas);
  return { picture, edited: true, kind: "difference", deposits: after.deposits, moves: movesOf(base.deposits, after.deposits) };
}

/* From the former to the present position of each log that has come to rest elsewhere. */
function movesOf(before, after) {
  const out = [];
  if (!before || !after || before.x.length !== after.x.length) return out;
  for (let k = 0; k < before.x.length; k++) {
    const row = [before.x[k], before.y[k], after.x[k], after.y[k]];
    if (row.every(Number.isFinite) && Math.hypot(row[0] - row[2], row[1] - row[3]) > 2 * state.scene.cell) out.push(row);
  }
  return out;
}

function refused(answer) {
  if (answer.id === state.preview?.id) { state.preview = null; clearTimeout(resting); }
  if (answer.id === state.full) state.full = 0;
  busy(false);
  const changed = Boolean(answer.id) && answer.id === state.editing;
  if (changed) state.editing = 0;
  if (changed && state.past.length) take({ ...now(), edits: state.past.pop().edits }); // an invalid change is not kept
  $("keep").querySelector("button").disabled = !complete();
  if ($("kept").textContent === say("saving")) $("kept").replaceChildren();
  warn(answer.text, changed);
}

function restarted(answer) {
  Object.assign(state, { preview: null, full: 0, editing: 0, wanted: false });
  askChanges();
  full();
  warn(answer.text || say("restarted"), true);
}

// --- changes of the forest ----------------------------------------------------------------------------------------------

function change(next) {
  forgive();
  const limits = state.scene.limits || {}, most = limits.felled_max || MOST_FELLED;
  if (next.fell.length > most) { warn(say("too_many_felled", { n: next.fell.length, most })); return; }
  toUndo("edits");
  take({ ...now(), edits: Object.freeze(next) });
}

/* What undo restores. */
const now = () => ({ edits: state.edits, settings: state.settings, shape: state.shape });
let latest = { kind: "", at: 0 };
/* The state before a change is kept; a movement of the pointer or a slider is one change. */
function toUndo(kind) {
  const at = performance.now(), goes_on = kind !== "edits" && kind === latest.kind && at - latest.at < PAUSE_MS;
  latest = { kind, at };
  if (goes_on) return;
  state.past.push(now());
  if (state.past.length > MOST_PAST) state.past.shift();
  state.future = [];
  canUndo();
}
function canUndo() { $("undo").disabled = !state.past.length; $("redo").disabled = !state.future.length; }

function take(next) {
  const asks = next.settings !== state.settings || next.shape !== state.shape, forest = next.edits !== state.edits;
  Object.assign(state, next);
  latest = { kind: "", at: 0 };
  canUndo();
  if (asks) { questions(); stopMoving(); }
  if (forest) replaced();
  if (asks && state.shape) full();
  else if (asks) { Object.assign(state, { base: null, full: 0 }); forget(); noBand(); busy(false); shown(); remember(); }
}

/* The forest was replaced by another one. */
function replaced() {
  if (!edited()) { forget(); state.mode = "before"; }
  stopMoving();
  noBand();
  refresh();
  remember();
  askChanges();
  if (!state.base) speakText(say("release_first"));
  else if (!edited() && state.base.final) { map.content.holders = holdersOf(state.base); busy(false); askBand(); }
}

function undo() { if (state.past.length) { state.future.push(now()); take(state.past.pop()); } }
function redo() { if (state.future.length) { state.past.push(now()); take(state.future.pop()); } }

const changes = {
  fell(trees) {
    const fresh = trees.filter((each) => !map.felled.has(each));
    if (!fresh.length) { warn(say("no_tree_within")); return; }
    warn("");
    change({ ...state.edits, fell: [...state.edits.fell, ...fresh].sort((a, b) => a - b) });
  },
  toggle(tree) {
    if (map.felled.has(tree)) change({ ...state.edits, fell: state.edits.fell.filter((each) => each !== tree) });
    else changes.fell([tree]);
  },
  plant([x, y]) {
    const dbh_cm = valueOf($("plant-dbh")), height_m = valueOf($("plant-height"));
    if (dbh_cm && height_m) change({ ...state.edits, plant: [...state.edits.plant, { x, y, dbh_cm, height_m }] });
  },
  barrier(points) {
    const height_m = valueOf($("barrier-height"));
    if (height_m) change({ ...state.edits, barriers: [...state.edits.barriers, { points, height_m }] });
  },
  lay(points) {
    const diameter_cm = valueOf($("lay-diameter"));
    if (diameter_cm) change({ ...state.edits, lying_logs: [...state.edits.lying_logs, { points, diameter_cm }] });
  },
};

/* The number in a field; an invalid one is reported and gives NaN. */
function valueOf(field) {
  const value = numberIn(field), wrong = Number.isNaN(value);
  field.setAttribute("aria-invalid", String(wrong));
  if (wrong) warn(say("out_of_range", { low: count(Number(field.dataset.low)), high: count(Number(field.dataset.high)) }));
  return value;
}
for (const field of document.querySelectorAll("#strip input.number")) numeric(field);

const lengthOf = (points) => points.slice(1).reduce((sum, b, k) => sum + Math.hypot(b[0] - points[k][0], b[1] - points[k][1]), 0);

function refresh() {
  const { edits } = state;
  map.felled = new Set(edits.fell);
  map.overview = null;
  map.content.edits = edits;
  canUndo();
  $("no-edits").hidden = edited();
  const without = (kind, k) => () => change({ ...edits, [kind]: edits[kind].filter((_, n) => n !== k) });
  const row = (words, away, name) => make("li", {}, make("span", {}, words), make("button", { type: "button", onclick: away, "aria-label": `${say(name)}: ${words}` }, say(name)));
  const rows = [];
  if (edits.fell.length) rows.push(row(say("felled", { n: edits.fell.length }), () => change({ ...edits, fell: [] }), "stand_again"));
  edits.plant.forEach((each, k) => rows.push(row(say("planted", { dbh: number(each.dbh_cm, 0), height: number(each.height_m, 0) }), without("plant", k), "remove")));
  edits.barriers.forEach((each, k) => rows.push(row(say("barrier_drawn", { length: number(lengthOf(each.points), 0), height: number(each.height_m, 1) }), without("barriers", k), "remove")));
  edits.lying_logs.forEach((each, k) => rows.push(row(say("log_laid", { length: number(lengthOf(each.points), 0), diameter: number(each.diameter_cm, 0) }), without("lying_logs", k), "remove")));
  if (rows.length > 1) rows.push(make("li", {}, make("span"), make("button", { type: "button", onclick: () => change(NOTHING) }, say("all_away"))));
  $("edits").replaceChildren(...rows);
  shown();
}

// --- variants and what is shown -------------------------------------------------------------------------------------------

const MODES = ["before", "after", "difference", "flicker", "beside"];

function setMode(mode) {
  state.mode = mode;
  shown();
  remember();
  if (state.motion && state.posesFor !== posesKey()) stopMoving();
  if (!$("space").hidden || state.startWhenThere) askPoses();
}

/* The variant that the map shows now; with `beside` both. */
function variants() {
  const { base, after, mode } = state, without = base && { ...base, edited: false }, bare = { edited: edited() && mode !== "before" };
  if (!base) return [bare];
  const rather = edited() && mode !== "before";
  if (!after) return [{ ...without, edited: rather }];
  if (mode === "difference") return [after.gap ||= gapOf(after)];
  if (mode === "beside") return [{ ...without, label: say("variant_a") }, { ...after, label: say("variant_b") }];
  if (mode === "flicker") return [state.flick ? { ...after, label: say("variant_b") } : { ...without, label: say("variant_a") }];
  return [mode === "after" ? after : without];
}

setInterval(() => {
  if (state.mode !== "flicker" || !state.after || document.hidden || matchMedia("(prefers-reduced-motion: reduce)").matches) return;
  state.flick = 1 - state.flick;
  map.content.variants = variants();
  map.draw();
}, FLICKER_MS);

function shown() {
  const { scene, base, after, mode } = state;
  if (!scene) return;
  map.content.variants = variants();
  map.content.release = state.shape && { shape: state.shape };
  const seen = mode === "before" || !after ? base : after, doing = seen || base;
  $("counted").textContent = !doing ? say("ask_first") : say(doing.final === false || doing.preview ? "counting" : "counted", {
    done: doing.done, of: doing.preview ? state.settings.n : doing.n, fidelity: doing.fidelity || state.settings.fidelity, ms: number((doing.ms || 0) / 1000, 2),
  });
  const part = doing ? 100 * doing.done / Math.max(1, doing.preview ? state.settings.n : doing.n) : 0;
  $("bar").firstElementChild.style.width = `${part}%`;
  $("bar").setAttribute("aria-valuenow", String(Math.round(part)));
  const both = [base, after].filter(Boolean);
  showReach(scene, both);
  showBand(scene, state.band);
  showStops(both, base?.final && !base.preview ? stillness() : "");
  showDifference(scene, after, { fell: (tree) => changes.fell([tree]), look });
  const on = map.content.variants[0];
  showLegend(scene, state.terrain, map.shown, on?.kind ? on : null, seen);
  $("play").disabled = !complete();
  $("open-space").disabled = !state.terrain;
  $("keep").querySelector("button").disabled = !complete();
  const bar = $("variants");
  bar.hidden = !edited();
  if (!bar.hidden) {
    if (!bar.children.length) bar.append(...MODES.map((each, k) => make("button", { type: "button", "data-mode": each, title: `${say(`mode_${each}`)} (${k + 1})`, "aria-keyshortcuts": String(k + 1), onclick: () => setMode(each) }, say(`mode_${each}`))));
    for (const each of bar.children) each.setAttribute("aria-pressed", String(each.dataset.mode === mode));
  }
  map.draw();
}

/* Why most logs stayed where they were, in words; nothing if they moved. */
function stillness() {
  const { base, settings, terrain } = state, { stayed, done, stopped } = base;
  if (!(stayed > done / 2)) return "";
  const points = base.shape.polygon || [base.shape.circle], middle = [0, 1].map((c) => points.reduce((sum, each) => sum + each[c], 0) / points.length);
  const slope = terrain ? terrain.slopeAt(...middle) : NaN, holds = Math.atan(settings.friction) * 180 / Math.PI;
  const held = ["tree", "barrier", "lying_log"].reduce((sum, each) => sum + (stopped[each] || 0), 0);
  const why = held > done / 2 ? "held" : settings.friction !== null && slope < holds ? "friction" : "unknown";
  return say(`stayed_${why}`, { n: stayed, done, held, friction: count(settings.friction ?? 0), holds: number(holds, 0), slope: Number.isFinite(slope) ? number(slope, 0) : "?" });
}

function look(tree) {
  const { trees_x, trees_y } = state.scene.data;
  closeSpace();
  map.moveTo({ x: trees_x[tree], y: trees_y[tree], scale: Math.max(map.view.scale, 8) });
}

function speakText(text) { $("spoken").textContent = text; }

/* The answer in a sentence, for screen readers. */
function speak() {
  const { base, after, scene } = state;
  const lineOf = (each) => nameOf(scene.lines.find((one) => one.line_id === each.line_id) || each);
  if (after?.final) {
    speakText(after.lines.map((each) => { const { value, interval } = difference(each); return say("difference_described", { line: lineOf(each), value, interval, verdict: say(`verdict_${verdictOf(each)}`) }); }).join(" "));
  } else if (base) {
    speakText(base.reach.map((each) => { const { value, interval } = share(each); return say("reach_described", { line: lineOf(each), value, interval, n: each.n_reach, done: base.done }); }).join(" ") || say("counted_short", { done: base.done }));
  }
}

// --- the pointer's deeds ----------------------------------------------------------------------------------------------------

const act = {
  shape: () => state.shape,
  say: (name) => warn(say(name)),
  hover(at) { where(at); },
  drawing(points, enough) { $("finish").hidden = !enough; $("give-up").hidden = !points; },
  release([x, y], moving) {
    const r = Number($("radius").value);
    forgive();
    toUndo("place");
    state.shape = { circle: [x, y, r] };
    map.content.release = { shape: state.shape };
    map.draw();
    if (moving) preview(); else full();
  },
  resize([x, y], moving) {
    const [cx, cy] = state.shape.circle;
    setRadius(Math.min(Number($("radius").max), Math.max(1, Math.round(Math.hypot(x - cx, y - cy)))), moving);
  },
  rest() { full(); },
  area(points) { toUndo("area"); state.shape = { polygon: points }; shown(); full(); },
  ...changes,
};

const hand = new Hand(map, act);

function setRadius(r, moving) {
  $("radius").value = r;
  $("radius-said").textContent = `${r} m`;
  if (!state.shape?.circle) return;
  toUndo("radius");
  state.shape = { circle: [state.shape.circle[0], state.shape.circle[1], r] };
  map.content.release = { shape: state.shape };
  map.draw();
  if (moving) preview(); else full();
}
$("radius").addEventListener("input", (event) => setRadius(Number(event.target.value), true));
$("finish").addEventListener("click", () => hand.finish());
$("give-up").addEventListener("click", () => hand.cancel());
$("strip").addEventListener("submit", (event) => event.preventDefault());

function choose(tool) {
  hand.choose(tool);
  for (const each of $("tools").querySelectorAll("[data-tool]")) each.setAttribute("aria-pressed", String(each.dataset.tool === tool));
  for (const each of $("strip").querySelectorAll("[data-for]")) each.hidden = each.dataset.for !== tool;
  $("hint").textContent = say(`hint_${tool}`);
  closeSpace();
}

toolbar($("tools"), choose, [
  { name: "undo", path: "M7 4 3 8l4 4M3 8h9a5 5 0 0 1 0 10H8", shortcut: "Ctrl+Z", work: undo },
  { name: "redo", path: "m13 4 4 4-4 4M17 8H8a5 5 0 0 0 0 10h4", shortcut: "Ctrl+Y", work: redo },
]);
choose("circle");

for (const button of $("nearness").querySelectorAll("button")) {
  button.addEventListener("click", () => {
    if (!state.scene) return;
    const pane = map.panes[0], middle = [pane.x + pane.width / 2, map.size[1] / 2];
    if (button.dataset.do === "whole") map.whole();
    else map.glide((part) => map.zoom(1.6 ** (button.dataset.do === "nearer" ? part : -part), ...middle));
  });
}

let pointed = null;
function where(at) {
  pointed = at;
  if (!at || !state.scene || !map.within(...at)) { $("where").textContent = ""; return; }
  const [east, north] = state.scene.origin, z = state.terrain ? state.terrain.at(...at) : NaN;
  const slope = state.terrain ? state.terrain.slopeAt(...at) : NaN;
  $("where").textContent = say(Number.isFinite(slope) ? "where_slope" : Number.isFinite(z) ? "where_height" : "where", { x: coordinate(east + at[0]), y: coordinate(north + at[1]), z: coordinate(z), slope: number(slope, 0) });
}
map.moved = () => { if (map.content.cross) where([map.view.x, map.view.y]); else if (pointed) where(pointed); };

addEventListener("keydown", (event) => {
  const typing = event.target.matches("input:not([type=range], [type=checkbox]), select, textarea");
  const key = event.key.toLowerCase(), command = event.ctrlKey || event.metaKey;
  if (typing || event.altKey) return;
  if (command && key === "z") { if (event.shiftKey) redo(); else undo(); }
  else if (command && key === "y") redo();
  else if (command) return;
  else if (key === "escape" && !$("space").hidden) closeSpace();
  else if (key === "p") play(!state.playing);
  else if (key === "n") another();
  else if (MODES[key - 1] && edited()) setMode(MODES[key - 1]);
  else if (TOOLS.find((each) => each?.key === key)) choose(TOOLS.find((each) => each?.key === key).name);
  else return;
  event.preventDefault();
});

// --- the question's numbers ---------------------------------------------------------------------------------------------------

/* One of the question's numbers is another one. */
function setting(name, value, moving = false) {
  toUndo(name);
  state.settings = { ...state.settings, [name]: value };
  if (moving) preview(); else full();
}
function another() { setting("seed", state.settings.seed + 1); const field = $("q-seed"); if (field) showNumber(field, state.settings.seed); }

function questions() {
  const { scene, settings } = state, { limits = {}, defaults = {} } = scene, form = $("question");
  const field = (id, [low, high], value, more = {}) => {
    const made = numeric(make("input", { type: "text", class: "number", id: `q-${id}`, "data-low": low, "data-high": high, ...more }));
    if (value !== null) showNumber(made, value);
    return made;
  };
  const slider = (name, bounds, step, { at = bounds, likely = Infinity, whole = false } = {}) => {
    const range = make("input", { type: "range", min: at[0], max: at[1], step, value: settings[name] ?? 0.25, "aria-hidden": "true", tabindex: "-1" });
    const typed = field(name, bounds, settings[name], { "data-step": step, "data-whole": whole, placeholder: settings[name] === null ? say("of_layer") : null });
    const doubt = make("p", { class: "doubt", role: "status" });
    const set = (value, moving) => { doubt.replaceChildren(); setting(name, value, moving); };
    const take = (value) => { range.value = value; showNumber(typed, value); set(value, false); };
    range.addEventListener("input", () => { showNumber(typed, Number(range.value)); typed.setAttribute("aria-invalid", "false"); if (name !== "n") set(Number(range.value), true); });
    range.addEventListener("change", () => take(Number(range.value)));
    typed.addEventListener("change", () => {
      const value = valueOf(typed);
      if (Number.isNaN(value)) return;
      warn("");
      if (value <= likely) { take(value); return; }
      const rather = [value / 10, value / 100].find((each) => each <= likely), answer = (each) => make("button", { type: "button", onclick: () => take(each) }, say("use", { value: count(each) }));
      doubt.replaceChildren(say("doubted", { what: say(`q_${name}`), value: count(value), likely: count(likely) }), " ", ...[rather, value].filter(Number.isFinite).flatMap((each) => [answer(each), " "]));
    });
    return make("div", { class: "field" }, make("label", { for: `q-${name}` }, say(`q_${name}`)), range, typed, doubt);
  };
  const between = (name, unit, [low, high]) => {
    const fields = [0, 1].map((k) => field(`${name}-${k}`, [low, high], settings[name][k], { "aria-label": say(k ? "at_most" : "at_least", { what: say(`q_${name}`) }) }));
    const set = () => {
      const pair = fields.map(numberIn), wrong = !(pair[0] <= pair[1]);
      for (const each of fields) each.setAttribute("aria-invalid", String(wrong));
      if (wrong) { warn(say("wrong_range", { low: count(low), high: count(high) })); return; }
      warn("");
      setting(name, pair);
    };
    for (const each of fields) each.addEventListener("change", set);
    return make("div", { class: "field", role: "group", "aria-label": say(`q_${name}`) }, make("span", {}, say(`q_${name}`)), make("span", { class: "between" }, fields[0], make("span", {}, say("to")), fields[1], make("span", {}, unit)));
  };
  const chooser = (name, options) => {
    const select = make("select", { id: `q-${name}` }, ...options.map(([value, words]) => make("option", { value, selected: value === settings[name] }, words)));
    select.addEventListener("change", () => setting(name, select.value));
    return make("div", { class: "field" }, make("label", { for: `q-${name}` }, say(`q_${name}`)), select);
  };
  const seed = field("seed", [0, 999999], settings.seed, { "data-whole": true });
  seed.addEventListener("change", () => { const value = valueOf(seed); if (!Number.isNaN(value)) { warn(""); setting("seed", value); } });
  const orientations = defaults.orientations || ["upright", "lying"];
  const most = limits.n_max || 3000;
  form.replaceChildren(
    slider("n", [30, most], 10, { whole: true }),
    between("dbh_cm", "cm", limits.dbh_cm || [5, 200]),
    between("length_m", "m", limits.length_m || [1, 60]),
    chooser("orientation", orientations.map((each) => [each, say(`posture_${each}`)])),
    slider("friction", [0, limits.friction_max || 1], 0.01, { at: [0, 0.8], likely: limits.friction_likely }),
    slider("rolling_friction", [0, limits.rolling_friction_max || 0.5], 0.01),
    chooser("fidelity", scene.fidelities.length ? scene.fidelities.map((each) => [each.name, say(`fidelity_${each.name}`)]) : [[settings.fidelity, settings.fidelity]]),
    make("div", { class: "field" }, make("label", { for: "q-seed" }, say("q_seed")), seed, make("button", { type: "button", title: `${say("another_draw")} (N)`, onclick: another }, say("another"))),
  );
  $("radius").max = Math.min(limits.radius_max || MOST_RADIUS, MOST_RADIUS);
  const r = state.shape?.circle ? state.shape.circle[2] : Math.min(defaults.radius || 10, Number($("radius").max));
  $("radius").value = r;
  $("radius-said").textContent = `${r} m`;
}
$("question").addEventListener("submit", (event) => event.preventDefault());

function layerBoxes() {
  const there = {
    hits: true, deposits: true, trees: state.scene.data.trees_x.length > 0, barriers: true, lines: state.scene.lines.length > 0,
    holders: state.scene.data.trees_x.length > 0, contours: Boolean(state.terrain), slope: Boolean(state.terrain),
  };
  $("layers").replaceChildren(...Object.keys(there).filter((each) => there[each]).map((name) => {
    const box = make("input", { type: "checkbox", checked: map.shown[name], "data-layer": name });
    box.addEventListener("change", () => { map.shown[name] = box.checked; shown(); remember(); });
    return make("label", {}, box, make("span", {}, say(`layer_${name}`)));
  }));
}

// --- moving logs ---------------------------------------------------------------------------------------------------------------

/* The request, variant and changes to which the poses belong. */
function posesKey() {
  const after = Boolean(state.after) && state.mode !== "before";
  return `${state.full} ${after ? `after ${JSON.stringify(state.edits)}` : "before"}`;
}

function askPoses() {
  if (!complete()) return;
  const wanted = posesKey();
  if (state.posesFor === wanted && state.motion) { moved(); return; }
  state.posesFor = wanted;
  state.posesId = ask({ op: "poses", max: 100, variant: wanted.split(" ")[1] });
}

/* Moving logs of an older request are removed; a playing animation continues when the new ones are there. */
function stopMoving() {
  if (!state.motion) return;
  state.startWhenThere ||= state.playing;
  if (state.playing) play(false);
  Object.assign(state, { motion: null, posesFor: "", posesId: 0 });
  map.content.moving = null;
  $("player").hidden = $("motion-said").hidden = true;
}

function posed(answer) {
  if (answer.id !== state.posesId) return;
  state.motion = new Motion(answer);
  moved();
}

function moved() {
  $("player").hidden = !state.motion;
  $("time").max = state.motion.last;
  if (state.startWhenThere) { state.startWhenThere = false; play(true); }
  setTime(Math.min(state.time, state.motion.last));
  if (!$("space").hidden) fillSpace();
}

function setTime(time) {
  state.time = time;
  $("time").value = time;
  $("clock").textContent = say("seconds", { t: number(time, 1) });
  $("motion-said").hidden = !state.motion || state.motion.edited || !state.after || state.mode === "before";
  map.content.moving = state.motion && { logs: state.motion.at(time), trails: state.motion.trails(), edited: state.motion.edited };
  map.draw();
}

function play(on) {
  if (on && !complete()) { speakText(say("ask_first")); return; }
  if (on && !(state.motion && state.posesFor === posesKey())) { state.startWhenThere = true; state.time = 0; askPoses(); return; }
  state.playing = on;
  $("play").textContent = say(on ? "pause" : "play_logs");
  if (!on) return;
  if (state.time >= state.motion.last) state.time = 0;
  let before = performance.now();
  const tick = (now) => {
    if (!state.playing || !state.motion) return;
    setTime(Math.min(state.motion.last, state.time + Math.min(0.1, (now - before) / 1000) * 4));
    before = now;
    if (state.time >= state.motion.last) play(false); else requestAnimationFrame(tick);
  };
  requestAnimationFrame(tick);
}
$("play").addEventListener("click", () => play(!state.playing));
$("time").addEventListener("input", (event) => { if (state.playing) play(false); setTime(Number(event.target.value)); });

// --- the view in three dimensions ------------------------------------------------------------------------------------------------

let view = null;
async function fillSpace() {
  const variant = map.content.variants[0], rather = Boolean(variant?.edited);
  const drapes = await drapesOf(map, state.terrain, variant);
  if ($("space").hidden) return;
  const scene = spaceOf(state.scene, state.terrain, state.motion, { edits: state.edits, felled: map.felled, edited: rather, deposits: variant?.deposits, drapes, colours: config.colours.solids, endColours: config.stops.map((each) => rgb(each.colour).map((part) => part / 255)), stumpBelow: config.stump_below_m });
  try {
    if (view) view.replace([scene]);
    else view = window.DeadwoodView($("space"), [scene], { play: say("play"), pause: say("pause"), hint: say(matchMedia("(pointer: coarse)").matches ? "pick_hint_fingers" : "pick_hint"), picked: say("picked") });
    if (view) { view.state.pace = Number($("space").querySelector('[data-part="pace"]').value); view.draw(); }
    window.deadwoodView = view;
  } catch (error) {
    $("space").classList.add("nothing");
    warn(say("space_failed", { why: error.message }));
  }
}

function openSpace() {
  if (!state.terrain) return;
  if (state.playing) play(false);
  $("space").hidden = false;
  fillSpace();
  askPoses();
  $("space-close").focus();
}

function closeSpace() {
  if ($("space").hidden) return;
  $("space").hidden = true;
  if (view?.state.playing) $("space").querySelector('[data-part="play"]').click();
  $("open-space").focus();
}
$("open-space").addEventListener("click", openSpace);
$("space-close").addEventListener("click", closeSpace);

// --- saving ------------------------------------------------------------------------------------------------------------------------

$("keep").addEventListener("submit", (event) => {
  event.preventDefault();
  const name = $("keep-name").value.trim();
  if (!name) { warn(say("name_wanted")); $("keep-name").focus(); return; }
  if (!complete()) { warn(say("ask_first")); return; }
  warn("");
  $("keep").querySelector("button").disabled = true;
  $("kept").replaceChildren(make("p", { class: "quiet" }, say("saving")));
  ask({ op: "keep", name });
});

function kept(answer) {
  $("keep").querySelector("button").disabled = false;
  const command = make("pre", { tabindex: "0", "aria-label": say("command") }, answer.command);
  const copy = make("button", { type: "button", onclick: async () => {
    try { await navigator.clipboard.writeText(answer.command); copy.textContent = say("copied"); } catch { getSelection().selectAllChildren(command); copy.textContent = say("copy_by_hand"); }
  } }, say("copy"));
  $("kept").replaceChildren(
    make("p", {}, make("b", {}, say("kept", { name: answer.name }))),
    make("p", { class: "quiet" }, say("kept_files", { files: (answer.files || []).join(", ") })), make("p", { class: "quiet" }, say("repeat_it", { folder: answer.at })), command, copy);
}

/* The map as it is, with the answers below it, as a picture. */
function savePicture() {
  const lines = [$("counted").textContent, ...Array.from($("reach").querySelectorAll(".gauge"), (each) => each.getAttribute("aria-label")), ...Array.from($("difference").querySelectorAll(".gauge"), (each) => each.getAttribute("aria-label"))];
  const source = $("map"), ratio = source.width / source.clientWidth, step = Math.round(20 * ratio), sheet = canvasOf(source.width, source.height + step * (lines.length + 1)), brush = sheet.getContext("2d");
  brush.fillStyle = "#ffffff";
  brush.fillRect(0, 0, sheet.width, sheet.height);
  brush.drawImage(source, 0, 0);
  brush.fillStyle = "#1b1f23";
  brush.font = `${Math.round(13 * ratio)}px system-ui, Arial, sans-serif`;
  lines.forEach((each, k) => brush.fillText(each, step / 2, source.height + (k + 1) * step, sheet.width - step));
  sheet.toBlob((picture) => {
    const address = URL.createObjectURL(picture);
    make("a", { href: address, download: "explore.png" }).click();
    setTimeout(() => URL.revokeObjectURL(address), 1000);
  });
}
$("save-picture").addEventListener("click", savePicture);
$("copy-link").addEventListener("click", async () => {
  remember();
  try { await navigator.clipboard.writeText(location.href); $("copy-link").textContent = say("copied"); } catch { warn(say("link_in_address")); }
});
addEventListener("hashchange", () => location.reload()); // another link was pasted

// --- help --------------------------------------------------------------------------------------------------------------------------

$("keys").append(...[
  ["← ↑ → ↓", "key_pan"], ["+  −  0", "key_zoom"], [say("key_enter"), "key_act"], ["Shift+" + say("key_enter"), "key_finish"], ["Esc", "key_cancel"],
  ...TOOLS.filter(Boolean).map((each) => [each.key.toUpperCase(), `tool_${each.name}`]), ["Ctrl+Z, Ctrl+Y", "key_undo"], ["1–5", "key_modes"], ["N", "another_draw"], ["P", "play_logs"],
].flatMap(([keys, words]) => [make("dt", {}, make("kbd", {}, keys)), make("dd", {}, say(words))]));

shown();
/* For tests, and for use in the console. */
window.deadwoodExplore = { state, map, hand };
