/* The results beside the map: reach, how logs end, the paired difference, the trees that held most logs, the legend. */

import { difference, make, number, say, share, config } from "./words.js";

const ROUND = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1];
const $ = (id) => document.getElementById(id);

/* The end of the common scale of all bars: the next round share above every interval. */
const roundAbove = (most) => ROUND.find((each) => each >= most) || 1;

/* The error of the fidelity itself, as measured against the finest one, or a note that it was not measured. */
export function errorOf(fidelities, name) {
  if (name === fidelities.at(-1)?.name) return say("error_none", { fidelity: name });
  const found = fidelities.find((each) => each.name === name);
  if (!Number.isFinite(found?.error_points)) return say("error_unknown", { fidelity: name });
  const [value, low, high] = [found.error_points, found.ci_low, found.ci_high].map((each) => number(each, 1, true));
  if (!found.sd) return say("error_known", { fidelity: name, value, low, high });
  const [sd, sd_low, sd_high] = found.sd.map((each) => number(each, 1));
  return say("error_slopes", { fidelity: name, value, low, high, sd, sd_low, sd_high });
}

/* That in the effect of a change, which is a difference of the same logs; nothing where it was not measured. */
function errorOfDifference(fidelities, name) {
  const found = fidelities.find((each) => each.name === name)?.difference;
  if (!found) return "";
  const [value, low, high] = found.map((each) => number(each, 1, true));
  return say("error_difference", { fidelity: name, value, low, high });
}

/* The name of a line; a mere number gets the word for a line before it. */
export function nameOf(line) {
  const name = String(line.name || line.line_id);
  return /^[\d.]+$/.test(name) ? say("line", { id: name }) : name;
}

/* The reach of every line, one bar for each forest, all on one scale. */
export function showReach(scene, answers) {
  const place = $("reach"), several = answers.length > 1;
  if (!scene.lines.length) { place.replaceChildren(make("p", { class: "quiet" }, say("no_lines"))); return; }
  if (!answers.length) { place.replaceChildren(make("p", { class: "quiet" }, say("no_answer_yet"))); return; }
  const top = roundAbove(Math.max(...answers.flatMap((each) => each.reach).map((each) => each.ci_high), 0.01));
  const bar = (answer, name, each) => {
    const { value, interval } = share(each), line = nameOf(name), words = say("reach_described", { line, value, interval, n: each.n_reach, done: answer.done });
    const gauge = make("div", { class: "gauge", role: "img", "aria-label": several ? `${variantOf(answer)}. ${words}` : words },
      make("i", { class: answer.edited ? "after" : "before", style: { width: `${100 * each.p / top}%` } }),
      make("u", { style: { left: `${100 * each.ci_low / top}%`, width: `${100 * (each.ci_high - each.ci_low) / top}%` } }));
    const said = make("div", { class: "ci" }, say("reach_said", { interval, reached: each.n_reach, done: answer.done }));
    const named = make("div", { class: "named" }, several ? make("span", { class: "variant" }, variantOf(answer)) : make("b", {}, line), make("span", { class: "value" }, value));
    return [named, gauge, said];
  };
  const rows = answers[0].reach.map(({ line_id }) => {
    const name = scene.lines.find((one) => one.line_id === line_id) || { line_id };
    const bars = answers.flatMap((answer) => bar(answer, name, answer.reach.find((each) => each.line_id === line_id)));
    return make("div", { class: "line" }, ...(several ? [make("b", {}, nameOf(name))] : []), ...bars, scaleTo(top));
  });
  place.replaceChildren(...rows, make("p", { class: "quiet" }, errorOf(scene.fidelities, answers[0].fidelity)));
}

const variantOf = ({ edited }) => say(edited ? "variant_b" : "variant_a");
const scaleTo = (top) => make("div", { class: "scale", "aria-hidden": "true" }, ...[0, 0.5, 1].map((each) => make("span", {}, say("percent", { p: number(100 * each * top, top < 0.02 ? 1 : 0) }))));

