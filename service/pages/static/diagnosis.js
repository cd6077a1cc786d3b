"use strict";
// How far a diagnosis or a plan is, until it has ended; then the page that shows its result.

const place = document.querySelector("[data-progress]");
const far = document.getElementById("far");
const SOON = 10_000; // ms of the page's life in which most diagnoses end
const bar = place.querySelector("progress");

async function look() {
  let job;
  try {
    const answer = await fetch(place.dataset.progress, { headers: { Accept: "application/json" } });
    if (!answer.ok) throw new Error(answer.statusText);
    job = await answer.json();
  } catch {
    far.textContent = "The server does not answer; this page goes on asking.";
    return void setTimeout(look, 5000);
  }
  if (job.state !== "queued" && job.state !== "running") return void location.reload();
  bar.value = job.progress;
  const said = job.state === "queued" ? "It waits for its turn." : `It runs: ${Math.round(100 * job.progress)} % done.`;
  if (far.textContent !== said) far.textContent = said;
  setTimeout(look, performance.now() < SOON ? 150 : 1000);
}
setTimeout(look, 150);
