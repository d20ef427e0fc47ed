// The parts of three.js that the HTML report uses. three.min.js is three.js 0.187.0 (MIT, three.LICENSE), reduced to them.
// To build it again, or a newer version, in a folder that contains a copy of this file:
//   npm install three@0.187.0 esbuild@0.28.2
//   npx esbuild three.entry.js --bundle --minify --format=iife --global-name=THREE --target=es2020
//     --legal-comments=inline --outfile=three.min.js
//     --banner:js="/*! three.js 0.187.0 | MIT | https://threejs.org | the parts in three.entry.js, by esbuild 0.28.2 */"
export {
  BufferGeometry, CanvasTexture, Color, DirectionalLight, DoubleSide, Float32BufferAttribute, GridHelper, Group,
  HemisphereLight, LatheGeometry, Line, LineBasicMaterial, LineLoop, Mesh, MeshStandardMaterial, PerspectiveCamera,
  Scene, Shape, ShapeGeometry, Sprite, SpriteMaterial, Vector2, Vector3, WebGLRenderer,
} from "three";
export { OrbitControls } from "three/addons/controls/OrbitControls.js";
