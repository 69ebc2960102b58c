/* The page's words and numbers in its language; the words come with the page. */

export const config = JSON.parse(document.getElementById("config").textContent);
const language = config.language || "en";
document.documentElement.lang = language;

/* A phrase with its gaps filled; with n = 1 the singular phrase, if there is one. */
export function say(name, gaps = {}) {
  const phrase = gaps.n === 1 && config.words[`${name}_one`] !== undefined ? config.words[`${name}_one`] : config.words[name];
  if (phrase === undefined) return name;
  return phrase.replace(/\{(\w+)\}/g, (gap, key) => (key in gaps ? (typeof gaps[key] === "number" ? count(gaps[key]) : gaps[key]) : gap));
}

export function sayOr(name, otherwise) { return config.words[name] === undefined ? otherwise : config.words[name]; }

const formats = new Map();
export function number(value, digits, signed = false) {
  const key = `${digits} ${signed}`;
  if (!formats.has(key)) {
    formats.set(key, new Intl.NumberFormat(language, {
      minimumFractionDigits: digits, maximumFractionDigits: digits, signDisplay: signed ? "exceptZero" : "negative",
    }));
  }
  return formats.get(key).format(value).replace("-", "−");
}
/* A coordinate as maps have it: thin spaces, no commas. */
export const coordinate = (value) => String(Math.round(value)).replace(/\B(?=(\d{3})+$)/g, "\u2009");
export const count = (value) => number(value, Number.isInteger(value) ? 0 : 2);

/* Number of decimals justified by an interval of that width [points]. */
const digitsOf = (width) => (width >= 10 ? 0 : width >= 0.5 ? 1 : 2);

export function share({ p, ci_low, ci_high }) {
  const digits = digitsOf(100 * (ci_high - ci_low));
  return {
    value: say("percent", { p: number(100 * p, digits) }),
    interval: say("interval", { low: number(100 * ci_low, digits), high: number(100 * ci_high, digits) }),
  };
}

export function difference({ difference: d, ci_low, ci_high }) {
  const digits = digitsOf(100 * (ci_high - ci_low));
  return {
    value: say("points", { d: number(100 * d, digits, true) }),
    interval: say("interval_points", { low: number(100 * ci_low, digits, true), high: number(100 * ci_high, digits, true) }),
  };
}

/* Fills all that carries data-say and data-label. */
export function fill(root = document) {
  for (const each of root.querySelectorAll("[data-say]")) each.textContent = say(each.dataset.say);
  for (const each of root.querySelectorAll("[data-label]")) {
    each.setAttribute("aria-label", say(each.dataset.label));
    if (each.tagName === "BUTTON") each.title = say(each.dataset.label);
  }
}

/* An element with attributes and children; text stays text. */
export function make(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
    else if (key === "style") Object.assign(made.style, value);
    else if (value !== null && value !== undefined && value !== false) made.setAttribute(key, value === true ? "" : value);
  }
  made.append(...children.filter((each) => each !== null && each !== undefined));
  return made;
}
