"use strict";
// Figures are made for white paper, as they are saved and printed. Where the reader prefers a dark scheme a page shows
// them in its own --ink on its own --ground: greys change places between the two, hues are lightened as far as they
// need to be seen. Opaque areas, lists and scales of colours stay: ids and numbers are written on them.

const DARK = matchMedia("screen and (prefers-color-scheme: dark)");
const GREY = 40; // of 255 between the channels, below which a colour counts as a grey
const CONTRAST = 4.5; // at least, of a hue on the ground
let on_paper = false;
addEventListener("beforeprint", () => (on_paper = true));
addEventListener("afterprint", () => (on_paper = false));

// Every place of a figure that holds one colour, with the colour that it has on white paper.
function colours_of(part, found = []) {
  for (const [key, value] of Object.entries(part)) {
    if (typeof value === "string") {
      if (/color$/.test(key)) found.push({ part, key, light: value });
    } else if (value !== null && typeof value === "object" && !ArrayBuffer.isView(value)) {
      if (!Array.isArray(value) || typeof value[0] === "object") colours_of(value, found);
    }
  }
  return found;
}

function paint(colours) {
  const dark = DARK.matches && !on_paper;
  const style = getComputedStyle(document.documentElement);
  const [ink, ground] = ["--ink", "--ground"].map((name) => channels(style.getPropertyValue(name).trim()));
  for (const { part, key, light } of colours) part[key] = dark ? in_the_dark(key, light, ink, ground) : light;
}

const brush = document.createElement("canvas").getContext("2d");
function channels(colour) {
  brush.fillStyle = colour;
  const said = brush.fillStyle; // #rrggbb, or rgba(…) of what is translucent
  if (said.startsWith("#")) return [1, 3, 5].map((at) => parseInt(said.slice(at, at + 2), 16)).concat(1);
  return said.match(/[\d.]+/g).map(Number);
}

function in_the_dark(key, light, ink, ground) {
  if (/^(paper|plot)_bgcolor$/.test(key)) return "rgba(0, 0, 0, 0)";
  let [red, green, blue, alpha] = channels(light);
  if (key === "fillcolor" && alpha === 1) return light;
  let rgb = [red, green, blue];
  if (Math.max(...rgb) - Math.min(...rgb) < GREY) rgb = mixed(ink, ground, (red + green + blue) / 765);
  else while (contrast(rgb, ground) < CONTRAST) rgb = mixed(rgb, [255, 255, 255], 0.1);
  return `rgba(${rgb.map(Math.round).join(", ")}, ${alpha})`;
}

const mixed = (one, other, share) => [0, 1, 2].map((at) => one[at] + share * (other[at] - one[at]));

// WCAG's, of two opaque colours.
function contrast(one, other) {
  const [high, low] = [luminance(one), luminance(other)].sort((first, second) => second - first);
  return (high + 0.05) / (low + 0.05);
}
function luminance(rgb) {
  const linear = rgb.slice(0, 3).map((value) => (value <= 10 ? value / 3294.6 : ((value / 255 + 0.055) / 1.055) ** 2.4));
  return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2];
}

// Plots that a page without a server has drawn already.
function follow_scheme(plots) {
  const colours = plots.map((plot) => colours_of({ data: plot.data, layout: plot.layout }));
  const repaint = () => {
    colours.forEach(paint);
    plots.forEach((plot) => Plotly.redraw(plot));
  };
  if (DARK.matches) repaint();
  DARK.addEventListener("change", repaint);
  for (const event of ["beforeprint", "afterprint"]) addEventListener(event, () => DARK.matches && repaint());
}
