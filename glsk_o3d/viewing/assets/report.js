
"use strict";
(() => {
  const element = (id) => document.getElementById(id);
  const canvas = element("view");
  const gl = canvas.getContext("webgl2", { alpha: false, antialias: true, preserveDrawingBuffer: true });
  if (!gl) return; // the words that say so stay
  document.body.classList.remove("still");
  canvas.addEventListener("webglcontextlost", () => document.body.classList.add("still"));

  // ---------------------------------------------------------------------------------------------- what is shown
  const data = JSON.parse(element("data").textContent);
  const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;
  const positions = new Int16Array(bytes(data.positions)); // of all points
  const vertexOfPoint = new Int32Array(bytes(data.vertex_of_point));
  const branchOfPoint = new Int32Array(bytes(data.branch_of_point));
  const vertices = new Float32Array(bytes(data.vertices));
  const edges = new Uint32Array(bytes(data.edges));
  const radii = new Float32Array(bytes(data.radii));
  const branchOfVertex = new Int32Array(bytes(data.branch_of_vertex));
  const branchOfEdge = new Int32Array(bytes(data.branch_of_edge));
  const measures = { radius: radii, confidence: new Float32Array(bytes(data.confidence)) };
  const pruned = new Float32Array(bytes(data.pruned)); // both ends of pieces: place and radius
  const chance = new Float32Array(bytes(data.chance)); // that it is of a limb, of each edge and then of each of these
  const chanceOfVertex = new Float32Array(bytes(data.chance_of_vertex));
  const nPoints = vertexOfPoint.length, nPieces = chance.length;
  const order = Array.from(chance.keys()).sort((a, b) => chance[b] - chance[a]); // so that the first ones are shown
  const GREY = [136, 142, 148];

  // ------------------------------------------------------------------------------------------------- programs
  const CAMERA = `#version 300 es
    precision highp float;
    uniform mat3 turn; uniform vec3 aim; uniform vec2 focal; uniform float away;
    vec3 seen(vec3 p) { return turn * (p - aim) - vec3(0, 0, away); }
    vec4 onScreen(vec3 q) {
      float near = max(away - 2.5, 0.02 * away), far = away + 2.5;
      return vec4(q.xy * focal, ((near + far) * q.z + 2.0 * near * far) / (near - far), -q.z);
    }
    float haze(vec3 q) { return clamp((-q.z - away + 0.7) / 1.4, 0.0, 1.0); }
  `;
  const program = (vertex, fragment) => {
    const made = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(made, shader);
    }
    gl.linkProgram(made);
    if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
    const uniform = (name) => gl.getUniformLocation(made, name);
    const attribute = (name) => gl.getAttribLocation(made, name);
    return { made, uniform, attribute };
  };
  const points = program(CAMERA + `
    in vec3 place; in vec3 colour;
    uniform float size; uniform vec3 paper;
    out vec3 shade;
    void main() {
      vec3 q = seen(place);
      gl_Position = onScreen(q);
      gl_PointSize = max(size / -q.z, 2.0);
      shade = mix(colour, paper, 0.65 * haze(q));
    }`, `#version 300 es
    precision highp float;
    in vec3 shade; out vec4 colour;
    void main() {
      vec2 d = 2.0 * gl_PointCoord - 1.0;
      if (dot(d, d) > 1.0) discard;
      colour = vec4(shade, 1);
    }`);
  // Every edge is a tapered capsule: one mesh, drawn once per edge. "thin" is a radius in pixels, 0 the true radius.
  const pieces = program(CAMERA + `
    in vec4 corner; in vec4 start; in vec4 stop; in vec3 startColour; in vec3 stopColour;
    uniform float thin; uniform float pixel;
    out vec3 normal; out vec3 shade;
    void main() {
      vec3 along = stop.xyz - start.xyz;
      along = length(along) > 1e-6 ? normalize(along) : vec3(0, 0, 1);
      vec3 across = normalize(cross(along, abs(along.x) < 0.8 ? vec3(1, 0, 0) : vec3(0, 1, 0)));
      vec3 outward = across * corner.x + cross(along, across) * corner.y + along * corner.z;
      vec4 end = corner.w < 0.5 ? start : stop;
      float radius = thin > 0.0 ? -seen(end.xyz).z * thin * pixel : end.w;
      vec3 q = seen(end.xyz + radius * outward);
      gl_Position = onScreen(q);
      normal = turn * outward;
      shade = corner.w < 0.5 ? startColour : stopColour;
    }`, `#version 300 es
    precision highp float;
    uniform float opacity; uniform vec4 plain;
    in vec3 normal; in vec3 shade; out vec4 colour;
    void main() {
      float light = 0.7 + 0.36 * max(dot(normalize(normal), normalize(vec3(-0.3, 0.5, 0.8))), 0.0);
      colour = plain.a > 0.0 ? plain : vec4(shade * light, opacity);
    }`);

  // -------------------------------------------------------------------------------------------------- buffers
  const filled = (array) => {
    const buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, array, gl.STATIC_DRAW);
    return buffer;
  };
  const attach = (place, buffer, n, type, stride, offset, divisor = 0) => {
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, n, type, type !== gl.FLOAT, stride, offset);
    gl.vertexAttribDivisor(place, divisor);
  };
  const AROUND = 16, RINGS = [-90, -60, -30, 0, 0, 30, 60, 90];
  const capsule = [], triangles = [];
  RINGS.forEach((degrees, ring) => {
    const tilt = (degrees * Math.PI) / 180, end = ring < RINGS.length / 2 ? 0 : 1;
    for (let i = 0; i < AROUND; i++) {
      const angle = (2 * Math.PI * i) / AROUND, a = ring * AROUND + i, b = ring * AROUND + ((i + 1) % AROUND);
      capsule.push(Math.cos(tilt) * Math.cos(angle), Math.cos(tilt) * Math.sin(angle), Math.sin(tilt), end);
      if (ring) triangles.push(a - AROUND, b - AROUND, a, a, b - AROUND, b);
    }
  });
  const given = new Float32Array(nPieces * 8), ends = new Float32Array(nPieces * 8);
  edges.forEach((vertex, i) => {
    given.set(vertices.subarray(3 * vertex, 3 * vertex + 3), 4 * i);
    given[4 * i + 3] = radii[vertex];
  });
  given.set(pruned, 4 * edges.length);
  order.forEach((piece, i) => ends.set(given.subarray(8 * piece, 8 * piece + 8), 8 * i));
  const pointColours = gl.createBuffer(), pieceColours = gl.createBuffer(), places = filled(positions);

  const cloudShape = gl.createVertexArray();
  gl.bindVertexArray(cloudShape);
  attach(points.attribute("place"), places, 3, gl.SHORT, 0, 0);
  attach(points.attribute("colour"), pointColours, 3, gl.UNSIGNED_BYTE, 0, 0);
  const pieceShape = gl.createVertexArray();
  gl.bindVertexArray(pieceShape);
  attach(pieces.attribute("corner"), filled(new Float32Array(capsule)), 4, gl.FLOAT, 0, 0);
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint16Array(triangles), gl.STATIC_DRAW);
  const endBuffer = filled(ends);
  attach(pieces.attribute("start"), endBuffer, 4, gl.FLOAT, 32, 0, 1);
  attach(pieces.attribute("stop"), endBuffer, 4, gl.FLOAT, 32, 16, 1);
  attach(pieces.attribute("startColour"), pieceColours, 3, gl.UNSIGNED_BYTE, 6, 0, 1);
  attach(pieces.attribute("stopColour"), pieceColours, 3, gl.UNSIGNED_BYTE, 6, 3, 1);

  // -------------------------------------------------------------------------------------------------- colours
  const rgb = (hex) => [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16));
  const palette = data.palette.map(rgb), ramp = data.ramp.map(rgb);
  const blend = (a, b, share) => a.map((value, i) => value + share * (b[i] - value));
  const ofBranch = (branch) => (branch < 0 ? GREY : palette[branch]);
  const ofMeasure = (value, [low, high]) => {
    if (!Number.isFinite(value)) return GREY;
    const x = (ramp.length - 1) * Math.min(Math.max((value - low) / (high - low || 1), 0), 1);
    return blend(ramp[Math.floor(x)], ramp[Math.ceil(x)], x % 1);
  };
  const paint = () => {
    const mode = element("colour").value, range = data.ranges[mode], values = measures[mode];
    const cloud = new Uint8Array(3 * nPoints), skeleton = new Uint8Array(6 * nPieces);
    const colour = (branch, v) => (mode === "branch" ? ofBranch(branch) : ofMeasure(values[v], range));
    vertexOfPoint.forEach((v, i) => cloud.set(blend(colour(branchOfPoint[i], v), GREY, 0.5), 3 * i));
    order.forEach((piece, i) => [0, 1].forEach((end) => skeleton.set(
      piece < branchOfEdge.length ? colour(branchOfEdge[piece], edges[2 * piece + end]) : GREY, 6 * i + 3 * end)));
    for (const [buffer, array] of [[pointColours, cloud], [pieceColours, skeleton]]) {
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, array, gl.STATIC_DRAW);
    }
    const [low, bar, high] = element("legend").children;
    element("legend").hidden = !range;
    if (range) {
      const unit = mode === "radius" ? data.unit : 1;
      [low.textContent, high.textContent] = range.map((value) => String(+(value * unit).toPrecision(3)));
      bar.style.background = `linear-gradient(to right, ${data.ramp.join()})`;
    }
    redraw();
  };

  // --------------------------------------------------------------------------------------------------- camera
  const VIEWS = {
    xy: [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
    xz: [[1, 0, 0], [0, 0, 1], [0, -1, 0]],
    yz: [[0, 1, 0], [0, 0, 1], [1, 0, 0]],
  };
  const ZOOM = 1 / Math.tan((15 * Math.PI) / 180);
  let axes, aim, away, fitted = true; // rows: right, up, towards the viewer
  const dot = (a, b, at = 0) => a[0] * b[at] + a[1] * b[at + 1] + a[2] * b[at + 2];
  const focal = () => [(ZOOM * canvas.height) / canvas.width, ZOOM];
  const spin = (i, j, angle) => {
    const c = Math.cos(angle), s = Math.sin(angle);
    [axes[i], axes[j]] = [axes[i].map((a, k) => c * a + s * axes[j][k]), axes[j].map((b, k) => c * b - s * axes[i][k])];
  };
  const fit = () => { // the nearest distance from which everything is in the picture
    const [fx, fy] = focal(), around = nPoints ? positions : vertices;
    const unit = nPoints ? 1 / 32767 : 1;
    [aim, away] = [[0, 0, 0], 0.05];
    for (let at = 0; at < around.length; at += 3) {
      const [x, y, z] = axes.map((axis) => unit * dot(axis, around, at));
      away = Math.max(away, z + Math.max(Math.abs(x) * fx, Math.abs(y) * fy) / 0.9);
    }
    fitted = true;
  };
  const look = (name, tilted) => {
    axes = VIEWS[name].map((axis) => [...axis]);
    if (tilted) {
      spin(0, 2, 0.4);
      spin(2, 1, 0.25);
    }
    fit();
    redraw();
  };
  const move = (dx, dy) => {
    const pixel = (2 * away) / (ZOOM * canvas.clientHeight);
    aim = aim.map((value, k) => value + pixel * (dy * axes[1][k] - dx * axes[0][k]));
    fitted = false;
  };
  const zoom = (factor) => {
    away = Math.min(Math.max(away * factor, 0.02), 20);
    fitted = false;
  };

  // -------------------------------------------------------------------------------------------------- drawing
  let due = false;
  const drawPieces = (thin, opacity, plain = [0, 0, 0, 0]) => {
    gl.uniform1f(pieces.uniform("thin"), thin);
    gl.uniform4fv(pieces.uniform("plain"), plain);
    gl.uniform1f(pieces.uniform("opacity"), opacity);
    const limb = +element("limb").value, shown = chance.reduce((count, value) => count + (value >= limb), 0);
    gl.drawElementsInstanced(gl.TRIANGLES, triangles.length, gl.UNSIGNED_SHORT, 0, shown);
  };
  const use = ({ made, uniform }) => {
    gl.useProgram(made);
    gl.uniformMatrix3fv(uniform("turn"), true, axes.flat());
    gl.uniform3fv(uniform("aim"), aim);
    gl.uniform2fv(uniform("focal"), focal());
    gl.uniform1f(uniform("away"), away);
  };
  const draw = () => {
    const paper = getComputedStyle(canvas).backgroundColor.match(/[\d.]+/g).slice(0, 3).map((value) => value / 255);
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(...paper, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    if (nPoints && element("cloud").checked) {
      gl.bindVertexArray(cloudShape);
      use(points);
      gl.uniform1f(points.uniform("size"), Math.min(0.55 / Math.sqrt(nPoints), 0.009) * ZOOM * canvas.height / 2);
      gl.uniform3fv(points.uniform("paper"), paper);
      gl.drawArrays(gl.POINTS, 0, nPoints);
    }
    gl.bindVertexArray(pieceShape);
    use(pieces);
    gl.uniform1f(pieces.uniform("pixel"), 2 / (ZOOM * canvas.clientHeight));
    if (element("tubes").checked) { // the nearest walls alone, so that what overlaps is not darker
      gl.clear(gl.DEPTH_BUFFER_BIT);
      gl.colorMask(false, false, false, false);
      drawPieces(0, 1);
      gl.colorMask(true, true, true, true);
      gl.enable(gl.BLEND);
      gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
      drawPieces(0, 0.45);
      gl.disable(gl.BLEND);
    }
    if (element("skeleton").checked) { // in front of the cloud, which would hide it, and with a rim against it
      for (const [thin, ...plain] of [[3.4, ...paper, 1], [2, 0, 0, 0, 0]]) {
        gl.clear(gl.DEPTH_BUFFER_BIT);
        drawPieces(thin, 1, plain);
      }
    }
  };
  const redraw = () => {
    if (due) return;
    due = true;
    requestAnimationFrame(() => {
      due = false;
      draw();
    });
  };

  // ------------------------------------------------------------------------------------------------- controls
  for (const name of Object.keys(data.ranges)) element("colour").add(new Option(name, name));
  element("colour").addEventListener("change", paint);
  for (const name of ["cloud", "skeleton", "tubes"]) element(name).addEventListener("change", () => redraw());
  element("cloud").parentNode.hidden = !nPoints;
  for (const name of ["skeleton", "colour"]) element(name).parentNode.hidden = !nPieces;
  element("tubes").parentNode.hidden = !("radius" in data.ranges && nPieces);
  const turn = () => {
    element("limb").nextElementSibling.textContent = (+element("limb").value).toFixed(2);
    redraw();
  };
  element("limb").value = data.limb;
  element("limb").parentNode.hidden = !chance.some((value) => value < 1);
  element("limb").addEventListener("input", turn);
  turn();
  document.querySelectorAll("[data-view]").forEach((button) =>
    button.addEventListener("click", () => look(button.dataset.view)));
  element("save").addEventListener("click", () => {
    const link = document.createElement("a");
    link.download = "skeleton.png";
    link.href = canvas.toDataURL("image/png");
    link.click();
  });

  const fingers = new Map();
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, event);
  });
  for (const name of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(name, (event) => fingers.delete(event.pointerId));
  }
  const gap = ([a, b]) => Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY);
  canvas.addEventListener("pointermove", (event) => {
    const before = fingers.get(event.pointerId);
    if (!before) return point(event);
    element("tip").hidden = true;
    const dx = event.clientX - before.clientX, dy = event.clientY - before.clientY, apart = gap([...fingers.values(), before]);
    fingers.set(event.pointerId, event);
    if (fingers.size > 1) {
      move(dx / 2, dy / 2);
      zoom(apart / Math.max(gap([...fingers.values()]), 1));
    } else if (event.shiftKey || event.buttons & 2) {
      move(dx, dy);
    } else {
      spin(0, 2, -dx / 150);
      spin(2, 1, dy / 150);
    }
    redraw();
  });
  canvas.addEventListener("pointerleave", () => { element("tip").hidden = true; });
  canvas.addEventListener("wheel", (event) => { // only when asked to: the page scrolls past otherwise
    if (!event.ctrlKey && document.activeElement !== canvas) return;
    event.preventDefault();
    zoom(Math.exp(event.deltaY * 0.0015));
    redraw();
  }, { passive: false });
  const KEYS = {
    ArrowLeft: () => spin(0, 2, 0.1), ArrowRight: () => spin(0, 2, -0.1), ArrowUp: () => spin(2, 1, -0.1),
    ArrowDown: () => spin(2, 1, 0.1), "+": () => zoom(0.9), "-": () => zoom(1.1), Home: () => look(data.view, true),
  };
  canvas.addEventListener("keydown", (event) => {
    if (!(event.key in KEYS) || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    KEYS[event.key]();
    redraw();
  });
  canvas.addEventListener("dblclick", () => look(data.view, true));

  const point = (event) => { // say what the vertex under the mouse is
    const [fx, fy] = focal(), box = canvas.getBoundingClientRect();
    let found = -1, nearest = 12;
    if (element("skeleton").checked || element("tubes").checked) {
      for (let v = 0; v < radii.length; v++) {
        if (chanceOfVertex[v] < +element("limb").value) continue;
        const away3 = [0, 1, 2].map((k) => vertices[3 * v + k] - aim[k]);
        const [x, y, z] = axes.map((axis) => dot(axis, away3));
        const px = box.width * (0.5 + (0.5 * fx * x) / (away - z)), py = box.height * (0.5 - (0.5 * fy * y) / (away - z));
        const far = Math.hypot(px - (event.clientX - box.left), py - (event.clientY - box.top));
        if (far < nearest) [found, nearest] = [v, far];
      }
    }
    const tip = element("tip");
    tip.hidden = found < 0;
    if (found < 0) return;
    const told = [`vertex ${found}`];
    if (branchOfVertex[found] >= 0) told.push(`branch ${branchOfVertex[found]}`);
    if ("radius" in data.ranges) told.push(`radius ${+(radii[found] * data.unit).toPrecision(4)}`);
    if ("confidence" in data.ranges) told.push(`confidence ${measures.confidence[found].toFixed(2)}`);
    tip.textContent = told.join(" · ");
    tip.style.left = `${Math.max(Math.min(event.clientX - box.left + 14, box.width - tip.offsetWidth - 4), 0)}px`;
    tip.style.top = `${Math.max(event.clientY - box.top - 36, 4)}px`;
  };

  new ResizeObserver(() => {
    const pixels = Math.min(window.devicePixelRatio || 1, 2);
    canvas.width = Math.max(Math.round(canvas.clientWidth * pixels), 1);
    canvas.height = Math.max(Math.round(canvas.clientHeight * pixels), 1);
    if (fitted) fit();
    draw();
  }).observe(canvas);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  look(data.view, true);
  paint();
})();
