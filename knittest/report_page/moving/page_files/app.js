// The page: camera, time, colours and legend.
import * as THREE from "three";
import { OrbitControls } from "orbit";
import { inflated } from "decode";
import { RunScene, partColour } from "scene";

const one = id => document.getElementById(id), root = document.documentElement;
const LONG = 1.5;  // length along y over width from which a specimen is looked at across its length
const LOOP = 8;  // seconds from the first frame to the last

function trouble(text) {
  one("trouble").textContent = text;
  one("trouble").hidden = false;
  root.dataset.state = "trouble";
}
const number = v => Math.abs(v) >= 1e4 || (v !== 0 && Math.abs(v) < 1e-3) ? v.toExponential(2) : String(+v.toPrecision(3));
const signed = v => number(v).replace("-", "−");

class View {
  constructor(header, run, renderer) {
    Object.assign(this, { header, run, renderer, playing: false, at: 0 });
    this.camera = new THREE.OrthographicCamera(-1, 1, 1, -1, 0.1, 1);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, renderer.domElement);
    this.controls.zoomToCursor = true;
    this.controls.addEventListener("change", () => this.draw());
    this.choices();
    this.look("oblique");
    this.bind();
    addEventListener("resize", () => this.resize());
    this.resize();
  }

  /** Colours to choose from: fields of the frames, then what the positions tell, then the parts. */
  choices() {
    const { header, run } = this, { low, high, far } = run.box;
    this.colours = header.fields.map((f, k) => ({ ...f, field: k, positions: 0 }));
    const flat = (label, positions, from, to) => ({ label, unit: "mm", low: from, high: to, least: from, largest: to, signed: false, field: -1, positions });
    if (high[2] > low[2]) this.colours.push(flat("height", 1, low[2], high[2]));
    if (far > 0) this.colours.push(flat("displacement", 2, 0, far));
    if (header.parts.length > 1 || !this.colours.length) this.colours.push({ label: "part", positions: 3, field: -1 });
    one("colour").replaceChildren(...this.colours.map((c, k) => new Option(c.unit ? `${c.label} [${c.unit}]` : c.label, k)));
    const box = (name, colour, turn) => {
      const label = document.createElement("label"), input = document.createElement("input"), swatch = document.createElement("i");
      Object.assign(input, { type: "checkbox", checked: true });
      input.addEventListener("change", () => { turn(input.checked); this.draw(); });
      swatch.style.background = colour;
      label.append(input, swatch, name);
      return label;
    };
    const parts = header.parts.length > 1 ? header.parts.map((name, k) => box(name, partColour(k), on => run.partShown(k, on))) : [];
    const tools = run.tools.map(tool => box(tool.name, "#a9b2bc", on => { tool.group.visible = on; }));
    one("parts").replaceChildren(...parts, ...tools);
    this.colourBy(0);
  }

  colourBy(k) {
    const c = this.colours[k], maps = this.header.maps, map = c.signed ? maps.diverging : maps.sequential;
    this.run.colourBy(c.field, c.positions, map, [c.low, c.high]);
    one("colour").value = k;
    one("legend").hidden = c.positions === 3;
    one("parts").classList.toggle("keyed", c.positions === 3);
    if (c.positions === 3) return this.goto(this.at);
    one("bar").style.background = `linear-gradient(to right, ${map.join(",")})`;
    const middle = (c.low + c.high) / 2, unit = c.unit ? ` ${c.unit}` : "";
    [c.low, middle, c.high].forEach((v, i) => { one("ticks").children[i].textContent = signed(v); });
    one("what").textContent = c.unit ? `${c.label} [${c.unit}]` : c.label;
    const beyond = c.least < c.low - 1e-9 * Math.abs(c.low) || c.largest > c.high * (1 + 1e-9);
    one("beyond").textContent = beyond ? `single elements: ${signed(c.least)} to ${signed(c.largest)}${unit}` : "";
    this.goto(this.at);
  }

  /** Look at the whole run from a side. */
  look(from) {
    const { low, high } = this.run.room, middle = new THREE.Vector3(...low.map((v, k) => (v + high[k]) / 2));
    const size = Math.hypot(...high.map((v, k) => v - low[k])) || 1;
    const { low: l, high: h } = this.run.box, long = h[1] - l[1] > LONG * (h[0] - l[0]);
    const direction = {
      top: [0, -1e-4, 1], side: long ? [1, 0, 0.02] : [0, -1, 0.02], oblique: long ? [1, 0.55, 0.75] : [0.55, -1, 0.75],
    }[from];
    this.camera.position.copy(middle).addScaledVector(new THREE.Vector3(...direction).normalize(), 4 * size);
    Object.assign(this.camera, { near: 0.1 * size, far: 8 * size, zoom: 1 });
    this.controls.target.copy(middle);
    this.camera.lookAt(middle);
    this.camera.updateMatrixWorld();
    this.reach = this.extent();
    this.resize();
    this.controls.update();
  }

  /** Half width and height [mm] that the run takes up as the camera sees it now. */
  extent() {
    const { low, high } = this.run.room, reach = [0, 0], p = new THREE.Vector3();
    for (let k = 0; k < 8; k++) {
      p.set(...[0, 1, 2].map(c => (k >> c & 1 ? high : low)[c])).applyMatrix4(this.camera.matrixWorldInverse);
      reach[0] = Math.max(reach[0], Math.abs(p.x));
      reach[1] = Math.max(reach[1], Math.abs(p.y));
    }
    return reach.map(half => half + this.run.radius);
  }

  resize() {
    const stage = one("stage"), wide = stage.clientWidth, high = stage.clientHeight;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio || 1, 2));
    this.renderer.setSize(wide, high);
    const half = 1.08 * Math.max(this.reach[1], this.reach[0] * high / wide);
    Object.assign(this.camera, { left: -half * wide / high, right: half * wide / high, bottom: -half, top: half });
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  /** Show the moment `at`, 0 to 1 of the time that the frames cover; between frames positions are interpolated. */
  goto(at) {
    const time = this.header.time, last = time.length - 1, t = time[0] + at * (time[last] - time[0]);
    this.at = at;
    let a = 0;
    while (a < last - 1 && time[a + 1] <= t) a++;
    const b = Math.min(a + 1, last), step = time[b] - time[a];
    const share = step > 0 ? Math.max((t - time[a]) / step, 0) : 0, between = share > 1 - 1e-6 ? 1 : share;
    between === 1 ? this.run.show(b, b, 0) : this.run.show(a, b, between);
    this.readout(t, between === 1 ? b : a, between);
    one("time").value = Math.round(1000 * at);
    this.draw();
  }

  readout(t, frame, between) {
    const { curve, time, timed } = this.header, inside = between > 1e-6 && between < 1;
    const parts = [inside ? `between frames ${frame + 1} and ${frame + 2}` : `frame ${frame + 1} of ${time.length}`];
    if (timed) parts.unshift(`${t.toFixed(2)} ms`);
    if (curve) {
      let k = 0;
      while (k < curve.time.length - 1 && curve.time[k + 1] <= t) k++;
      parts.push(`${curve.xlabel}: ${signed(curve.x[k])}`, `${curve.ylabel}: ${signed(curve.y[k])}`);
      one("mark").setAttribute("transform", `translate(${curve.place[k].join(" ")})`);
    }
    one("readout").textContent = parts.join(" · ");
    root.dataset.frame = frame;
  }

  toFrame(k) {
    const time = this.header.time, last = time.length - 1, whole = time[last] - time[0];
    this.goto(whole > 0 ? (time[Math.min(Math.max(k, 0), last)] - time[0]) / whole : 0);
  }

  nearest() {
    const time = this.header.time, t = time[0] + this.at * (time.at(-1) - time[0]);
    return time.reduce((best, v, k) => Math.abs(v - t) < Math.abs(time[best] - t) ? k : best, 0);
  }

  play(on) {
    this.playing = on;
    one("play").textContent = on ? "❚❚" : "▶";
    one("play").setAttribute("aria-label", on ? "Pause" : "Play");
    if (!on) return this.toFrame(this.nearest());
    let before = performance.now(), at = this.at >= 1 ? 0 : this.at;
    const tick = now => {
      if (!this.playing) return;
      at += (now - before) / 1000 / LOOP;
      before = now;
      this.goto(at > 1.15 ? at = 0 : Math.min(at, 1));  // rest at the end before it begins again
      requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  bind() {
    one("play").addEventListener("click", () => this.play(!this.playing));
    one("time").addEventListener("input", event => {
      if (this.playing) this.play(false);
      this.goto(event.target.value / 1000);
    });
    one("time").addEventListener("change", () => this.toFrame(this.nearest()));
    one("colour").addEventListener("change", event => this.colourBy(+event.target.value));
    for (const button of document.querySelectorAll("[data-look]")) button.addEventListener("click", () => this.look(button.dataset.look));
    addEventListener("keydown", event => {
      if (event.target.matches("input, select, button")) return;
      if (event.key === " ") { event.preventDefault(); this.play(!this.playing); }
      if (event.key === "ArrowRight" || event.key === "ArrowLeft") this.toFrame(this.nearest() + (event.key === "ArrowRight" ? 1 : -1));
    });
  }

  draw() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => { this.waiting = false; this.renderer.render(this.run.scene, this.camera); });
  }

  /** State asked for after # in the address: frame (from 1), colour, look. */
  asked() {
    const asked = new URLSearchParams(location.hash.slice(1));
    const colour = this.colours.findIndex(c => c.label === asked.get("colour"));
    if (["top", "side", "oblique"].includes(asked.get("look"))) this.look(asked.get("look"));
    if (colour >= 0) this.colourBy(colour);
    this.toFrame(asked.has("frame") ? asked.get("frame") - 1 : 0);
  }
}

async function start() {
  if (!("DecompressionStream" in window)) return trouble("This browser is too old for this page: it cannot inflate data. Any of 2023 or later can.");
  const header = JSON.parse(one("header").textContent);
  let renderer;
  try {
    renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true, preserveDrawingBuffer: true });
  } catch (error) {
    return trouble("This browser shows no 3D pictures: WebGL 2 is missing or switched off.");
  }
  renderer.outputColorSpace = THREE.LinearSRGBColorSpace;  // colours are sRGB as they are
  renderer.debug.onShaderError = (gl, program, vertex, fragment) =>
    trouble(`The picture cannot be drawn: ${gl.getShaderInfoLog(vertex) || ""} ${gl.getShaderInfoLog(fragment) || ""} ${gl.getProgramInfoLog(program) || ""}`);
  one("stage").append(renderer.domElement);
  const view = new View(header, new RunScene(header, await inflated(one("data").textContent)), renderer);
  view.asked();
  renderer.render(view.run.scene, view.camera);
  const drawn = renderer.info.render;
  if (root.dataset.state !== "trouble") root.dataset.state = "ready";
  root.dataset.drawn = `${drawn.calls} ${drawn.triangles}`;
}

start().catch(error => trouble(`This page cannot be shown: ${error.message}`));
