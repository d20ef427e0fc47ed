// The stack in three dimensions by three.js: bodies of revolution, cut along the plane of the section. Lengths in metres.
"use strict";

const SEGMENTS = 48;
const TONES = [0xa9b4be, 0xd3dae0];
const FORCE = 0xc62828;
const VIEWS = { oblique: [-0.35, -1, 0.42], side: [0, -1, 0.02], above: [0, -0.02, 1] };

// LatheGeometry turns a profile about y; the axis of a body is z here, and the cut faces the viewer.
function revolved(points, open) {
  const profile = points.map(([r, h]) => new THREE.Vector2(r, h));
  const [start, length] = open ? [Math.PI / 2, Math.PI] : [0, 2 * Math.PI];
  return new THREE.LatheGeometry(profile, SEGMENTS, start, length).rotateX(Math.PI / 2).rotateZ(report.azimuth);
}

function cutFace(pieces) {
  const half = pieces.flatMap(({ points }) => points);
  const outline = [...half, ...half.map(([r, h]) => [-r, h]).reverse()];
  const shape = new THREE.Shape(outline.map(([r, h]) => new THREE.Vector2(r, h)));
  return new THREE.ShapeGeometry(shape).rotateX(Math.PI / 2).rotateZ(report.azimuth);
}

function material(colour, extra = {}) {
  return new THREE.MeshStandardMaterial({ color: colour, roughness: 0.55, metalness: 0.25, side: THREE.DoubleSide, ...extra });
}

function bodyGroup(pieces, body, open) {
  const group = new THREE.Group();
  for (const { surface, points } of pieces) {
    const colour = surface ? colourOf(surface - 1) : TONES[body % 2];
    group.add(new THREE.Mesh(revolved(points, open), material(colour)));
  }
  if (open) group.add(new THREE.Mesh(cutFace(pieces), material(TONES[body % 2], { roughness: 0.9, metalness: 0 })));
  return group;
}

function lineOf(count, colour, Kind) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(new Float32Array(3 * count), 3));
  return new Kind(geometry, new THREE.LineBasicMaterial({ color: colour, depthTest: false, transparent: true }));
}

function circleLine(colour) {
  const line = lineOf(SEGMENTS, colour, THREE.LineLoop);
  const { position } = line.geometry.attributes;
  for (let k = 0; k < SEGMENTS; k += 1) {
    const angle = (2 * Math.PI * k) / SEGMENTS;
    position.setXYZ(k, Math.cos(angle), Math.sin(angle), 0);
  }
  return line;
}

function label(text, colour, at, size) {
  const canvas = Object.assign(document.createElement("canvas"), { width: 64, height: 64 });
  const pen = canvas.getContext("2d");
  Object.assign(pen, { font: "bold 40px sans-serif", fillStyle: colour, textAlign: "center", textBaseline: "middle" });
  pen.fillText(text, 32, 32);
  const map = Object.assign(new THREE.CanvasTexture(canvas), { colorSpace: "srgb" });
  const sprite = new THREE.Sprite(new THREE.SpriteMaterial({ map, depthTest: false }));
  sprite.position.copy(at);
  sprite.scale.setScalar(size);
  return sprite;
}

// A grid along E1 and E2, and the three axes at its corner.
function floor(size) {
  const group = new THREE.Group();
  const grid = new THREE.GridHelper(size, 10, 0x888888, 0x888888).rotateX(Math.PI / 2);
  Object.assign(grid.material, { transparent: true, opacity: 0.35 });
  group.add(grid);
  const [c, s] = horizontal; // the corner behind the stack, to the left of a viewer of the cut
  const corner = new THREE.Vector3(-c - s, c - s, 0).multiplyScalar(size / 2);
  [["E₁", "#D55E00", [1, 0, 0]], ["E₂", "#009E73", [0, 1, 0]], ["E₃", "#0072B2", [0, 0, 1]]].forEach(([name, colour, way]) => {
    const tip = corner.clone().addScaledVector(new THREE.Vector3(...way), size / 6);
    const axis = lineOf(2, colour, THREE.Line);
    axis.geometry.attributes.position.setXYZ(0, ...corner.toArray());
    axis.geometry.attributes.position.setXYZ(1, ...tip.toArray());
    group.add(axis, label(name, colour, tip.addScaledVector(new THREE.Vector3(...way), size / 40), size / 18));
  });
  return group;
}

function lights(scene) {
  scene.add(new THREE.HemisphereLight(0xffffff, 0xb0b4bc, 2.6));
  const sun = new THREE.DirectionalLight(0xffffff, 1.9);
  const [c, s] = horizontal; // light from the upper left of a viewer of the cut
  sun.position.set(-0.6 * c + s, -0.6 * s - c, 1.2);
  scene.add(sun);
}

