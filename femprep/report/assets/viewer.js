// A mesh in, a view to turn, cut and colour out. Three.js draws; which faces are seen is found here.
"use strict";
(async () => {
  const scene3d = JSON.parse(document.getElementById("scene").textContent);
  const holder = document.getElementById("viewer");
  const byId = (id) => document.getElementById(id);
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
    holder.textContent = "This browser draws no 3-D (WebGL); the picture below shows the mesh.";
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
  const here = (place) => place.map((x, axis) => x - scene3d.low[axis] - middle[axis]);

  // A number for each set of corners: three of them tell a face of a conforming mesh.
  const key = (nodes) => {
    const sorted = nodes.slice().sort((a, b) => a - b);
    return (sorted[0] * count + sorted[1]) * count + sorted[2];
  };

  // Every face of every element: corners, element, and the element on its other side.
  const faces = [], owner = [], other = [], centres = [];
  const met = new Map();
  let elements = 0;
  for (const block of scene3d.blocks) {
    const nodes = await unpack(block.nodes);
    for (let first = 0; first < nodes.length; first += block.corners) {
      const corners = nodes.subarray(first, first + block.corners);
      const centre = [0, 0, 0];
      for (const node of corners) for (let axis = 0; axis < 3; axis++) centre[axis] += points[3 * node + axis] / block.corners;
      centres.push(centre);
      for (const local of block.faces) {
        const ring = local.map((corner) => corners[corner]);
        const known = key(ring), twin = met.get(known);
        if (twin === undefined) met.set(known, faces.length);
        else other[twin] = elements;
        faces.push(ring);
        owner.push(elements);
        other.push(twin === undefined ? -1 : owner[twin]);
      }
      elements++;
    }
  }

  // Tags of the boundary's faces.
  const tags = await unpack(scene3d.facetTags);
  const tagOf = new Int16Array(faces.length).fill(-1);
  let facet = 0;
  for (const block of scene3d.facets) {
    const nodes = await unpack(block.nodes);
    for (let first = 0; first < nodes.length; first += block.corners, facet++) {
      const face = met.get(key(Array.from(nodes.subarray(first, first + block.corners))));
      if (face !== undefined) tagOf[face] = tags[facet];
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
  const reach = Math.max(...centres.map((c) => Math.hypot(...c)), 1);
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
    const height = centres.map((c) => c[0] * normal[0] + c[1] * normal[1] + c[2] * normal[2]);
    let low = Infinity, high = -Infinity;
    for (const h of height) { low = Math.min(low, h); high = Math.max(high, h); }
    const at = low + state.share * (high - low), sign = state.turned ? -1 : 1;
    for (let e = 0; e < elements; e++) if (sign * (height[e] - at) > 0) kept[e] = 0;
    return kept;
  }

  function shade(face, field) {
    if (field.facet) return tagOf[face] < 0 || other[face] >= 0 ? CUT : field.colours[tagOf[face]];
    const value = field.values[owner[face]];
    return field.classes ? field.colours[value] : ramps[value];
  }

  function surface(shown, colourOf, opacity) {
    let triangles = 0, sides = 0;
    for (const face of shown) { triangles += faces[face].length - 2; sides += faces[face].length; }
    const position = new Float32Array(9 * triangles), colour = new Float32Array(9 * triangles), line = new Float32Array(6 * sides);
    let p = 0, l = 0;
    for (const face of shown) {
      const ring = faces[face], tint = colourOf(face);
      for (let k = 1; k + 1 < ring.length; k++) {
        for (const node of [ring[0], ring[k], ring[k + 1]]) {
          for (let axis = 0; axis < 3; axis++) position[p + axis] = points[3 * node + axis];
          colour[p] = tint.r; colour[p + 1] = tint.g; colour[p + 2] = tint.b;
          p += 3;
        }
      }
      for (let k = 0; k < ring.length; k++) {
        for (const node of [ring[k], ring[(k + 1) % ring.length]]) for (let axis = 0; axis < 3; axis++) line[l++] = points[3 * node + axis];
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
    for (let face = 0; face < faces.length; face++) if (kept[owner[face]] && (other[face] < 0 || !kept[other[face]])) shown.push(face);
    surface(shown, (face) => shade(face, field), state.worst ? 0.18 : 1);
    if (state.worst) {
      const bad = new Set(state.worstOf.map((one) => one.element)), red = new THREE.Color("#d00000");
      surface(faces.map((_, face) => face).filter((face) => bad.has(owner[face])), () => red, 1);
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
        const ring = faces[shown[k]], element = owner[shown[k]];
        const middle = [0, 1, 2].map((axis) => ring.reduce((sum, node) => sum + points[3 * node + axis], 0) / ring.length);
        const out = middle.map((x, axis) => x - centres[element][axis]), length = Math.hypot(...out) || 1;
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
  const rest = points.slice(), thick = fields.find((field) => field.moves);
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
  listen("share", "input", (input) => { state.share = Number(input.value) / 100; });
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
})();