/* Reach against friction, with its interval, in both forests; the friction of the question is marked. */
export function showBand(scene, band) {
  const place = $("band");
  if (!band || band.lines[0].before.points.length < 2) { place.replaceChildren(); return; }
  const every = band.lines.flatMap((each) => [each.before, each.after].filter(Boolean)).flatMap((each) => [...each.points, ...each.postures]);
  const top = roundAbove(Math.max(0.01, ...every.map((each) => each.ci_high)));
  const lines = band.lines.map((each) => {
    const words = bandWords(band, each);
    return make("div", { class: "line" }, make("div", { class: "named" }, make("b", {}, nameOf(scene.lines.find((one) => one.line_id === each.line_id) || each))),
      bandChart(band, each, top, words.join(" ")), ...words.map((text, k) => make("div", { class: each.effect && k + 1 === words.length ? "verdict" : "ci" }, text)));
  });
  place.replaceChildren(make("h3", {}, say("band")), ...lines, make("p", { class: "quiet" }, say(band.final ? "band_paired" : "band_going_on", { n: band.n })));
}

const friction = (value) => String(Number(value.toFixed(3)));

function bandWords(band, { before, after, effect, effect_in_posture }) {
  const ranges = [[before, "A"], [after, "B"]].filter(([each]) => each).map(([each, name]) => {
    const [from, to] = each.frictions.map(friction), own = each.points.find((point) => point.friction === band.friction);
    const variant = after ? say("band_variant", { name }) : "", others = each.postures.map((other) => say("band_posture", { posture: capital(say(`posture_${other.posture}`)), value: share(other).value }));
    return capital(say(each.low === each.high ? "band_alike" : "band_range", { variant, low: each.low, high: each.high, from, to, own: friction(band.friction), value: share(own).value })) + others.join("");
  });
  if (!effect) return ranges;
  const shown = ["less", "more", "chance"].filter((way) => effect[way].length);
  const over = shown.length === 1 ? say(`effect_${shown[0]}`) : shown.map((way) => say(`effect_some_${way}`, { at: effect[way].map(friction).join(", ") })).join(" ");
  return [...ranges, [over, ...effect_in_posture.map((each) => capital(say(`effect_posture_${each.effect}`, { posture: say(`posture_${each.posture}`) })))].join(" ")];
}
const capital = (text) => text[0].toUpperCase() + text.slice(1);

function bandChart(band, { before, after }, top, words) {
  const [wide, high, left, low] = [340, 130, 40, 22], svg = (name, attributes, ...children) => {
    const made = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    made.append(...children);
    return made;
  };
  const [from, to] = before.frictions, x = (value) => left + 8 + (wide - left - 28) * (value - from) / (to - from);
  const y = (value) => 8 + (high - low - 8) * (1 - value / top), at = (points, name) => points.map((each) => `${x(each.friction).toFixed(1)},${y(each[name]).toFixed(1)}`);
  const curve = (variant, name, { points, postures }) => [
    svg("polygon", { class: `${name} interval`, points: [...at(points, "ci_low"), ...at(points, "ci_high").reverse()].join(" ") }),
    svg("polyline", { class: name, points: at(points, "p").join(" ") }),
    ...points.map((each) => svg("circle", { class: name, cx: x(each.friction), cy: y(each.p), r: 2.5 })),
    ...postures.map((each) => svg("circle", { class: `${name} other`, cx: x(each.friction), cy: y(each.p), r: 4.5 })),
    ...(after ? [svg("text", { x: wide - 15, y: y(points.at(-1).p) + 4 }, variant)] : []),
  ];
  const ticks = [0, top / 2, top].map((value) => svg("g", {}, svg("line", { class: "grid", x1: left, x2: wide - 18, y1: y(value), y2: y(value) }),
    svg("text", { x: left - 4, y: y(value) + 4, "text-anchor": "end" }, say("percent", { p: number(100 * value, top < 0.02 ? 1 : 0) }))));
  const marks = before.points.map((each) => svg("text", { x: x(each.friction), y: high - 6, "text-anchor": "middle", class: each.friction === band.friction ? "own" : "" }, friction(each.friction)));
  return svg("svg", { class: "band", viewBox: `0 0 ${wide} ${high}`, role: "img", "aria-label": words }, ...ticks,
    svg("line", { class: "own", x1: x(band.friction), x2: x(band.friction), y1: 4, y2: high - low }), ...marks,
    ...curve("A", "before", before), ...(after ? curve("B", "after", after) : []));
}

