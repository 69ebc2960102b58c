/* The 3-D view of a run, in WebGL 2, without any library.

   Why our own: k3d's standalone build is 2.7 MB of a 6 MB page, plotly's gl3d 1.75 MB without instanced solids, so that
   20 000 trees are 20 000 traces or one mesh of millions of triangles; three.js no longer ships a classic script, and a
   module cannot be loaded from file://; deck.gl wants a network for its tiles. What is needed here is little: a height
   grid with a picture on it, truncated cones by instance (trees, logs), plates, ribbons, one light, an orbiting camera.

   x is east, y north, z up, in metres. A solid is eight numbers: base xyz, tip xyz, base radius, tip radius. */
"use strict";

(function () {
  const SIDES = 14, ANGLE = 0.8, FILLED = 0.94; // of a solid; of the view [rad]; of the picture, at first
  const CROWNED = 5, VEIL = 0.22; // [m] trees from this height on have a crown; its opacity
  const WIDE = { trees: 0.1, moving: 2.4, deposits: 1.2 }; // least radius of solids [pixels]
  const FOLLOWED = [1.0, 0.9, 0.1], TRAIL = [1.0, 1.0, 1.0];

  const spoken = (value) => value.toLocaleString(document.documentElement.lang, { minimumFractionDigits: 1, maximumFractionDigits: 1 });
  /* An array as stored in a page (base64), or as passed by a script (its buffer). */
  const bytes = (given) => (typeof given === "string" ? Uint8Array.from(atob(given), (c) => c.charCodeAt(0)).buffer : given);
  const floats = (text) => new Float32Array(bytes(text));
  const shorts = (text) => new Uint16Array(bytes(text));

  // --- small algebra; matrices in column order -----------------------------------------------------------------------

  const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const unit = (a) => { const n = Math.hypot(...a) || 1; return a.map((each) => each / n); };

  function times(a, b) {
    const out = new Float32Array(16);
    for (let c = 0; c < 4; c++) for (let r = 0; r < 4; r++) {
      let sum = 0;
      for (let k = 0; k < 4; k++) sum += a[k * 4 + r] * b[c * 4 + k];
      out[c * 4 + r] = sum;
    }
    return out;
  }

  function perspective(angle, aspect, near, far) {
    const f = 1 / Math.tan(angle / 2);
    return [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, 2 * far * near / (near - far), 0];
  }

  function looking(eye, at) {
    const back = unit(sub(eye, at)), right = unit(cross([0, 0, 1], back)), up = cross(back, right);
    return [right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0,
      -dot(right, eye), -dot(up, eye), -dot(back, eye), 1];
  }

  // --- programs --------------------------------------------------------------------------------------------------

  const LIGHT = `
    vec3 lit(vec3 colour, vec3 normal) {
      float sun = max(dot(normalize(normal), normalize(vec3(-0.5, 0.35, 0.8))), 0.0);
      return colour * (0.62 + 0.5 * sun);
    }`;
  const GROUND = [`#version 300 es
    in vec3 place; in vec2 at; uniform mat4 see; out vec2 uv;
    void main() { uv = at; gl_Position = see * vec4(place, 1.0); }`, `#version 300 es
    precision highp float; in vec2 uv; uniform sampler2D drape; out vec4 colour;
    void main() { colour = vec4(texture(drape, uv).rgb, 1.0); }`];
  const SOLID = [`#version 300 es
    in vec3 shape; in vec3 base; in vec3 tip; in vec2 radii; in vec3 tint; uniform mat4 see; uniform float pixel;
    out vec3 normal; out vec3 shade;
    void main() {
      vec3 along = tip - base; float size = max(length(along), 1e-6); along /= size;
      vec3 side = normalize(cross(along, abs(along.z) < 0.9 ? vec3(0, 0, 1) : vec3(1, 0, 0)));
      vec3 out_ = cos(shape.x) * side + sin(shape.x) * cross(along, side);
      float end = step(0.5, shape.y), thick = mix(radii.x, radii.y, end);
      if (thick > 0.0) thick = max(thick, pixel * (see * vec4(mix(base, tip, end), 1.0)).w); // still visible from afar
      vec3 place = mix(base, tip, end) + out_ * (shape.z == 1.0 ? 0.0 : thick);
      normal = shape.z == 0.0 ? out_ : along * (end * 2.0 - 1.0);
      shade = tint; gl_Position = see * vec4(place, 1.0);
    }`, `#version 300 es
    precision highp float; in vec3 normal; in vec3 shade; uniform float dense; out vec4 colour; ${LIGHT}
    void main() { colour = vec4(lit(shade, normal), dense); }`];
  const PLAIN = [`#version 300 es
    in vec3 place; uniform mat4 see; void main() { gl_Position = see * vec4(place, 1.0); gl_Position.z -= 0.0004 * gl_Position.w; }`,
  `#version 300 es
    precision highp float; uniform vec4 paint; out vec4 colour; void main() { colour = paint; }`];

  function program(gl, [vertex, fragment]) {
    const made = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(made, shader);
    }
    gl.linkProgram(made);
    if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
    return made;
  }

  function attribute(gl, made, name, data, size, { stride = 0, offset = 0, every = 0, buffer = null } = {}) {
    const place = gl.getAttribLocation(made, name);
    if (place < 0) return null;
    const held = buffer || gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, held);
    if (data) gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, size, gl.FLOAT, false, stride, offset);
    gl.vertexAttribDivisor(place, every);
    return held;
  }

  // --- meshes ----------------------------------------------------------------------------------------------------

  function ground(gl, made, spec) {
    const { nx, ny, cell, first, top } = spec, z = shorts(spec.z);
    const place = new Float32Array(nx * ny * 3), at = new Float32Array(nx * ny * 2), index = [];
    for (let j = 0; j < ny; j++) for (let i = 0; i < nx; i++) {
      const k = j * nx + i;
      place.set([first[0] + i * cell, first[1] + j * cell, (z[k] - 1) / 65534 * top], k * 3);
      at.set([(i + 0.5) / nx, 1 - (j + 0.5) / ny], k * 2);
      const inside = i + 1 < nx && j + 1 < ny && z[k] && z[k + 1] && z[k + nx] && z[k + nx + 1];
      if (inside) index.push(k, k + 1, k + nx, k + 1, k + nx + 1, k + nx);
    }
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    attribute(gl, made, "place", place, 3);
    attribute(gl, made, "at", at, 2);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint32Array(index), gl.STATIC_DRAW);
    return { array, count: index.length };
  }

  /* A cone's corners as (angle, end, kind): kind 0 the lateral surface, 1 the middle of a lid, 2 the rim of a lid. */
  function cone() {
    const out = [];
    for (let k = 0; k < SIDES; k++) {
      const a = 2 * Math.PI * k / SIDES, b = 2 * Math.PI * (k + 1) / SIDES;
      out.push(a, 0, 0, b, 0, 0, a, 1, 0, b, 0, 0, b, 1, 0, a, 1, 0);
      for (const end of [0, 1]) out.push(0, end, 1, a, end, 2, b, end, 2);
    }
    return new Float32Array(out);
  }

  function solids(gl, made, rows, tints) {
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    attribute(gl, made, "shape", cone(), 3);
    const buffer = attribute(gl, made, "base", rows, 3, { stride: 32, every: 1 });
    attribute(gl, made, "tip", null, 3, { stride: 32, offset: 12, every: 1, buffer });
    attribute(gl, made, "radii", null, 2, { stride: 32, offset: 24, every: 1, buffer });
    const tint = attribute(gl, made, "tint", tints, 3, { every: 1 });
    return { array, buffer, tint, count: rows.length / 8 };
  }

  function tinted(count, colour) {
    const out = new Float32Array(count * 3);
    for (let k = 0; k < count; k++) {
      const lighter = 0.85 + 0.3 * ((k * 0.618) % 1); // so that neighbours can be distinguished
      out.set(colour.map((each) => Math.min(1, each * lighter)), k * 3);
    }
    return out;
  }

  /* Tints of trees and, apart, of stumps: cylinders, whereas a tree tapers. */
  function standing(rows, colours) {
    const out = tinted(rows.length / 8, colours.trees), stumps = tinted(rows.length / 8, colours.stumps);
    for (let k = 0; k < rows.length / 8; k++)
      if (rows[k * 8 + 6] === rows[k * 8 + 7]) out.set(stumps.subarray(k * 3, k * 3 + 3), k * 3);
    return out;
  }

  /* Crowns of trees, as cones: what the logs meet are the stems, so the crowns only suggest the forest. */
  function crowns(rows) {
    const out = [];
    for (let k = 0; k < rows.length; k += 8) {
      const [x, y, foot, , , top] = rows.subarray(k, k + 6), high = top - foot;
      if (rows[k + 6] !== rows[k + 7] && high > CROWNED) out.push(x, y, foot + 0.35 * high, x, y, top, Math.min(0.11 * high, 3), 0.1);
    }
    return new Float32Array(out);
  }

  /* Tints of deposits: by how the logs ended, where that is known. */
  function ended(rows, spec) {
    const out = tinted(rows.length / 8, spec.colours.deposits);
    if (spec.ends) new Uint8Array(bytes(spec.ends)).forEach((each, k) => out.set(spec.end_colours[each], k * 3));
    return out;
  }

  function strip(gl, made, points) {
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    attribute(gl, made, "place", points, 3);
    return { array, count: points.length / 3 };
  }

  function plate(feet, height) {
    const out = [];
    for (let k = 0; k < feet.length; k += 3) out.push(feet[k], feet[k + 1], feet[k + 2], feet[k], feet[k + 1], feet[k + 2] + height);
    return new Float32Array(out);
  }

  function ribbon(points, half) {
    const out = [], n = points.length / 3;
    for (let k = 0; k < n; k++) {
      const a = Math.max(k - 1, 0) * 3, b = Math.min(k + 1, n - 1) * 3;
      const dx = points[b] - points[a], dy = points[b + 1] - points[a + 1], size = Math.hypot(dx, dy) || 1;
      for (const side of [-half, half]) out.push(points[k * 3] - side * dy / size, points[k * 3 + 1] + side * dx / size, points[k * 3 + 2]);
    }
    return new Float32Array(out);
  }

  // --- a run's scene, on the graphics card -----------------------------------------------------------------------

  function loaded(gl, programs, spec) {
    const poses = shorts(spec.poses), speed = shorts(spec.speed), trails = [];
    let start = 0;
    const logs = spec.logs.map((each) => {
      const log = { ...each, start };
      const way = new Float32Array(each.n * 3);
      for (let k = 0; k < each.n; k++) for (let c = 0; c < 3; c++) {
        const p = (start + k) * 6 + c;
        way[k * 3 + c] = spec.low[c] + spec.scale[c] * (poses[p] + poses[p + 3]) / 2 + (c === 2 ? 0.3 : 0);
      }
      trails.push(strip(gl, programs.plain, way));
      start += each.n;
      return log;
    });
    const rows = { trees: floats(spec.trees), lying: floats(spec.lying), blocks: floats(spec.blocks), deposits: floats(spec.deposits) };
    const crowned = crowns(rows.trees), textures = {};
    for (const [name, address] of Object.entries(spec.drapes)) {
      const texture = textures[name] = gl.createTexture();
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB, 1, 1, 0, gl.RGB, gl.UNSIGNED_BYTE, new Uint8Array([190, 190, 180]));
      const image = new Image();
      image.onload = () => {
        if (!gl.isTexture(texture)) return; // other scenes have been loaded in the meantime
        gl.bindTexture(gl.TEXTURE_2D, texture);
        gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB, gl.RGB, gl.UNSIGNED_BYTE, image);
        gl.generateMipmap(gl.TEXTURE_2D);
        spec.changed();
      };
      image.src = address;
    }
    const moving = new Float32Array(logs.length * 8);
    return {
      spec, logs, poses, speed, trails, textures,
      ground: ground(gl, programs.ground, spec.ground),
      trees: solids(gl, programs.solid, rows.trees, standing(rows.trees, spec.colours)),
      lying: solids(gl, programs.solid, rows.lying, tinted(rows.lying.length / 8, spec.colours.lying_logs)),
      blocks: solids(gl, programs.solid, rows.blocks, tinted(rows.blocks.length / 8, spec.colours.blocks)),
      deposits: solids(gl, programs.solid, rows.deposits, ended(rows.deposits, spec)),
      crowns: solids(gl, programs.solid, crowned, tinted(crowned.length / 8, spec.colours.trees)),
      moving: solids(gl, programs.solid, moving, tinted(logs.length, spec.colours.moving)), rows: moving,
      barriers: spec.barriers.map((each) => strip(gl, programs.plain, plate(floats(each.feet), each.height))),
      lines: spec.lines.map((each) => strip(gl, programs.plain, ribbon(floats(each), 0.8))),
      last: Math.max(0.1, ...logs.map((each) => (each.n - 1) * spec.step)),
    };
  }

  /* Base and tip of a log at a time, from the poses before and after; after its last it is at rest. */
  function poseAt(scene, log, time) {
    const { spec, poses, speed } = scene;
    const exact = Math.min(Math.max(time / spec.step, 0), log.n - 1), before = Math.floor(exact);
    const after = Math.min(before + 1, log.n - 1), part = exact - before, ends = [];
    for (let c = 0; c < 6; c++) {
      const a = poses[(log.start + before) * 6 + c], b = poses[(log.start + after) * 6 + c];
      ends.push(spec.low[c % 3] + spec.scale[c % 3] * (a + (b - a) * part));
    }
    return { ends, speed: before + 1 < log.n ? speed[log.start + before] / 100 : 0 };
  }

  // --- the view --------------------------------------------------------------------------------------------------

  function view(root, scenes, words) {
    const canvas = root.querySelector("canvas"), part = (name) => root.querySelector(`[data-part="${name}"]`);
    const gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
    if (!gl) { root.classList.add("nothing"); return null; }
    const programs = { ground: program(gl, GROUND), solid: program(gl, SOLID), plain: program(gl, PLAIN) };
    const state = { run: 0, time: 0, playing: false, pace: 1, group: "", drape: "hits", followed: -1, shown: {}, camera: null };
    const ready = [];
    let waiting = false, before = 0;
    const scene = () => ready[state.run] || (ready[state.run] = loaded(gl, programs, Object.assign(scenes[state.run], { changed: draw })));
    const chosen = (log) => !state.group || log.groups.includes(state.group);

    function home(round = corners(scenes[state.run])) {
      const { nx, ny, cell, first, top } = scenes[state.run].ground, wide = nx * cell, tall = ny * cell;
      const middle = [0, 1, 2].map((c) => (Math.min(...round.map((each) => each[c])) + Math.max(...round.map((each) => each[c]))) / 2);
      state.camera = { at: middle, turn: downhill(scenes[state.run]), tilt: 0.5, far: 0 };
      state.followed = -1;
      let near = 0.02 * Math.hypot(wide, tall, top), far = 200 * near;
      for (let k = 0; k < 24; k++) { // as near as possible with all of the slope in view
        state.camera.far = (near + far) / 2;
        const seen = box(round);
        if (Math.max(seen[1] - seen[0], seen[3] - seen[2]) > 2 * FILLED) near = state.camera.far; else far = state.camera.far;
      }
      state.camera.far = far;
      for (let k = 0; k < 4; k++) { // perspective: near objects are larger
        const seen = box(round), size = far * Math.tan(ANGLE / 2), see = looking(eye(), state.camera.at);
        const aside = size * canvas.clientWidth / canvas.clientHeight * (seen[0] + seen[1]) / 2, up = size * (seen[2] + seen[3]) / 2;
        state.camera.at = state.camera.at.map((each, c) => each + aside * see[4 * c] + up * see[4 * c + 1]);
      }
    }

    /* Ends of the logs all along their ways; the whole slope without any. */
    function tracks(spec) {
      const poses = shorts(spec.poses), found = [], rows = poses.length / 6, step = Math.max(1, Math.floor(rows / 600));
      for (let row = 0; row < rows; row += step) for (const end of [0, 3]) found.push([0, 1, 2].map((c) => spec.low[c] + spec.scale[c] * poses[row * 6 + end + c]));
      for (let log = 0, row = 0; log < spec.logs.length; row += spec.logs[log++].n) found.push([0, 1, 2].map((c) => spec.low[c] + spec.scale[c] * poses[row * 6 + 3 + c]));
      return found.length ? found : corners(spec);
    }

    /* Points all over the ground, and the tops of the logs at their start. */
    function corners(spec) {
      const { nx, ny, cell, first, top } = spec.ground, z = shorts(spec.ground.z), found = [];
      const step = Math.max(1, Math.floor(Math.max(nx, ny) / 24));
      for (let j = 0; j < ny; j = j + step < ny || j === ny - 1 ? j + step : ny - 1)
        for (let i = 0; i < nx; i = i + step < nx || i === nx - 1 ? i + step : nx - 1)
          if (z[j * nx + i]) found.push([first[0] + i * cell, first[1] + j * cell, (z[j * nx + i] - 1) / 65534 * top]);
      const poses = shorts(spec.poses);
      for (let log = 0, row = 0; log < spec.logs.length; row += spec.logs[log++].n)
        for (const end of [0, 3]) found.push([0, 1, 2].map((c) => spec.low[c] + spec.scale[c] * poses[row * 6 + end + c]));
      return found.length ? found : [[first[0], first[1], 0]];
    }

    /* Left, right, bottom and top of points in the present view, -1 to 1 over the picture. */
    function box(places) {
      const see = matrix(), at = (p, r) => see[r] * p[0] + see[4 + r] * p[1] + see[8 + r] * p[2] + see[12 + r];
      const x = [], y = [];
      for (const p of places) { const w = Math.max(at(p, 3), 1e-6); x.push(at(p, 0) / w); y.push(at(p, 1) / w); }
      return [Math.min(...x), Math.max(...x), Math.min(...y), Math.max(...y)];
    }

    /* The slope is looked at from below: the azimuth in which the terrain falls. */
    function downhill(spec) {
      const { nx, ny } = spec.ground, z = shorts(spec.ground.z);
      let dx = 0, dy = 0;
      for (let j = 0; j + 4 < ny; j += 4) for (let i = 0; i + 4 < nx; i += 4) {
        const k = j * nx + i;
        if (z[k] && z[k + 4] && z[k + 4 * nx]) { dx += z[k + 4] - z[k]; dy += z[k + 4 * nx] - z[k]; }
      }
      return Math.atan2(-dy, -dx) + 0.45;
    }

    function eye() {
      const { at, turn, tilt, far } = state.camera;
      return [at[0] + far * Math.cos(tilt) * Math.cos(turn), at[1] + far * Math.cos(tilt) * Math.sin(turn), at[2] + far * Math.sin(tilt)];
    }

    function matrix() {
      const { far, at } = state.camera, near = Math.max(0.2, far / 400);
      return times(perspective(ANGLE, canvas.width / canvas.height, near, far * 6 + 4000), looking(eye(), at));
    }

    function place() {
      const now = scene();
      now.logs.forEach((log, k) => {
        const { ends } = poseAt(now, log, state.time), there = chosen(log) && state.shown.moving !== false;
        now.rows.set([...ends, ...(there ? log.r : [0, 0])], k * 8);
        if (k === state.followed) state.camera.at = [0, 1, 2].map((c) => (ends[c] + ends[c + 3]) / 2);
      });
      gl.bindBuffer(gl.ARRAY_BUFFER, now.moving.buffer);
      gl.bufferSubData(gl.ARRAY_BUFFER, 0, now.rows);
    }

    function paint() {
      waiting = false;
      const ratio = Math.min(window.devicePixelRatio || 1, 2);
      const width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
      if (!width) return;
      if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
      if (!state.camera) home(tracks(scenes[state.run]));
      const now = scene();
      place();
      const see = matrix(), on = (name) => state.shown[name] !== false;
      gl.viewport(0, 0, width, height);
      gl.clearColor(0.78, 0.85, 0.91, 1);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      gl.enable(gl.DEPTH_TEST);
      gl.useProgram(programs.ground);
      gl.uniformMatrix4fv(gl.getUniformLocation(programs.ground, "see"), false, see);
      gl.bindTexture(gl.TEXTURE_2D, now.textures[state.drape] || now.textures.relief);
      gl.bindVertexArray(now.ground.array);
      gl.drawElements(gl.TRIANGLES, now.ground.count, gl.UNSIGNED_INT, 0);
      gl.useProgram(programs.solid);
      gl.uniformMatrix4fv(gl.getUniformLocation(programs.solid, "see"), false, see);
      const pixel = gl.getUniformLocation(programs.solid, "pixel"), dense = gl.getUniformLocation(programs.solid, "dense");
      const instances = (name) => { gl.bindVertexArray(now[name].array); gl.drawArraysInstanced(gl.TRIANGLES, 0, SIDES * 12, now[name].count); };
      gl.uniform1f(dense, 1);
      for (const name of ["trees", "lying", "blocks", "deposits", "moving"]) {
        if (!on(name) || !now[name].count) continue;
        gl.uniform1f(pixel, 0.85 * (WIDE[name] || 0.35) / canvas.clientHeight);
        instances(name);
      }
      gl.useProgram(programs.plain);
      gl.uniformMatrix4fv(gl.getUniformLocation(programs.plain, "see"), false, see);
      const colour = gl.getUniformLocation(programs.plain, "paint");
      const strips = (those, kind, tint) => {
        gl.uniform4fv(colour, [...tint, 1]);
        for (const each of those) { gl.bindVertexArray(each.array); gl.drawArrays(kind, 0, each.count); }
      };
      if (on("barriers")) strips(now.barriers, gl.TRIANGLE_STRIP, now.spec.colours.barriers);
      if (on("lines")) strips(now.lines, gl.TRIANGLE_STRIP, now.spec.colours.lines);
      if (state.shown.trails) strips(now.trails.filter((_, k) => chosen(now.logs[k])), gl.LINE_STRIP, TRAIL);
      if (on("trees") && now.crowns.count) { // last, because what is behind them shines through
        gl.useProgram(programs.solid);
        gl.uniform1f(dense, VEIL);
        gl.uniform1f(pixel, 0);
        gl.enable(gl.BLEND);
        gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE);
        gl.enable(gl.CULL_FACE);
        gl.depthMask(false);
        instances("crowns");
        gl.depthMask(true);
        gl.disable(gl.CULL_FACE);
        gl.disable(gl.BLEND);
      }
      gl.bindVertexArray(null);
      tell(now);
    }

    function draw() { if (!waiting) { waiting = true; requestAnimationFrame(paint); } }

    function tell(now) {
      part("clock").textContent = `${spoken(state.time)} s`;
      const shown = part("followed"), log = now.logs[state.followed];
      shown.textContent = log
        ? words.picked.replace("{id}", log.id).replace("{speed}", spoken(poseAt(now, log, state.time).speed)) : words.hint;
      part("follow").hidden = !log;
    }

    function tick(when) {
      if (!state.playing) return;
      const now = scene();
      state.time += Math.min(0.1, (when - before) / 1000) * state.pace;
      before = when;
      if (state.time >= now.last) { state.time = now.last; play(false); }
      part("time").value = state.time;
      paint();
      requestAnimationFrame(tick);
    }

    function play(on) {
      state.playing = on;
      part("play").textContent = on ? words.pause : words.play;
      if (!on) return;
      if (state.time >= scene().last) state.time = 0;
      before = performance.now();
      requestAnimationFrame(tick);
    }

    /* The moving log whose axis appears nearest to a point of the canvas, within 14 pixels; -1 for none. */
    function pick(x, y) {
      const see = matrix(), now = scene(), wide = canvas.clientWidth, tall = canvas.clientHeight;
      const seen = (p) => {
        const w = see[3] * p[0] + see[7] * p[1] + see[11] * p[2] + see[15];
        const c = (r) => (see[r] * p[0] + see[4 + r] * p[1] + see[8 + r] * p[2] + see[12 + r]) / w;
        return w > 0 ? [(c(0) + 1) / 2 * wide, (1 - c(1)) / 2 * tall] : null;
      };
      let best = 14, found = -1;
      now.logs.forEach((log, k) => {
        if (!chosen(log)) return;
        const { ends } = poseAt(now, log, state.time), a = seen(ends.slice(0, 3)), b = seen(ends.slice(3));
        if (!a || !b) return;
        const dx = b[0] - a[0], dy = b[1] - a[1], size = dx * dx + dy * dy || 1;
        const t = Math.min(1, Math.max(0, ((x - a[0]) * dx + (y - a[1]) * dy) / size));
        const off = Math.hypot(a[0] + t * dx - x, a[1] + t * dy - y);
        if (off < best) { best = off; found = k; }
      });
      return found;
    }

    function follow(k) {
      const now = scene();
      state.followed = k;
      const tints = tinted(now.logs.length, now.spec.colours.moving);
      if (k >= 0) {
        tints.set(FOLLOWED, k * 3);
        state.camera.far = Math.min(state.camera.far, 90);
        state.camera.tilt = Math.max(state.camera.tilt, 0.35);
      }
      gl.bindBuffer(gl.ARRAY_BUFFER, now.moving.tint);
      gl.bufferSubData(gl.ARRAY_BUFFER, 0, tints);
      draw();
    }

    // pointers: one rotates, two (or the right button) pan, a wheel or a pinch zooms
    const pointers = new Map();
    let moved = 0, pinch = 0;
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      pointers.set(event.pointerId, [event.offsetX, event.offsetY]);
      moved = 0; pinch = 0;
    });
    canvas.addEventListener("pointermove", (event) => {
      const old = pointers.get(event.pointerId);
      if (!old) return;
      const dx = event.offsetX - old[0], dy = event.offsetY - old[1], camera = state.camera;
      pointers.set(event.pointerId, [event.offsetX, event.offsetY]);
      moved += Math.abs(dx) + Math.abs(dy);
      if (pointers.size === 2) {
        const [a, b] = [...pointers.values()], apart = Math.hypot(a[0] - b[0], a[1] - b[1]);
        if (pinch) camera.far *= pinch / Math.max(apart, 1);
        pinch = apart;
      }
      if (pointers.size === 2 || event.buttons === 2 || event.shiftKey) {
        const back = unit(sub(eye(), camera.at)), right = unit(cross([0, 0, 1], back)), up = cross(back, right);
        const size = camera.far * 0.85 / canvas.clientHeight / pointers.size;
        camera.at = camera.at.map((each, c) => each - right[c] * dx * size + up[c] * dy * size);
      } else {
        camera.turn -= dx * 0.006;
        camera.tilt = Math.min(1.55, Math.max(0.05, camera.tilt + dy * 0.005));
      }
      draw();
    });
    const up = (event) => {
      if (pointers.delete(event.pointerId) && moved < 5 && event.type === "pointerup") follow(pick(event.offsetX, event.offsetY));
    };
    canvas.addEventListener("pointerup", up);
    canvas.addEventListener("pointercancel", up);
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      state.camera.far = Math.min(20000, Math.max(4, state.camera.far * Math.exp(event.deltaY * 0.0012)));
      draw();
    }, { passive: false });

    function begin() {
      const now = scene();
      part("time").max = now.last;
      part("time").step = now.spec.step / 2;
      for (const option of part("group").options) option.disabled = option.value && !now.logs.some((log) => log.groups.includes(option.value));
      if (!now.logs.length) state.shown.moving = false;
      root.classList.toggle("still", !now.logs.length);
      draw();
    }

    part("time").addEventListener("input", (event) => { state.time = Number(event.target.value); draw(); });
    part("play").addEventListener("click", () => play(!state.playing));
    part("pace").addEventListener("change", (event) => { state.pace = Number(event.target.value); });
    part("group").addEventListener("change", (event) => { state.group = event.target.value; draw(); });
    part("drape").addEventListener("change", (event) => { state.drape = event.target.value; draw(); });
    part("follow").addEventListener("click", () => follow(-1));
    part("home").addEventListener("click", () => { home(); follow(-1); });
    if (part("run")) part("run").addEventListener("change", (event) => {
      state.run = Number(event.target.value); state.time = 0; part("time").value = 0; state.shown.moving = true; home(); begin();
    });
    for (const box of root.querySelectorAll("input[data-solid]")) {
      const set = () => { state.shown[box.dataset.solid] = box.checked; draw(); };
      box.addEventListener("change", set);
      set();
    }
    canvas.addEventListener("webglcontextlost", (event) => { event.preventDefault(); root.classList.add("nothing"); });
    new ResizeObserver(draw).observe(canvas);
    /* Replaces the scenes; the camera and the visible layers are unchanged. */
    function replace(next) {
      for (const old of ready) if (old) for (const each of Object.values(old.textures)) gl.deleteTexture(each);
      ready.length = 0;
      scenes = next;
      Object.assign(state, { run: 0, followed: -1, time: 0 });
      state.shown.moving = true;
      part("time").value = 0;
      begin();
    }

    begin();
    return { state, scene, replace, draw, paint, follow, pick, poseAt: (k, time) => poseAt(scene(), scene().logs[k], time) };
  }

  window.DeadwoodView = view;
})();
