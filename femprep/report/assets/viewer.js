// A mesh in, a view to turn, cut and colour out. Three.js draws; which faces are visible is found here.
"use strict";
(async () => {
  const scene3d = JSON.parse(document.getElementById("scene").textContent);
  const byId = (id) => document.getElementById(id);
  const holder = byId("viewer");
  const TYPES = { uint8: Uint8Array, int8: Int8Array, uint16: Uint16Array, uint32: Uint32Array };
  const CUT = new THREE.Color("#e0a196");
  const SCALE = JSON.parse(document.getElementById("scale").textContent).map((text) => new THREE.Color(text));

  async function unpack(packed) {
    const bytes = Uint8Array.from(atob(packed.data), (letter) => letter.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new TYPES[packed.type](await new Response(stream).arrayBuffer());
  }

  let renderer;
  try {
    renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
  } catch (error) {
    holder.textContent = "This browser cannot draw 3-D graphics (WebGL). Open the mesh in ParaView instead.";
    return;
  }

  // Points in mm, from the middle of the mesh.
  const steps = await unpack(scene3d.points);
  const count = steps.length / 3;
  const points = new Float32Array(steps.length);
  const middle = [0, 1, 2].map((axis) => {
    let low = Infinity, high = -Infinity;
    for (let i = axis; i < steps.length; i += 3) { low = Math.min(low, steps[i]); high = Math.max(high, steps[i]); }
    return 0.5 * (low + high) * scene3d.step;
  });
  for (let i = 0; i < steps.length; i++) points[i] = steps[i] * scene3d.step - middle[i % 3];
  const rest = points.slice();
  const here = (place) => place.map((x, axis) => x - scene3d.low[axis] - middle[axis]);

  // Every face of every element: up to four corners, its element, and the element on its other side. Arrays of numbers
  // throughout: a mesh may have millions of faces.
  let elements = 0, faces = 0;
  for (const block of scene3d.blocks) {
    block.nodes = await unpack(block.nodes);
    block.count = block.nodes.length / block.corners;
    elements += block.count;
    faces += block.count * block.faces.length;
  }
  const rings = new Int32Array(4 * faces), owner = new Int32Array(faces), other = new Int32Array(faces).fill(-1);
  const sides = new Uint8Array(faces), centres = new Float32Array(3 * elements);

  // A hash table of faces by their three smallest corners, which identify a face of a conforming mesh.
  let size = 1;
  while (size < 2 * faces) size *= 2;
  const table = new Int32Array(size).fill(-1), smallest = new Int32Array(3 * faces);
  let a, b, c;
  function find(nodes, at, count) {
    a = nodes[at]; b = nodes[at + 1]; c = nodes[at + 2];
    if (count === 4) {
      const d = nodes[at + 3];
      if (a > b && a > c && a > d) a = d; else if (b > c && b > d) b = d; else if (c > d) c = d;
    }
    if (a > b) [a, b] = [b, a];
    if (b > c) [b, c] = [c, b];
    if (a > b) [a, b] = [b, a];
    let slot = Math.imul(a, 73856093) ^ Math.imul(b, 19349663) ^ Math.imul(c, 83492791);
    slot = Math.imul(slot ^ (slot >>> 15), 0x2c1b3c6d);
    for (slot = (slot ^ (slot >>> 12)) & (size - 1); table[slot] >= 0; slot = (slot + 1) & (size - 1)) {
      const known = 3 * table[slot];
      if (smallest[known] === a && smallest[known + 1] === b && smallest[known + 2] === c) break;
    }
    return slot;
  }

  let element = 0, face = 0;
  for (const { nodes, corners, faces: locals } of scene3d.blocks) {
    for (let first = 0; first < nodes.length; first += corners, element++) {
      for (let k = 0; k < corners; k++) for (let axis = 0; axis < 3; axis++) centres[3 * element + axis] += points[3 * nodes[first + k] + axis] / corners;
      for (const local of locals) {
        for (let k = 0; k < local.length; k++) rings[4 * face + k] = nodes[first + local[k]];
        sides[face] = local.length;
        owner[face] = element;
        const slot = find(rings, 4 * face, local.length), twin = table[slot];
        if (twin < 0) {
          table[slot] = face;
          smallest[3 * face] = a; smallest[3 * face + 1] = b; smallest[3 * face + 2] = c;
        } else {
          other[twin] = element;
          other[face] = owner[twin];
        }
        face++;
      }
    }
  }

  // Tags of the boundary's faces.
  const tags = await unpack(scene3d.facetTags);
  const tagOf = new Int16Array(faces).fill(-1);
  let facet = 0;
  for (const block of scene3d.facets) {
    const nodes = await unpack(block.nodes);
    for (let first = 0; first < nodes.length; first += block.corners, facet++) {
      const known = table[find(nodes, first, block.corners)];
      if (known >= 0) tagOf[known] = tags[facet];
    }
  }

  const fields = [{ title: "facet tag", classes: scene3d.facetNames, facet: true }];
  for (const field of scene3d.fields) fields.push({ ...field, values: await unpack(field.values) });
  const fibres = scene3d.fibres ? await unpack(scene3d.fibres) : null;
  for (const field of fields) field.colours = (field.classes || []).map((one) => new THREE.Color(one.colour));
  for (const field of fields) field.hidden = new Set();

  function ramp(share) {
    const at = Math.min(share, 0.9999) * (SCALE.length - 1), low = Math.floor(at);
    return SCALE[low].clone().lerp(SCALE[low + 1], at - low);
  }
  const ramps = Array.from({ length: 256 }, (_, step) => ramp(step / 255));

  const state = { field: 0, cut: -1, share: 0.5, turned: false, edges: true, fibres: false, worst: false, worstOf: scene3d.worst, phase: 0 };
  const stage = new THREE.Scene();
  stage.background = new THREE.Color("#ffffff");
  const camera = new THREE.PerspectiveCamera(35, 1, 1, 5000);
  stage.add(new THREE.AmbientLight("#ffffff", 1.6), camera);
  const lamp = new THREE.DirectionalLight("#ffffff", 1.8);
  lamp.position.set(0.4, 0.6, 1);
  camera.add(lamp);
  holder.replaceChildren(renderer.domElement);
  const controls = new THREE.OrbitControls(camera, renderer.domElement);
  controls.enableDamping = false;
  let reach = 1;
  for (let i = 0; i < points.length; i += 3) reach = Math.max(reach, Math.hypot(points[i], points[i + 1], points[i + 2]));
  let parts = [];

  function reset() {
    const [across, , up] = scene3d.axes;
    camera.up.set(...up);
    camera.position.set(...across.map((x, axis) => 3.6 * reach * (x + 0.35 * up[axis])));
    controls.target.set(0, 0, 0);
    controls.update();
  }

  // Which elements are shown: their region and segment are, and their middle lies on the kept side of the cut.
  function keep() {
    const kept = new Uint8Array(elements).fill(1);
    for (const field of fields) {
      if (!field.hidden.size) continue;
      for (let e = 0; e < elements; e++) if (field.hidden.has(field.values[e])) kept[e] = 0;
    }
    if (state.cut < 0) return kept;
    const normal = scene3d.axes[state.cut];
    const height = (array, i) => array[3 * i] * normal[0] + array[3 * i + 1] * normal[1] + array[3 * i + 2] * normal[2];
    let low = Infinity, high = -Infinity;
    for (let i = 0; i < count; i++) { const h = height(rest, i); low = Math.min(low, h); high = Math.max(high, h); }
    const at = low + state.share * (high - low), sign = state.turned ? -1 : 1;
    for (let e = 0; e < elements; e++) if (sign * (height(centres, e) - at) > 0) kept[e] = 0;
    return kept;
  }

  function shade(face, field) {
    if (field.facet) return tagOf[face] < 0 || other[face] >= 0 ? CUT : field.colours[tagOf[face]];
    const value = field.values[owner[face]];
    return field.classes ? field.colours[value] : ramps[value];
  }

  function surface(shown, colourOf, opacity) {
    let corners = 0;
    for (const face of shown) corners += sides[face];
    const triangles = corners - 2 * shown.length;
    const position = new Float32Array(9 * triangles), colour = new Float32Array(9 * triangles), line = new Float32Array(6 * corners);
    let p = 0, l = 0;
    for (const face of shown) {
      const tint = colourOf(face), first = 4 * face, last = first + sides[face] - 1;
      for (let k = first + 1; k < last; k++) {
        for (const at of [first, k, k + 1]) {
          for (let axis = 0; axis < 3; axis++) position[p + axis] = points[3 * rings[at] + axis];
          colour[p] = tint.r; colour[p + 1] = tint.g; colour[p + 2] = tint.b;
          p += 3;
        }
      }
      for (let k = first; k <= last; k++) {
        for (const at of [k, k < last ? k + 1 : first]) for (let axis = 0; axis < 3; axis++) line[l++] = points[3 * rings[at] + axis];
      }
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(position, 3));
    geometry.setAttribute("color", new THREE.BufferAttribute(colour, 3));
    geometry.computeVertexNormals();
    const material = new THREE.MeshLambertMaterial({ vertexColors: true, side: THREE.DoubleSide, transparent: opacity < 1, opacity,
      depthWrite: opacity === 1, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 });
    add(new THREE.Mesh(geometry, material));
    if (state.edges && opacity === 1) lines(line, "#444444", 0.35);
  }

  function lines(array, colour, opacity) {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(array, 3));
    add(new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color: colour, transparent: opacity < 1, opacity })));
  }

  function add(part) { parts.push(part); stage.add(part); }

  function build() {
    for (const part of parts) { stage.remove(part); part.geometry.dispose(); part.material.dispose(); }
    parts = [];
    const kept = keep(), field = fields[state.field], shown = [];
    for (let face = 0; face < faces; face++) {
      // Of a mesh that is shown in part, faces towards elements left out are no boundary.
      if (kept[owner[face]] && (other[face] < 0 ? !scene3d.cuts.length || tagOf[face] >= 0 : !kept[other[face]])) shown.push(face);
    }
    surface(shown, (face) => shade(face, field), state.worst ? 0.18 : 1);
    if (state.worst) {
      const bad = new Set(state.worstOf.map((one) => one.element)), red = new THREE.Color("#d00000");
      const worst = [];
      for (let face = 0; face < faces; face++) if (bad.has(owner[face])) worst.push(face);
      surface(worst, () => red, 1);
      for (const one of state.worstOf) {
        const ball = new THREE.Mesh(new THREE.SphereGeometry(reach / 60, 12, 8), new THREE.MeshBasicMaterial({ color: red, transparent: true, opacity: 0.5 }));
        ball.position.set(...here(one.place));
        add(ball);
      }
    }
    if (state.fibres && fibres) {
      // A line before each face that is seen: one at the middle of its element would lie hidden in it.
      const step = Math.max(1, Math.ceil(shown.length / 8000)), half = reach / 45, before = reach / 150;
      const line = new Float32Array(6 * Math.ceil(shown.length / step));
      for (let k = 0, l = 0; k < shown.length; k += step) {
        const face = shown[k], element = owner[face], middle = [0, 0, 0];
        for (let i = 0; i < sides[face]; i++) for (let axis = 0; axis < 3; axis++) middle[axis] += points[3 * rings[4 * face + i] + axis] / sides[face];
        const out = middle.map((x, axis) => x - centres[3 * element + axis]), length = Math.hypot(...out) || 1;
        for (const sign of [-1, 1]) {
          for (let axis = 0; axis < 3; axis++) line[l++] = middle[axis] + before * out[axis] / length + sign * half * fibres[3 * element + axis] / 127;
        }
      }
      lines(line, "#000000", 1);
    }
    state.shown = shown.length;
    legend(field);
    render();
  }

  function legend(field) {
    const box = byId("legend");
    box.replaceChildren();
    const say = (text) => { const span = document.createElement("span"); span.append(...[].concat(text)); box.append(span); };
    if (field.classes) {
      field.classes.forEach((one, number) => {
        const swatch = document.createElement("i");
        swatch.style.background = one.colour;
        if (field.facet) { say([swatch, one.name]); return; }
        // Elements of a region or a segment are left out, and taken in again, by a click on its name.
        const button = document.createElement("button");
        button.type = "button";
        button.title = "leave out, or take in again";
        button.setAttribute("aria-pressed", String(!field.hidden.has(number)));
        button.append(swatch, one.name);
        button.addEventListener("click", () => {
          field.hidden[field.hidden.has(number) ? "delete" : "add"](number);
          build();
        });
        box.append(button);
      });
      if (field.facet) {
        const swatch = document.createElement("i");
        swatch.style.background = `#${CUT.getHexString()}`;
        say([swatch, "cut"]);
      }
      return;
    }
    const bar = document.createElement("i");
    bar.className = "ramp";
    bar.style.background = `linear-gradient(to right, ${SCALE.map((colour) => `#${colour.getHexString()}`).join(",")})`;
    say(`${field.title}: ${Number(field.low.toPrecision(3))}`);
    box.append(bar);
    say(String(Number(field.high.toPrecision(3))));
  }

  function render() { renderer.render(stage, camera); }
  function resize() {
    const { clientWidth: width, clientHeight: height } = holder;
    renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
    renderer.setSize(width, height);
    camera.aspect = width / height;
    camera.updateProjectionMatrix();
    render();
  }

  // Phases of one heart: its points moved, its thickness and worst elements those of the phase.
  const phases = scene3d.phases || [];
  const thick = fields.find((field) => field.moves);
  for (const phase of phases) {
    phase.moved = await unpack(phase.moved);
    if (phase.thickness) phase.thickness = await unpack(phase.thickness);
  }
  function move(number) {
    const phase = phases[number];
    for (let i = 0; i < points.length; i++) points[i] = rest[i] + phase.step * phase.moved[i];
    if (thick && phase.thickness) thick.values = phase.thickness;
    state.worstOf = phase.worst;
    state.phase = number;
    byId("phase").value = number;
    byId("phase-name").textContent = phase.name;
    build();
  }
  if (phases.length) {
    let timer = 0;
    const stop = () => { clearInterval(timer); timer = 0; byId("play").textContent = "Play"; };
    byId("phase").addEventListener("input", (event) => { stop(); move(Number(event.target.value)); });
    byId("play").addEventListener("click", () => {
      if (timer) { stop(); return; }
      byId("play").textContent = "Stop";
      timer = setInterval(() => move((state.phase + 1) % phases.length), Math.max(80, 1500 / phases.length));
    });
  }

  // The controls.
  fields.forEach((field, number) => byId("colour").add(new Option(field.title, number)));
  const listen = (id, event, take) => byId(id).addEventListener(event, (e) => { take(e.target); build(); });
  listen("colour", "change", (input) => { state.field = Number(input.value); });
  listen("cut", "change", (input) => { state.cut = Number(input.value); });
  listen("share", "input", (input) => {
    const nearest = (share, cut) => (Math.abs(cut - input.value / 100) < Math.abs(share - input.value / 100) ? cut : share);
    state.share = scene3d.cuts.length ? scene3d.cuts.reduce(nearest) : input.value / 100;
    input.value = 100 * state.share;
  });
  listen("turned", "change", (input) => { state.turned = input.checked; });
  for (const name of ["edges", "fibres", "worst"]) listen(name, "change", (input) => { state[name] = input.checked; });
  if (!fibres) byId("fibres").parentElement.hidden = true;
  byId("reset").addEventListener("click", () => { for (const field of fields) field.hidden.clear(); reset(); build(); });
  for (const row of document.querySelectorAll("[data-place]")) {
    row.addEventListener("click", () => {
      byId("worst").checked = state.worst = true;
      controls.target.set(...here(JSON.parse(row.dataset.place)));
      controls.update();
      build();
      holder.scrollIntoView({ block: "center" });
    });
  }
  controls.addEventListener("change", render);
  new ResizeObserver(resize).observe(holder);
  reset();
  resize();
  if (phases.length) move(scene3d.first);
  else build();
  window.femprepView = { state, camera, renderer, elements, points };
})().catch((error) => {
  document.getElementById("viewer").textContent = `The view failed (${error}). Open the mesh in ParaView instead, and please report this error.`;
  throw error;
});
