"use strict";
// Content that is within the page, of a frozen one, or that the server has.

async function start() {
  const inlined = document.getElementById("content");
  let content;
  if (inlined) content = JSON.parse(inlined.textContent);
  else {
    const answer = await fetch("content.json", { credentials: "same-origin" });
    if (!answer.ok) throw new Error(`the server says ${answer.status}`);
    content = await answer.json();
  }
  performance.mark('parsed');
  const page = new Page(content);
  performance.mark('made');
  window.page = page;
  requestAnimationFrame(() => requestAnimationFrame(() => { document.body.dataset.ready = "yes"; performance.mark("drawn"); }));
  if (page.live) followed(page);
}

start().catch((problem) => {
  by("trust").className = "no";
  by("trust").textContent = `The page cannot be drawn: ${problem.message}.`;
  throw problem;
});
