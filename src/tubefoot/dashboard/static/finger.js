// The finger in three dimensions: the design's outline carried along the measured middle line.
import {
  BufferAttribute, BufferGeometry, Color, DirectionalLight, DoubleSide, GridHelper, HemisphereLight, Mesh, MeshLambertMaterial,
  OrbitControls, PerspectiveCamera, Scene, WebGLRenderer,
} from "/vendored/three/three.min.js";
import { token } from "./link.js";
import { paced } from "./pace.js";
import { SHAPE } from "./wire.js";

const DRAW_MS = 100;  // without a graphics card every drawing costs
const canvas = document.getElementById("finger");
let view = null;

export async function prepareFinger() {
  const answer = await fetch("/api/finger", { headers: { "X-Tubefoot-Token": token } });
  try {
    view = new View(await answer.json());
  } catch (fault) {
    const note = document.createElement("p");
    note.textContent = "This browser offers no WebGL: no 3D view.";
    canvas.replaceWith(note);
    console.warn("no 3D view", fault);
  }
}

export function showFinger(news) {
  if (view && news[SHAPE]?.count > 1) view.bend(news[SHAPE]);
}

class View {
  constructor(model) {
    this.model = model;
    this.renderer = new WebGLRenderer({ canvas, antialias: true });
    this.draw = paced(() => this.renderer.render(this.scene, this.camera), DRAW_MS);
    this.scene = new Scene();
    this.scene.background = new Color("#eef2f7");
    this.scene.add(new HemisphereLight("#ffffff", "#8894a5", 2.2));
    const sun = new DirectionalLight("#ffffff", 2.0);
    sun.position.set(60, 120, 180);
    this.scene.add(sun);
    this.scene.add(new GridHelper(120, 12, "#9aa5b5", "#ccd4de"));
    this.camera = new PerspectiveCamera(32, 1, 10, 1000);
    const length = model.length_mm;
    this.camera.position.set(0.9 * length, 0.85 * length, 2.3 * length);
    this.orbit = new OrbitControls(this.camera, canvas);
    this.orbit.target.set(0, 0.45 * length, 0);
    this.orbit.enableZoom = false;  // the wheel scrolls the page
    this.orbit.enablePan = false;
    this.orbit.addEventListener("change", this.draw);
    this.places = new Float32Array(model.outline.length * 4 * 3);
    this.scene.add(new Mesh(this.geometry(), new MeshLambertMaterial({ color: "#3b8fb5", side: DoubleSide, flatShading: true })));
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.bend({ count: 2, values: new Float32Array([0, 0, 0, 0, length, 0]) });
    this.orbit.update();
  }

  // Four corners at each height: right front, right back, left front, left back.
  geometry() {
    const rings = this.model.outline.length, faces = [];
    for (let ring = 0; ring + 1 < rings; ring++) {
      const here = 4 * ring, up = here + 4;
      for (const [a, b] of [[0, 1], [1, 3], [3, 2], [2, 0]]) {
        faces.push(here + a, here + b, up + a, up + a, here + b, up + b);
      }
    }
    const top = 4 * (rings - 1);
    for (const end of [0, top]) faces.push(end, end + 1, end + 2, end + 2, end + 1, end + 3);
    const made = new BufferGeometry();
    made.setAttribute("position", new BufferAttribute(this.places, 3));
    made.setIndex(faces);
    this.shape = made;
    return made;
  }

  bend({ count, values }) {
    const { outline, depth_mm: depth, length_mm: length } = this.model;
    outline.forEach(([height, half], ring) => {
      const place = Math.min(Math.max(height / length, 0), 1) * (count - 1);
      const below = Math.min(Math.floor(place), count - 2), share = place - below;
      const mix = (at) => (1 - share) * values[3 * below + at] + share * values[3 * below + 3 + at];
      const x = mix(0), z = mix(1), angle = mix(2);
      for (const [corner, side, front] of [[0, 1, 1], [1, 1, -1], [2, -1, 1], [3, -1, -1]]) {
        const at = 3 * (4 * ring + corner);
        this.places[at] = x + side * half * Math.cos(angle);
        this.places[at + 1] = z + side * half * Math.sin(angle);
        this.places[at + 2] = front * depth / 2;
      }
    });
    this.shape.attributes.position.needsUpdate = true;
    this.shape.computeBoundingSphere();
    this.draw();
  }

  resize() {
    const width = canvas.clientWidth, height = canvas.clientHeight;
    if (!width || !height) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.draw();
  }
}