/* How the logs ended, one bar for each forest, and why they stayed where they were, if they did. */
export function showStops(answers, stillness) {
  const place = $("stops");
  if (!answers.length) { place.replaceChildren(); return; }
  const there = config.stops.filter(({ reason }) => answers.some(({ stopped }) => stopped[reason]));
  const part = ({ stopped, done }, { reason }) => 100 * (stopped[reason] || 0) / done;
  place.replaceChildren(
    make("h3", {}, say("endings")), ...(stillness ? [make("p", { class: "stillness" }, stillness)] : []),
    ...answers.map((answer) => make("div", { class: "ended", "aria-hidden": "true" }, ...(answers.length > 1 ? [make("span", {}, answer.edited ? "B" : "A")] : []),
      make("div", { class: "stacked" }, ...there.map((each) => make("i", { style: { width: `${part(answer, each)}%`, background: each.colour } }))))),
    make("ul", { class: "keys" }, ...there.map((each) => make("li", {}, signOf(each), make("span", {}, each.label), make("b", {}, answers.map((answer) => say("percent", { p: number(part(answer, each), 0) })).join(" → "))))));
}

/* The symbol of a way to end, as on the map. */
export function signOf({ shape, colour }) {
  const box = document.createElementNS("http://www.w3.org/2000/svg", "svg"), path = document.createElementNS(box.namespaceURI, "path");
  const ways = { triangle: "M7 1 13 12H1z", square: "M2 2h10v10H2z", cross2: "M2 2l10 10M12 2 2 12" };
  box.setAttribute("viewBox", "0 0 14 14");
  box.setAttribute("aria-hidden", "true");
  path.setAttribute("d", ways[shape] || "M7 2a5 5 0 1 0 0.01 0z");
  path.style.fill = shape === "cross2" ? "none" : colour;
  path.style.stroke = shape === "cross2" ? "currentColor" : "none";
  box.append(path);
  return box;
}

export const verdictOf = (each) => (each.ci_low > 0 ? "more" : each.ci_high < 0 ? "less" : "chance");

export function showDifference(scene, answer, { fell, look }) {
  const place = $("difference");
  if (!answer) { place.replaceChildren(); return; }
  const far = roundAbove(Math.max(0.01, ...answer.lines.flatMap((each) => [Math.abs(each.ci_low), Math.abs(each.ci_high)])));
  const at = (value) => 50 + 50 * Math.max(-1, Math.min(1, value / far));
  const lines = answer.lines.map((each) => {
    const line = scene.lines.find((one) => one.line_id === each.line_id) || each, { value, interval } = difference(each), verdict = verdictOf(each);
    const [from, to] = [Math.min(at(0), at(each.difference)), Math.max(at(0), at(each.difference))];
    const words = say("difference_described", { line: nameOf(line), value, interval, verdict: say(`verdict_${verdict}`) });
    const share = (n) => say("percent", { p: number(100 * n / answer.done, 1) });
    return make("div", { class: "line" },
      make("div", { class: "named" }, make("b", {}, nameOf(line)), make("span", { class: "value" }, value)),
      make("div", { class: "gauge two", role: "img", "aria-label": words },
        make("i", { class: verdict, style: { left: `${from}%`, width: `${to - from}%` } }), make("s", { style: { left: "50%" } }),
        make("u", { style: { left: `${at(each.ci_low)}%`, width: `${at(each.ci_high) - at(each.ci_low)}%` } })),
      make("div", { class: "ci" }, `${interval} · ${share(each.before)} → ${share(each.after)}`),
      make("div", { class: `verdict ${verdict}` }, say(`verdict_${verdict}`)),
      make("div", { class: "pair" }, make("span", {}, say("lost", { n: each.lost })), make("span", {}, say("gained", { n: each.gained }))));
  });
  const error = answer.lines.some((each) => each.difference) ? errorOfDifference(scene.fidelities, answer.fidelity) : "";
  const note = make("p", { class: "quiet" }, `${say("paired_note", { concerned: answer.concerned, done: answer.done })} ${error}`);
  const held = (answer.holders || []).filter((each) => each.n > 0 && each.tree < scene.data.trees_x.length).slice(0, 5);
  const holders = held.length ? [
    make("p", { class: "quiet" }, say("holders_note")),
    make("ul", { class: "holders" }, ...held.map(({ tree, n }) => make("li", {},
      make("span", {}, say("holder", { n, dbh: number(scene.data.trees_dbh_cm[tree], 0) })),
      make("span", {}, make("button", { type: "button", onclick: () => look(tree) }, say("show")), " ", make("button", { type: "button", onclick: () => fell(tree) }, say("fell_it"))))))] : [];
  place.replaceChildren(...lines, note, ...holders);
}

