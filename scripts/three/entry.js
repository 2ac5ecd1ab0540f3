// The classes of three.js that report and dashboard use.
export {
  AmbientLight, Box3, BufferAttribute, BufferGeometry, Color, CylinderGeometry, DataTexture, DirectionalLight, DoubleSide, FrontSide,
  EdgesGeometry, Float32BufferAttribute, GridHelper, Group, HemisphereLight, Line, LineBasicMaterial, LineSegments, Matrix4, Mesh,
  MeshBasicMaterial, MeshLambertMaterial, MeshPhongMaterial, OrthographicCamera, PerspectiveCamera, Plane, Quaternion, Scene,
  SphereGeometry, SRGBColorSpace, Sphere, Vector2, Vector3, WebGLRenderer,
} from "three";
export { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
