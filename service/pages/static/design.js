"use strict";
// Sliders: each moves its number by the same ratio a step, and the answer comes while they move.

const form = document.getElementById("design");
const outside = document.getElementById("outside");
const refused = document.getElementById("refused");
let asking = null;

function ratio(slider) {
  return Math.log(slider.dataset.high / slider.dataset.low);
}
function place(slider) {
  const value = Number(form.elements[slider.dataset.for].value.replace(",", "."));
  slider.value = String(Math.round((1000 * Math.log(value / slider.dataset.low)) / ratio(slider)));
}

// What is wrong, and which fields it is about: [field, sentence] each, as the page marks them when it opens.
function mark(wrong) {
  refused.hidden = wrong.length === 0;
  refused.replaceChildren(
    ...wrong.map(([, sentence], index) => {
      const told = document.createElement("p");
      told.id = `wrong-${index + 1}`;
      told.textContent = sentence;
      return told;
    })
  );
  for (const input of form.querySelectorAll("input[id]")) {
    const ids = wrong.flatMap(([field], index) => (field === input.name ? [`wrong-${index + 1}`] : []));
    for (const [mark, value] of [["aria-invalid", "true"], ["aria-describedby", ids.join(" ")]]) {
      if (ids.length) input.setAttribute(mark, value);
      else input.removeAttribute(mark);
    }
  }
}

async function answer() {
  asking?.abort();
  asking = new AbortController();
  const query = new URLSearchParams(new FormData(form));
  let design;
  try {
    const response = await fetch(`/design/answer?${query}`, { signal: asking.signal });
    design = await response.json();
    if (!response.ok) design = { wrong: [["", `${design.detail} Reload the page.`]] };
  } catch {
    return; // a later question took this one's place
  }
  mark(design.wrong ?? []);
  // What was told before stands greyed beside an error: it is of other values.
  for (const part of document.querySelectorAll(".results, figure.drawn, [data-compared]")) part.classList.toggle("old", Boolean(design.wrong));
  outside.hidden = Boolean(design.wrong) || !design.outside;
  if (design.wrong) return;
  if (!document.querySelector("[data-result]")) return void location.assign(`/design?${query}`); // it opened with an error
  outside.querySelector("span").textContent = design.outside ?? "";
  history.replaceState(null, "", `/design?${query}`);
  document.querySelector("[data-query]").search = query;
  for (const [name, [text, exact, note]] of Object.entries(design.results)) {
    const entry = document.querySelector(`[data-result="${name}"]`);
    const value = entry.querySelector("b");
    value.textContent = text;
    value.title = exact;
    entry.querySelector(".quiet").textContent = note;
  }
  for (const [field, material] of Object.entries(design.materials)) {
    document.querySelector(`[data-material="${field}"]`).textContent = material;
  }
  for (const [name, [stands, change]] of Object.entries(design.compared)) {
    const row = document.querySelector(`[data-compared="${name}"]`);
    row.querySelector("[data-stands]").textContent = stands;
    row.querySelector("[data-change]").textContent = change;
  }
  for (const [name, figure] of Object.entries(design.figures)) {
    const place = document.getElementById(`figure-${name}`);
    place.querySelector('script[type="application/json"]').textContent = figure;
    await redraw(place.querySelector(".plot"));
    for (const numbers of place.querySelectorAll(".tools a")) numbers.search = query;
  }
  document.querySelectorAll(".same code").forEach((code, index) => (code.textContent = design.same[index]));
}

for (const slider of form.querySelectorAll("[type=range]")) {
  slider.hidden = false;
  place(slider);
  slider.addEventListener("input", () => {
    const value = slider.dataset.low * Math.exp((slider.value / 1000) * ratio(slider));
    form.elements[slider.dataset.for].value = String(Number(value.toPrecision(3)));
    answer();
  });
  form.elements[slider.dataset.for].addEventListener("input", () => {
    place(slider);
    answer();
  });
}