/* The meaning of the colours on the map, for how many logs and at which fidelity. */
export function showLegend(scene, terrain, shown, variant, answer) {
  const parts = [], done = answer ? say("legend_logs", { done: answer.done, fidelity: answer.fidelity }) : "";
  if (shown.hits && variant?.kind === "hits" && answer) {
    const ramp = make("canvas", { class: "ramp", width: 64, height: 1, "aria-hidden": "true" }), brush = ramp.getContext("2d");
    config.ramp.forEach(({ colour }, k) => { brush.fillStyle = colour; brush.fillRect(64 * k / config.ramp.length, 0, 64 / config.ramp.length + 1, 1); });
    parts.push(make("div", {}, make("div", {}, `${say("legend_hits")} (${done})`), ramp,
      make("div", { class: "scale" }, ...[0, 1, 2, 3].map((k) => make("span", {}, say("percent", { p: String(100 * config.ramp[k * (config.ramp.length - 1) / 3].share) }))))));
  }
  if (shown.hits && variant?.kind === "difference" && answer) {
    const { less, more, chance } = config.colours;
    const all = [[less[1], "legend_fewer_2"], [less[0], "legend_fewer"], [chance, "legend_chance"], [more[0], "legend_more"], [more[1], "legend_more_2"]];
    parts.push(make("div", {}, make("div", {}, `${say("legend_difference")} (${done})`),
      make("div", { class: "swatches" }, ...all.map(([colour, word]) => make("span", {}, make("i", { style: { background: colour } }), say(word)))),
      make("p", { class: "quiet" }, say("legend_difference_note"))));
  }
  if (shown.slope && terrain) {
    const bounds = config.slope.map(({ from, colour }, k) => make("span", {}, make("i", { style: { background: colour } }), k + 1 < config.slope.length ? `${from}–${config.slope[k + 1].from}°` : `> ${from}°`));
    parts.push(make("div", {}, say("legend_slope", { cell: number(terrain.cell, terrain.cell < 10 ? 1 : 0) }), make("div", { class: "swatches" }, ...bounds)));
  }
  if (shown.contours && terrain) parts.push(make("div", { class: "quiet" }, say("legend_contours", { step: terrain.step })));
  document.getElementById("legend").replaceChildren(...parts);
}

export function showScene(scene) {
  const [, , w, h] = scene.extent, size = (metres) => number(metres, 0);
  document.getElementById("scene-said").textContent = say("scene_said", {
    wide: size(w), tall: size(h), cell: number(scene.cell, scene.cell % 1 ? 1 : 0), n: scene.data.trees_x.length, crs: scene.crs || say("no_crs"),
  });
  const warnings = document.getElementById("warnings");
  warnings.replaceChildren(...scene.warnings.map(({ text }) => make("li", {}, text)));
  warnings.hidden = !scene.warnings.length;
}
