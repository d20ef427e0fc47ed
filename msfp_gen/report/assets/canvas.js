// A canvas of a page that WebGL draws.
"use strict";

// A renderer on a canvas in `parent`; without WebGL the note instead, and null.
function addRenderer(parent, label, note) {
  const canvas = element(parent, "canvas", { role: "img", "aria-label": `${label}; drag to turn, wheel to zoom` });
  const context = canvas.getContext("webgl2", { antialias: true, alpha: true, preserveDrawingBuffer: true });
  if (!context) {
    canvas.remove();
    element(parent, "p", { class: "note" }, `This browser has no WebGL: ${note}`);
    return null;
  }
  return new THREE.WebGLRenderer({ canvas, context, alpha: true });
}

// Keeps the picture as large as `parent`; `setView` places the camera.
function followSize(parent, renderer, camera, setView) {
  new ResizeObserver(() => {
    const { clientWidth, clientHeight } = parent;
    renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    renderer.setSize(clientWidth, clientHeight, false);
    camera.aspect = clientWidth / clientHeight;
    camera.updateProjectionMatrix();
    setView();
  }).observe(parent);
  setView();
}

function addViewButtons(scene) {
  for (const button of document.querySelectorAll("[data-view]")) {
    button.addEventListener("click", () => {
      scene.settings.view = button.dataset.view;
      scene.setView();
    });
  }
}
