// The slider of the page, its player, and the views: all of them show the frame that the slider selects.
"use strict";

const find = (id) => document.getElementById(id);
const views = [];
let current = 0;

function show(frame) {
  current = Math.max(0, Math.min(frameCount - 1, frame));
  const time = fixed(at("time", current), 3);
  find("frame").value = current;
  find("frame").setAttribute("aria-valuetext", `${time} seconds`);
  find("now").textContent = `t = ${time} s`;
  views.forEach((view) => view(current));
}

// Plays the run in real time or a multiple of it.
function addPlayer() {
  let playing = false;
  let begun = 0;
  let from = 0;
  let fresh = true; // the page opens at the peak, but plays from the start
  const button = find("play");
  const stop = () => {
    playing = false;
    button.textContent = "Play";
  };
  const step = (now) => {
    if (!playing) return;
    const time = from + ((now - begun) / 1000) * Number(find("speed").value);
    let frame = current;
    while (frame + 1 < frameCount && at("time", frame + 1) <= time) frame += 1;
    if (frame !== current) show(frame);
    if (frame === frameCount - 1) stop();
    else requestAnimationFrame(step);
  };
  const clock = () => { [begun, from] = [performance.now(), at("time", current)]; };
  const start = () => {
    if (fresh || current === frameCount - 1) show(0);
    fresh = false;
    playing = true;
    clock();
    button.textContent = "Pause";
    requestAnimationFrame(step);
  };
  button.addEventListener("click", () => (playing ? stop() : start()));
  find("speed").addEventListener("change", clock);
  find("frame").addEventListener("input", (event) => {
    fresh = false;
    stop();
    show(Number(event.target.value));
  });
}
