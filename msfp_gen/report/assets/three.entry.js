// What the page uses of three.js; docs/report.md says how three.min.js is made of it.
export {
  BufferGeometry, CanvasTexture, Color, DirectionalLight, DoubleSide, Float32BufferAttribute, GridHelper, Group,
  HemisphereLight, LatheGeometry, Line, LineBasicMaterial, LineLoop, Mesh, MeshStandardMaterial, PerspectiveCamera,
  Scene, Shape, ShapeGeometry, Sprite, SpriteMaterial, Vector2, Vector3, WebGLRenderer,
} from "three";
export { OrbitControls } from "three/addons/controls/OrbitControls.js";
