"use strict";
// A running machine: its health every two seconds, and the steps that its model has made since.

const EVERY = 2000; // ms

async function followed(page) {
  let step = -1, silent = 0;
  page.follow = true;
  for (;;) {
    try {
      const answer = await fetch(`now.json?after=${step}`, { credentials: "same-origin", cache: "no-store" });
      if (!answer.ok) throw new Error(String(answer.status));
      const told = await answer.json();
      silent = 0;
      step = taken(page, told, step);
    } catch {
      silent += 1;
      if (silent > 2) trusted({ level: "no", line: "no: the server does not answer, so what is shown is old" });
    }
    await new Promise((next) => setTimeout(next, EVERY));
  }
}

function taken(page, told, step) { // the last step that is known
  trusted(told.trust); flagged(told.flags, 0);
  if (told.health) healthy(told.health);
  by("facts").textContent = told.facts.join(" · ");
  if (told.correction) {
    by("correction-words").textContent = told.correction.words;
    page.corrections.host.hidden = true;
    table(by("correction-table"), told.correction.rows);
  }
  page.content.epoch = told.epoch;
  if (told.afresh) page.store.clear();
  for (const row of told.rows) page.store.add(row);
  if (page.store.length > told.keep) page.store.drop(page.store.length - told.keep);
  if (!told.rows.length) return step;
  by("time").max = page.store.length - 1;
  page.curves();
  page.scales();
  page.go(page.follow ? page.store.length - 1 : page.row);
  return told.rows[told.rows.length - 1].step;
}
