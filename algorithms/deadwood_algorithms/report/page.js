/* Interactive parts of the page: the maps' layers, zoom and coordinates under the pointer; and the 3-D view. */
"use strict";

(function () {
  const config = JSON.parse(document.getElementById("report-data").textContent);

  for (const map of document.querySelectorAll(".map")) {
    const svg = map.querySelector("svg"), where = map.querySelector(".where");
    const whole = svg.getAttribute("viewBox").split(/\s+/).map(Number);
    let box = whole.slice();
    const set = () => svg.setAttribute("viewBox", box.map((each) => each.toFixed(2)).join(" "));
    for (const check of map.querySelectorAll("input[data-layer]")) {
      const parts = svg.querySelectorAll(`[id="${check.dataset.layer}"], [id="${check.dataset.layer}_rim"], `
        + `[id="${check.dataset.layer}_key"], [id="${check.dataset.layer}_word"]`); // and its entry of the legend
      const show = () => { for (const each of parts) each.style.display = check.checked ? "" : "none"; };
      check.addEventListener("change", show);
      show();
    }
    const at = (event) => {
      const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
      return [point.x, point.y];
    };
    const zoom = (factor, [x, y]) => {
      const size = Math.min(1, Math.max(0.02, box[2] * factor / whole[2]));
      const next = [whole[2] * size, whole[3] * size];
      box = [x - (x - box[0]) * next[0] / box[2], y - (y - box[1]) * next[1] / box[3], ...next];
      if (size === 1) box = whole.slice();
      set();
    };
    const middle = () => [box[0] + box[2] / 2, box[1] + box[3] / 2];
    map.querySelector('[data-part="in"]').addEventListener("click", () => zoom(0.6, middle()));
    map.querySelector('[data-part="out"]').addEventListener("click", () => zoom(1 / 0.6, middle()));
    map.querySelector('[data-part="reset"]').addEventListener("click", () => { box = whole.slice(); set(); });
    svg.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && box[2] === whole[2] && event.deltaY > 0) return; // the page continues to scroll
      event.preventDefault();
      zoom(Math.exp(event.deltaY * 0.0015), at(event));
    }, { passive: false });
    let held = null;
    svg.addEventListener("pointerdown", (event) => { held = at(event); });
    addEventListener("pointerup", () => { held = null; });
    const frame = map.dataset.frame.split(" ").map(Number), extent = map.dataset.extent.split(" ").map(Number);
    svg.addEventListener("pointermove", (event) => {
      const [x, y] = at(event);
      if (held && box[2] < whole[2]) { box = [box[0] + held[0] - x, box[1] + held[1] - y, box[2], box[3]]; set(); }
      const u = (x - frame[0]) / frame[2], v = (y - frame[1]) / frame[3];
      const inside = u >= 0 && u <= 1 && v >= 0 && v <= 1;
      where.textContent = inside
        ? `${(extent[0] + u * (extent[2] - extent[0])).toFixed(0)}, ${(extent[3] - v * (extent[3] - extent[1])).toFixed(0)}` : "";
    });
  }

  const root = document.querySelector(".space");
  if (root && config.space && config.space.length) {
    try {
      window.deadwoodView = window.DeadwoodView(root, config.space, config.words);
    } catch (error) {
      root.classList.add("nothing");
      root.querySelector(".missing").textContent += ` (${error.message})`;
    }
  }
})();
