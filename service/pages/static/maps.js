"use strict";
// Maps of arrays as a page has room for them, and as they are seen in the dark.

const BAR = 75; // pixels, of a scale of colours below a map, or beside it
const BELOW = 10; // pixels, of its room that stay free
const LETTER = 0.62; // of a font's size: how wide a letter of an id is
const DIM = 0.75; // how far what is grey lies from the ink to the ground, in the dark

// The scale of colours lies below a narrow map, which is as high as its array; ids stand where they have room. Returns
// the height of the figure.
function fit_map(plot, data, layout, margin, height) {
  const [x, y] = [layout.xaxis?.range, layout.yaxis?.range];
  if (!layout.yaxis?.scaleanchor || !x || !y) return height;
  const [wide, high] = [x, y].map(([low, up]) => Math.abs(up - low));
  const bar = data.map((trace) => trace.colorbar ?? trace.marker?.colorbar).find((one) => one);
  const narrow = plot.clientWidth < NARROW;
  let room = plot.clientWidth - margin.l - margin.r;
  const upright = bar && bar.orientation !== "h";
  if (upright && narrow) margin.b += BAR;
  else if (upright) room -= BAR;
  const entries = layout.showlegend === false ? 0 : data.filter((trace) => trace.showlegend !== false).length;
  const edges = margin.t + margin.b + LEGEND_LINE * (narrow ? entries : Math.min(entries, 1));
  if (narrow) height = Math.min(height, edges + (room * high) / wide);
  if (upright && narrow) {
    Object.assign(bar, { orientation: "h", y: (BELOW - margin.b) / (height - edges), yanchor: "bottom", thickness: 12 });
    bar.title.side = "top";
  }
  if (layout.meta?.alike) fit_ids(data, Math.min(room / wide, (height - edges) / high));
  return height;
}

// All ids where none overlaps another; else those of sensors that differ, each that overlaps none before it.
function fit_ids(data, scale) {
  const written = data.filter((trace) => trace.mode?.includes("text"));
  const ids = written.flatMap((trace) => trace.text.map((text, index) => ({ trace, index, text })));
  const overlap = (one, other) => {
    const away = (axis) => scale * Math.abs(one.trace[axis][one.index] - other.trace[axis][other.index]);
    const size = one.trace.textfont.size;
    return away("y") < size && away("x") < (LETTER * size * (one.text.length + other.text.length)) / 2;
  };
  const free = (kept, id) => kept.every((one) => !overlap(one, id));
  if (ids.every((id, index) => free(ids.slice(0, index), id))) return;
  const kept = [];
  for (const id of ids) {
    if (id.trace.meta !== "alike" && free(kept, id)) kept.push(id);
    else id.trace.text[id.index] = "";
  }
}

// On a dark ground what is not different is dim, and a ring of ink shows what is, however dark its colour.
function dim_map(data, { meta, shapes }) {
  if (!meta?.alike || !DARK.matches || on_paper) return;
  const style = getComputedStyle(document.documentElement);
  const [ink, ground] = ["--ink", "--ground"].map((name) => channels(style.getPropertyValue(name).trim()));
  const css = (rgb) => `rgb(${rgb.slice(0, 3).map(Math.round).join(", ")})`;
  const dark = { [meta.alike]: css(mixed(ink, ground, DIM)), [meta.unknown]: css(ground) };
  for (const disc of shapes.filter((shape) => shape.name === "sensor")) {
    if (dark[disc.fillcolor]) disc.fillcolor = dark[disc.fillcolor];
    else if (disc.line.width === 1) disc.line = { color: css(ink), width: 1.5 };
  }
  for (const { marker, mode, textfont } of data) {
    if (!Array.isArray(marker?.color) || !dark[marker.color.find((colour) => dark[colour])]) continue;
    if (mode.includes("text")) textfont.color = textfont.color.map((own, at) => (dark[marker.color[at]] ? css(ink) : own));
    marker.color = marker.color.map((colour) => dark[colour] ?? colour);
  }
}
