/* The search of the site in place of Sphinx's, which has no excerpts of pages that are opened as files: how-to titles
   first, words that mean the same, and the sentence in which they stand. Its pages: search_pages.js. */

const deadwoodSearch = (() => {
  // Words that mean the same here; a query with one of them also finds the others, with less weight.
  const ALIKE = [
    ["house", "building", "hut", "settlement", "haus", "gebäude", "maison", "casa", "line"],
    ["road", "street", "track", "strasse", "straße", "route", "strada", "line"],
    ["railway", "railroad", "rail", "train", "bahn", "line"],
    ["snag", "deadwood", "totholz", "bois mort"],
    ["windthrow", "storm", "windfall", "blowdown", "sturm", "windwurf", "chablis"],
    ["friction", "mu", "coefficient", "reibung", "frottement", "attrito"],
    ["bark", "debarked", "rinde", "écorce", "corteccia"],
    ["wet", "moist", "rain", "nass"],
    ["barrier", "fence", "net", "wall", "verbau"],
    ["embankment", "dam", "berm", "ditch", "damm"],
    ["terrain", "dem", "dtm", "elevation", "height model", "raster"],
    ["dsm", "surface", "canopy", "chm"],
    ["uncertainty", "error", "accuracy", "accurate", "precise", "interval", "confidence"],
    ["fast", "slow", "speed", "long", "time", "performance"],
    ["calibrate", "fit", "observed", "event", "calibration"],
    ["forest", "tree", "stem", "wald", "forêt", "bosco"],
    ["fell", "cut", "clear", "harvest", "felling", "logging"],
    ["energy", "impact", "force", "design", "impulse"],
    ["hazard", "intensity", "danger", "return", "map"],
    ["decay", "rot", "decompose", "years"],
    ["start", "release", "mobilise", "mobilisation", "initiate"],
    ["many", "number", "sample", "count"],
    ["repeat", "reproduce", "reproducible", "manifest", "again"],
    ["format", "file", "shapefile", "geopackage", "csv", "layer"],
    ["crs", "projection", "epsg", "coordinate"],
    ["cluster", "machine", "computer", "parallel", "server"],
    ["install", "installation", "pip", "download", "set up"],
    ["sensitivity", "influence", "influential", "matter", "vary"],
    ["jump", "overjump", "fly", "flight"],
    ["break", "breakage", "snap"],
    ["lidar", "laser", "airborne", "canopy"],
    ["report", "pdf", "word", "print"],
    ["region", "canton", "country"],
    ["preset", "published", "literature", "value"],
  ];
  const EMPTY = new Set("a about an and are as at be by can could did do does for from get has have how i if in into is it its me my of on or out over should than that the their then there they this to use using was we what when where which while who why will with would you your".split(" "));
  const KINDS = [["how-to/", 1.6], ["tutorials/", 1.3], ["start/", 1.2], ["faq", 1.2], ["index.html", 0.5], ["explanation/", 1], ["contribute/", 0.35], ["reference/tools/", 0.5], ["reference/layers/", 0.4], ["", 0.9]];
  const SYNONYM = 0.45, TITLE = 6, HEADING = 3, SUBJECT = 2.5, LONG = 160; // words of a text of usual length
  let index = null, waiting = [];

  const wordsOf = (text) => text.toLowerCase().match(/[\p{L}\p{N}_]+(?:-[\p{L}\p{N}_]+)*/gu)?.flatMap((each) => (each.includes("-") ? [each, ...each.split("-")] : [each])) || [];
  const stem = (word) => (word.length > 4 ? word.replace(/(ations?|ings?|ies|ed|es|s|e|y)$/, "") : word.length > 3 ? word.replace(/s$/, "") : word);
  const alike = new Map();
  for (const group of ALIKE) for (const word of group) for (const other of group) {
    const key = stem(word);
    if (other !== word) (alike.get(key) || alike.set(key, new Set()).get(key)).add(stem(other));
  }
  const countOf = (text) => { const found = new Map(); for (const word of wordsOf(text).map(stem)) found.set(word, (found.get(word) || 0) + 1); return found; };

  function load(pages) {
    const found = [], many = new Map();
    for (const [place, subjects, sections] of pages) {
      const title = sections[0][1], weight = KINDS.find(([start]) => place.startsWith(start))[1], seen = new Set(), about = countOf(subjects);
      const parts = sections.map(([anchor, heading, text], k) => ({ anchor: k ? anchor : "", heading, text, words: countOf(text), size: text.length / 6, named: countOf(heading) }));
      for (const { words, named } of parts) for (const word of [...words.keys(), ...named.keys()]) seen.add(word);
      for (const word of seen) many.set(word, (many.get(word) || 0) + 1);
      found.push({ place, title, weight, titled: countOf(title), about, parts });
    }
    index = { pages: found, many };
    waiting.forEach((each) => each());
  }

  /* The pages that match, best first: each with its best section. Every word of the query counts by how rare it is. */
  function find(query) {
    const asked = [...new Set(wordsOf(query).filter((each) => !EMPTY.has(each)).map(stem))];
    const terms = asked.map((word) => [[word, 1], ...[...(alike.get(word) || [])].filter((each) => !asked.includes(each)).map((each) => [each, SYNONYM])]);
    const rarity = (word) => Math.log(1 + index.pages.length / (0.5 + (index.many.get(word) || 0)));
    const best = (forms, value) => Math.max(0, ...forms.map(([word, weight]) => weight * value(word)));
    const found = [];
    for (const page of index.pages) {
      const titled = terms.map((forms) => best(forms, (word) => rarity(word) * Math.max(page.titled.has(word) ? TITLE / Math.sqrt(page.titled.size) : 0, page.about.has(word) ? SUBJECT : 0)));
      let top = null;
      for (const part of page.parts) {
        const scores = terms.map((forms, k) => titled[k] + best(forms, (word) => {
          const n = part.words.get(word) || 0, dense = n / (n + 0.6 + 0.6 * part.size / LONG);
          return rarity(word) * (dense + (part.named.has(word) ? HEADING / Math.sqrt(part.named.size) : 0));
        }));
        const hit = scores.filter((each) => each > 0).length, score = page.weight * scores.reduce((sum, each) => sum + each, 0) * (hit / terms.length) ** 2;
        if (hit && (!top || score > top.score)) top = { score, part };
      }
      if (top) found.push({ place: page.place, title: page.title, score: top.score, ...top.part, terms });
    }
    return found.sort((a, b) => b.score - a.score);
  }

  /* About 200 characters of a text around the first place where most of the words stand, as nodes. */
  function excerpt({ text, terms }) {
    const words = new Set(terms.flat().map(([word]) => word)), marks = [...text.matchAll(/[\p{L}\p{N}_]+/gu)].filter((each) => words.has(stem(each[0].toLowerCase())));
    const inView = (at) => new Set(marks.filter((each) => each.index >= at && each.index < at + 160).map((each) => stem(each[0].toLowerCase()))).size;
    const first = marks.reduce((most, each) => (inView(each.index) > inView(most) ? each.index : most), marks[0]?.index ?? 0);
    const from = first < 60 ? 0 : text.indexOf(" ", first - 50) + 1, to = text.length - from < 220 ? text.length : text.lastIndexOf(" ", from + 210);
    const out = document.createElement("p");
    let at = from;
    out.append(from ? "… " : "");
    for (const each of marks.filter((one) => one.index >= from && one.index < to)) {
      const mark = document.createElement("mark");
      mark.textContent = each[0];
      out.append(text.slice(at, each.index), mark);
      at = each.index + each[0].length;
    }
    out.append(text.slice(at, to), to < text.length ? " …" : "");
    return out;
  }

  function show(query) {
    const out = document.getElementById("search-results"), list = document.createElement("ul"), head = document.createElement("h2");
    const found = find(query), root = document.documentElement.dataset.content_root || "";
    head.textContent = found.length ? `${found.length} pages about “${query}”` : `No page has any of these words: “${query}”`;
    list.className = "search";
    for (const each of found.slice(0, 30)) {
      const row = document.createElement("li"), link = document.createElement("a");
      link.href = root + each.place + (each.anchor ? `#${each.anchor}` : "");
      link.textContent = each.heading === each.title ? each.title : `${each.title} › ${each.heading}`;
      row.append(link, excerpt(each));
      list.append(row);
    }
    out.replaceChildren(head, list);
  }

  document.addEventListener("DOMContentLoaded", () => { // before Sphinx's own, which is added later
    if (!document.getElementById("search-results") || typeof Search === "undefined") return;
    Search.performSearch = (query) => { if (index) show(query); else waiting.push(() => show(query)); };
    document.body.append(Object.assign(document.createElement("script"), { src: "_static/search_pages.js" }));
  });
  return { load, find };
})();