// Radius and height of a cylinder about E3 that contains the bodies in all frames; with the motion of the base unless it
// is held still.
function cylinder(still) {
  let [radius, top] = [0, 0];
  for (let frame = 0; frame < frameCount; frame += 1) {
    const [x, y] = still ? [0, 0] : at("base", frame);
    report.bodies.forEach((pieces, body) => {
      const points = pieces.flatMap((piece) => piece.points);
      const bottom = at("bottom", frame, body);
      radius = Math.max(radius, Math.hypot(bottom[0] + x, bottom[1] + y) + Math.max(...points.map(([r]) => r)));
      top = Math.max(top, bottom[2] + Math.max(...points.map(([, h]) => h)));
    });
  }
  return [radius, top];
}

// Points on the edges of that cylinder, relative to the target of the camera.
function corners([radius, top], target) {
  const angles = Array.from({ length: 16 }, (_, k) => (Math.PI * k) / 8);
  return [0, top].flatMap((z) => angles.map((angle) => (
    new THREE.Vector3(radius * Math.cos(angle), radius * Math.sin(angle), z).sub(target)
  )));
}

// The least distance of the camera along `away` from which all corners are in the frame.
function fittingDistance(points, away, camera) {
  const right = new THREE.Vector3().crossVectors(camera.up, away).normalize();
  const up = new THREE.Vector3().crossVectors(away, right);
  const high = Math.tan((camera.fov * Math.PI) / 360);
  return 1.05 * Math.max(...points.map((point) => point.dot(away) + Math.max(
    Math.abs(point.dot(right)) / (high * camera.aspect), Math.abs(point.dot(up)) / high,
  )));
}

// Adds the view to `parent`. Returns { show, setView, settings }, or null if the browser has no WebGL.
function addScene(parent) {
  const renderer = addRenderer(parent, "The bearing in three dimensions", "the bearing is drawn from the side only.");
  if (!renderer) return null;
  const scene = new THREE.Scene();
  lights(scene);
  const settings = { open: true, forces: true, still: true, view: "oblique" };
  const reach = Math.max(...report.bodies.flat(2).flatMap((piece) => piece.points.map(([r]) => r)));
  const height = at("bottom", 0, report.bodies.length - 1)[2] + 0.1 * reach;
  const stack = new THREE.Group();
  scene.add(stack, floor(2.4 * cylinder(true)[0]));
  const solids = report.bodies.map((pieces, body) => {
    const both = [bodyGroup(pieces, body, true), bodyGroup(pieces, body, false)];
    const group = new THREE.Group();
    group.add(...both);
    stack.add(group);
    return { group, both };
  });
  const forces = new THREE.Group();
  const marks = report.surfaces.map(({ colour }) => {
    const mark = { circle: circleLine(colour), line: lineOf(2, FORCE, THREE.Line) };
    forces.add(mark.circle, mark.line);
    return mark;
  });
  stack.add(forces);
  const camera = new THREE.PerspectiveCamera(28, 1, reach / 50, reach * 200);
  camera.up.set(0, 0, 1);
  const controls = new THREE.OrbitControls(camera, renderer.domElement);
  const draw = () => {
    marks.forEach(({ circle }) => circle.quaternion.copy(camera.quaternion));
    renderer.render(scene, camera);
  };
  controls.addEventListener("change", draw);
  const setView = () => {
    const [x, y, z] = VIEWS[settings.view];
    const [c, s] = horizontal;
    const away = new THREE.Vector3(c * x - s * y, s * x + c * y, z).normalize();
    controls.target.set(0, 0, height / 2);
    const distance = fittingDistance(corners(cylinder(settings.still), controls.target), away, camera);
    camera.position.copy(controls.target).addScaledVector(away, distance);
    controls.update();
    draw();
  };
  const show = (frame) => {
    const [x, y, z] = settings.still ? [0, 0, 0] : at("base", frame);
    stack.position.set(x, y, z);
    forces.visible = settings.forces;
    solids.forEach(({ group, both: [cut, whole] }, body) => {
      group.position.set(...at("bottom", frame, body));
      group.quaternion.set(...at("turn", frame, body));
      [cut.visible, whole.visible] = [settings.open, !settings.open];
    });
    marks.forEach(({ circle, line }, surface) => {
      circle.position.set(...at("centre", frame, surface));
      circle.scale.setScalar(at("circle", frame)[surface]);
      setForceLine(line, at("line", frame, surface), at("force", frame, surface));
    });
    draw();
  };
  followSize(parent, renderer, camera, setView);
  return { show, setView, settings };
}

// Heights between which lines of force are drawn: from the lowest to the highest friction circle.
const heights = surfaceNumbers.flatMap((j) => [-1, 1].map((side) => at("centre", 0, j)[2] + side * 1.3 * report.surfaces[j].circle));
const [lowest, highest] = [Math.min(0, ...heights), Math.max(...heights)];

// Sets the ends of a line of force through `point` along `force`; hides it if there is no vertical force.
function setForceLine(line, point, force) {
  line.visible = Math.abs(force[2]) > 0;
  if (!line.visible) return;
  const { position } = line.geometry.attributes;
  [lowest, highest].forEach((z, end) => {
    const share = (z - point[2]) / force[2];
    position.setXYZ(end, point[0] + share * force[0], point[1] + share * force[1], z);
  });
  position.needsUpdate = true;
  line.geometry.computeBoundingSphere();
}
