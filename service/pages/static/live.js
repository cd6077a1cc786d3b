"use strict";
// What came since the page was opened is shown without a reload: the server is asked for a mark of all that the page
// shows and, where it is another one, for the page, of which the parts that change take the place of those here.

const page = document.querySelector("[data-live]");
const OFTEN = 2000; // ms
const SELDOM = 10_000; // while the server does not answer

async function answered(address, type) {
  const answer = await fetch(address, { headers: { Accept: type } });
  if (!answer.ok || answer.redirected) throw new Error(answer.statusText);
  return answer;
}

// Focus is where it was, if what had it is still there.
function put(part, fresh) {
  const focused = part.contains(document.activeElement) ? document.activeElement.id : "";
  for (const plot of part.querySelectorAll(".plot[data-drawn]")) Plotly.purge(plot);
  part.replaceChildren(...fresh.childNodes);
  part.dispatchEvent(new CustomEvent("renewed", { bubbles: true }));
  if (focused) document.getElementById(focused)?.focus({ preventScroll: true });
}

async function renew() {
  const text = await (await answered(location.href, "text/html")).text();
  const made = new DOMParser().parseFromString(text, "text/html");
  const fresh = made.querySelector("[data-live]");
  if (!fresh) return;
  for (const part of document.querySelectorAll("[data-live-part]")) {
    const other = made.getElementById(part.id);
    if (other) put(part, other);
  }
  page.dataset.mark = fresh.dataset.mark;
  page.textContent = `Renewed at ${new Date().toLocaleTimeString()}.`;
}

async function look() {
  let wait = OFTEN;
  try {
    const { mark } = await (await answered(page.dataset.live, "application/json")).json();
    if (mark !== page.dataset.mark) await renew();
  } catch {
    wait = SELDOM;
  }
  setTimeout(look_when_seen, wait);
}

// A page that nobody sees asks nothing until it is seen again.
function look_when_seen() {
  if (!document.hidden) return void look();
  document.addEventListener("visibilitychange", look_when_seen, { once: true });
}
setTimeout(look_when_seen, OFTEN);
