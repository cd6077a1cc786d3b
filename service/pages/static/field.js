"use strict";
// The contact as it grows with the load: its frames come once, when somebody moves the slider or plays them.

const growing = document.getElementById("growing");
const load = document.getElementById("load");
const play = document.getElementById("play");
const PAUSE = 120; // ms between frames
let frames = null;
let playing = false;
let wanted = 0; // the frame that was asked for last
let run_number = 0;

async function all_frames() {
  frames ??= fetch(growing.dataset.frames).then((response) => {
    if (!response.ok) throw new Error(`The frames did not come: ${response.status}`);
    return response.json();
  });
  return frames.catch((error) => {
    frames = null; // to be asked for again
    set_playing(false);
    throw error;
  });
}

// The figures hold what they show, so that what is saved or printed is the frame in sight.
async function show(number) {
  wanted = number;
  const { told, figures } = (await all_frames())[number - 1];
  if (wanted !== number) return; // a later one took this one's place
  load.value = String(number);
  load.setAttribute("aria-valuetext", told[0]);
  document.querySelectorAll("[data-told]").forEach((entry, index) => (entry.textContent = told[index]));
  for (const [name, traces] of Object.entries(figures)) {
    const place = document.getElementById(`figure-${name}`);
    const script = place.querySelector('script[type="application/json"]');
    const figure = JSON.parse(script.textContent);
    traces.forEach((changed, index) => Object.assign(figure.data[index], changed));
    script.textContent = JSON.stringify(figure);
    const plot = place.querySelector(".plot");
    if (plot.dataset.drawn) await redraw(plot);
    if (wanted !== number) return;
  }
}

function set_playing(on) {
  playing = on;
  play.textContent = on ? "Pause" : "Play";
}

async function run() {
  const own = ++run_number;
  let number = load.value === load.max ? 0 : Number(load.value);
  while (playing && own === run_number && number < Number(load.max)) {
    await show(++number);
    await new Promise((done) => setTimeout(done, PAUSE));
  }
  if (own === run_number) set_playing(false);
}

if (growing) {
  growing.hidden = false;
  const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
  play.hidden = still;
  document.getElementById("still").hidden = !still;
  load.addEventListener("input", () => {
    set_playing(false);
    show(Number(load.value));
  });
  play.addEventListener("click", () => {
    set_playing(!playing);
    if (playing) run();
  });
}
