/* Fields for numbers as people type them: with a decimal point or a decimal comma, and shown as they were understood. */

/* The number that a text means; NaN if it is none. Of a whole number, marks before three digits are of thousands. */
export function understood(text, whole = false) {
  const plain = text.trim().replace(/−/g, "-").replace(/[\s'’]/g, "");
  const number = whole ? plain.replace(/[.,](?=\d{3}(?:[.,]|$))/g, "") : plain;
  const found = /^[+-]?(\d+[.,]?\d*|[.,]\d+)(e[+-]?\d+)?$/i.test(number) ? Number(number.replace(",", ".")) : NaN;
  return whole && !Number.isInteger(found) ? NaN : found;
}

/* The number in a field, within the bounds that it has (data-low, data-high); NaN if there is none. */
export function numberIn(field) {
  const value = understood(field.value, "whole" in field.dataset);
  return value >= Number(field.dataset.low) && value <= Number(field.dataset.high) ? value : NaN;
}

export function showNumber(field, value) {
  field.value = String(Number(value.toPrecision(12))).replace(".", (0.5).toLocaleString(document.documentElement.lang)[1]);
}

/* Makes a text field with bounds one for numbers: what was typed is shown as understood, the arrow keys change it. */
export function numeric(field) {
  field.inputMode = "whole" in field.dataset ? "numeric" : "decimal";
  field.autocomplete = "off";
  field.addEventListener("change", () => { const value = numberIn(field); if (!Number.isNaN(value)) showNumber(field, value); });
  field.addEventListener("keydown", (event) => {
    const way = { ArrowUp: 1, ArrowDown: -1 }[event.key], value = numberIn(field), { low, high, step = 1 } = field.dataset;
    if (!way || Number.isNaN(value)) return;
    event.preventDefault();
    showNumber(field, Math.min(Number(high), Math.max(Number(low), value + way * Number(step))));
    field.dispatchEvent(new Event("change"));
  });
  return field;
}
