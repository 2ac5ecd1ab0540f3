// The stressed finger in space: one or two runs, a slider over their states, a colour scale, turning by mouse or keys.
// The data are those of report/scene.py; without WebGL the still picture stays.
import {
  AmbientLight, BufferAttribute, BufferGeometry, Color, DirectionalLight, DoubleSide, Group, Mesh, MeshLambertMaterial,
  OrbitControls, OrthographicCamera, Scene, SRGBColorSpace, Vector3, WebGLRenderer,
} from "three";

const FULL = Math.PI; // a Lambert surface that faces a light of this strength shows its own colour
const AMBIENT = 0.45;
const GAP_MM = 6;
const TURN = Math.PI / 18;
const PLAY_MS = 500;

const figure = document.getElementById("viewer-data").closest("figure");
const data = JSON.parse(document.getElementById("viewer-data").textContent);
const control = (name) => figure.querySelector(`[data-viewer="${name}"]`);

async function unpacked(run) {
  const bytes = Uint8Array.from(atob(run.data), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const buffer = await new Response(stream).arrayBuffer();
  const triangles = new Uint32Array(buffer, 0, 3 * run.triangles);
  let at = triangles.byteLength;
  const states = run.states.map((row) => {
    const raw = new Uint16Array(buffer.slice(at, at + 6 * run.points));
    at += 6 * run.points;
    const values = data.fields.map(() => {
      const field = new Uint8Array(buffer, at, run.points);
      at += run.points;
      return field;
    });
    return { row, raw, values };
  });
  return { ...run, triangles, states };
}

function positionsOf(run, raw) {
  const points = new Float32Array(3 * run.points);
  for (let axis = 0; axis < 3; axis++) {
    const low = run.low[axis], step = (run.high[axis] - low) / 65535, from = axis * run.points;
    for (let i = 0; i < run.points; i++) points[3 * i + axis] = low + step * raw[from + i];
  }
  return points;
}

function tableOf(field) {
  const stops = field.colours.map((code) => new Color().setStyle(code, SRGBColorSpace));
  const table = new Float32Array(3 * 256);
  const mixed = new Color();
  for (let value = 0; value < 256; value++) {
    const place = (value / 255) * (stops.length - 1), below = Math.min(Math.floor(place), stops.length - 2);
    mixed.lerpColors(stops[below], stops[below + 1], place - below).toArray(table, 3 * value);
  }
  return table;
}

function coloursOf(values, table, negated) {
  const colours = new Float32Array(3 * values.length);
  for (let i = 0; i < values.length; i++) {
    const from = 3 * (negated ? 255 - values[i] : values[i]);
    colours[3 * i] = table[from];
    colours[3 * i + 1] = table[from + 1];
    colours[3 * i + 2] = table[from + 2];
  }
  return colours;
}

class Finger {
  constructor(run) {
    this.run = run;
    this.group = new Group();
    const material = new MeshLambertMaterial({ vertexColors: true, side: DoubleSide });
    const index = new BufferAttribute(run.triangles, 1);
    this.halves = (run.half ? [1, -1] : [1]).map((side) => {
      const geometry = new BufferGeometry();
      geometry.setIndex(index);
      const mesh = new Mesh(geometry, material);
      mesh.scale.y = side;
      mesh.frustumCulled = false;
      this.group.add(mesh);
      return mesh;
    });
  }

  show(number, field, table, open) {
    const state = this.run.states[number];
    const positions = new BufferAttribute(positionsOf(this.run, state.raw), 3);
    for (const mesh of this.halves) {
      const mirrored = mesh.scale.y < 0;
      const values = state.values[field];
      mesh.geometry.setAttribute("position", positions);
      mesh.geometry.setAttribute(
        "color", new BufferAttribute(coloursOf(values, table, mirrored && data.fields[field].odd), 3));
      mesh.geometry.setDrawRange(0, 3 * (open ? this.run.triangles.length / 3 : this.run.outside));
      mesh.geometry.deleteAttribute("normal");
      mesh.geometry.computeVertexNormals();
      mesh.visible = !(open && mirrored);
    }
  }
}

class Viewer {
  constructor(runs) {
    this.runs = runs;
    this.fingers = new Map();
    this.canvas = control("canvas");
    this.renderer = new WebGLRenderer({ canvas: this.canvas, antialias: true, preserveDrawingBuffer: true });
    this.scene = new Scene();
    this.scene.background = new Color("#ffffff");
    this.camera = new OrthographicCamera(-1, 1, 1, -1, -1000, 1000);
    this.camera.up.set(0, 0, 1);
    const lamp = new DirectionalLight("#ffffff", FULL * (1 - AMBIENT));
    this.camera.add(lamp);
    lamp.position.set(0, 0, 1);
    this.scene.add(this.camera, new AmbientLight("#ffffff", FULL * AMBIENT));
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.enableZoom = true;
    this.controls.addEventListener("change", () => this.draw());
    this.tables = data.fields.map(tableOf);
    this.connect();
    this.choose();
    this.look("front");
    new ResizeObserver(() => this.resize()).observe(this.canvas.parentElement);
  }

  connect() {
    const options = (name, entries) => control(name).replaceChildren(
      ...entries.map(([value, text]) => new Option(text, value)));
    options("run", this.runs.map((run, number) => [number, run.name]));
    options("beside", [["", "nothing"], ...this.runs.map((run, number) => [number, run.name])]);
    options("field", data.fields.map((field, number) => [number, field.name]));
    control("beside").closest("label").hidden = this.runs.length < 2;
    for (const name of ["run", "beside"]) control(name).addEventListener("change", () => this.choose());
    for (const name of ["field", "open"]) control(name).addEventListener("change", () => this.show());
    control("state").addEventListener("input", () => this.show());
    control("play").addEventListener("click", () => this.play());
    for (const view of ["front", "side", "oblique"])
      control(`view-${view}`).addEventListener("click", () => this.look(view));
    this.canvas.addEventListener("keydown", (event) => this.turn(event));
  }

  finger(number) {
    if (!this.fingers.has(number)) this.fingers.set(number, new Finger(this.runs[number]));
    return this.fingers.get(number);
  }

  choose() {
    const first = Number(control("run").value), second = control("beside").value;
    this.shown = [this.finger(first)];
    if (second !== "" && Number(second) !== first) this.shown.push(this.finger(Number(second)));
    for (const finger of this.fingers.values()) this.scene.remove(finger.group);
    let edge = null;
    for (const finger of this.shown) {
      const { low, high } = finger.run;
      finger.group.position.x = edge === null ? 0 : edge + GAP_MM - low[0];
      edge = finger.group.position.x + high[0];
      this.scene.add(finger.group);
    }
    const slider = control("state");
    slider.max = this.shown[0].run.states.length - 1;
    slider.value = slider.max;
    control("open").closest("label").hidden = !this.shown.some((finger) => finger.run.half);
    this.frame();
    this.show();
  }

  frame() {
    const lows = this.shown.map(({ run, group }) => [run.low[0] + group.position.x, run.low[2]]);
    const highs = this.shown.map(({ run, group }) => [run.high[0] + group.position.x, run.high[2]]);
    const low = [0, 1].map((i) => Math.min(...lows.map((corner) => corner[i])));
    const high = [0, 1].map((i) => Math.max(...highs.map((corner) => corner[i])));
    const deep = Math.max(...this.shown.map(({ run }) => Math.max(Math.abs(run.low[1]), Math.abs(run.high[1]))));
    this.middle = new Vector3((low[0] + high[0]) / 2, 0, (low[1] + high[1]) / 2);
    this.size = [high[0] - low[0] + 1.2 * deep, high[1] - low[1] + 1.2 * deep];
    this.controls.target.copy(this.middle);
    if (this.direction) this.look(this.direction);
  }

  look(direction) {
    this.direction = direction;
    const towards = { front: [0.35, -1, 0.25], side: [1, -0.25, 0.2], oblique: [0.8, -1, 0.9] }[direction];
    this.camera.position.copy(this.middle).add(new Vector3(...towards).normalize().multiplyScalar(200));
    this.camera.zoom = 1;
    this.resize();
    this.controls.update();
  }

  turn(event) {
    const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    const zoom = { "+": 1.15, "=": 1.15, "-": 1 / 1.15 }[event.key];
    if (!steps && !zoom) return;
    event.preventDefault();
    if (zoom) this.camera.zoom *= zoom;
    else {
      const arm = this.camera.position.clone().sub(this.middle);
      arm.applyAxisAngle(new Vector3(0, 0, 1), steps[0] * TURN);
      const aside = new Vector3(0, 0, 1).cross(arm).normalize();
      const tilted = arm.clone().applyAxisAngle(aside, steps[1] * TURN);
      if (Math.abs(tilted.clone().normalize().z) < 0.99) arm.copy(tilted);
      this.camera.position.copy(this.middle).add(arm);
    }
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.draw();
  }

  play() {
    const slider = control("state");
    if (this.playing) return this.halt();
    if (slider.value === slider.max) slider.value = 0;
    control("play").textContent = "Stop";
    this.playing = setInterval(() => {
      if (slider.value === slider.max) return this.halt();
      slider.value = Number(slider.value) + 1;
      this.show();
    }, PLAY_MS);
    this.show();
  }

  halt() {
    clearInterval(this.playing);
    this.playing = null;
    control("play").textContent = "Play";
  }

  stateOf(finger, first) {
    // The second run is shown in the state whose right pressure is nearest.
    const wanted = first.row.pressure_right_kpa;
    const off = finger.run.states.map((state) => Math.abs(state.row.pressure_right_kpa - wanted));
    return off.indexOf(Math.min(...off));
  }

  show() {
    const field = Number(control("field").value), open = control("open").checked;
    const chosen = Number(control("state").value);
    const first = this.shown[0].run.states[chosen];
    const said = this.shown.map((finger, place) => {
      const number = place === 0 ? chosen : this.stateOf(finger, first);
      finger.show(number, field, this.tables[field], open && finger.run.half);
      return sentence(finger.run.name, finger.run.states[number].row);
    });
    control("said").textContent = said.join("  |  ");
    control("state").setAttribute("aria-valuetext", said[0]);
    this.canvas.setAttribute("aria-label", `Deformed finger, ${data.fields[field].name}. ${said.join(". ")}`);
    bar(data.fields[field]);
    this.draw();
  }

  resize() {
    const width = this.canvas.parentElement.clientWidth, height = this.canvas.parentElement.clientHeight;
    if (!width || !height) return;
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    const high = Math.max(this.size[1], (this.size[0] * height) / width);
    const wide = (high * width) / height;
    Object.assign(this.camera, { left: -wide / 2, right: wide / 2, top: high / 2, bottom: -high / 2 });
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  draw() {
    this.renderer.render(this.scene, this.camera);
  }
}

function sentence(name, row) {
  const one = (value) => value.toFixed(1).replace(/^-0\.0$/, "0.0").replace("-", "\u2212");
  return `${name}: ${one(row.pressure_right_kpa)} kPa right, ${one(row.pressure_left_kpa)} kPa left, ` +
    `bent by ${one(row.bend_deg)}\u00b0`;
}

function bar(field) {
  control("bar").style.background = `linear-gradient(to right, ${field.colours.join(", ")})`;
  const text = (value) => String(value).replace("-", "\u2212");
  control("low").textContent = (field.low === 0 ? "" : "\u2264 ") + text(field.low);
  control("high").textContent = `\u2265 ${text(field.high)} kPa`;
}

const panel = control("panel");
panel.hidden = false;
try {
  const viewer = new Viewer(await Promise.all(data.runs.map(unpacked)));
  figure.classList.add("live");
  viewer.resize();
  figure.dataset.ready = "yes";
} catch (reason) {
  panel.hidden = true;
  control("without").hidden = false;
  console.warn(`no view in space: ${reason}`);
}
