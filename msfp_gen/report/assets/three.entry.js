// The parts of three.js that the HTML report uses; docs/report.md describes how three.min.js is built from them.
export {
  BufferGeometry, CanvasTexture, Color, DirectionalLight, DoubleSide, Float32BufferAttribute, GridHelper, Group,
  HemisphereLight, LatheGeometry, Line, LineBasicMaterial, LineLoop, Mesh, MeshStandardMaterial, PerspectiveCamera,
  Scene, Shape, ShapeGeometry, Sprite, SpriteMaterial, Vector2, Vector3, WebGLRenderer,
} from "three";
export { OrbitControls } from "three/addons/controls/OrbitControls.js";
