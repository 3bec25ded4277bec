"use strict";
// Shows the rows that contain a text and have a chosen state. The page is complete without this script.
// The fragment #q=battery&s=en fills the fields, so that a search can be linked.
(() => {
  const box = document.getElementById("search");
  if (!box) return;
  const field = document.getElementById("q");
  const found = document.getElementById("found");
  const states = [...box.querySelectorAll("input[type=checkbox]")];
  const rows = [...document.querySelectorAll("tr[data-s]")];
  const texts = rows.map((row) => row.textContent.toLowerCase());
  const pair = /^(?:0x)?([0-9a-f]{2}):(?:0x)?([0-9a-f]{2})$/;
  const spans = /0x([0-9a-f]{2})(?:-0x([0-9a-f]{2}))?:0x([0-9a-f]{2})(?:-0x([0-9a-f]{2}))?/g;

  const covers = (text, did, cid) => {
    for (const [, first, last, low, high] of text.matchAll(spans)) {
      if (first <= did && did <= (last || first) && low <= cid && cid <= (high || low)) return true;
    }
    return false;
  };

  const show = () => {
    const wanted = field.value.trim().toLowerCase();
    const ids = pair.exec(wanted);
    const chosen = new Set(states.filter((state) => state.checked).map((state) => state.value));
    const words = wanted.split(/\s+/);
    let count = 0;
    rows.forEach((row, at) => {
      const fits = ids ? covers(texts[at], ids[1], ids[2]) : words.every((word) => texts[at].includes(word));
      row.hidden = !(fits && (!states.length || chosen.has(row.dataset.s)));
      count += row.hidden ? 0 : 1;
    });
    found.textContent = `${count} of ${rows.length} shown`;
  };

  const clear = () => {
    field.value = "";
    states.forEach((state) => { state.checked = true; });
  };

  const follow = () => {
    const fragment = new URLSearchParams(location.hash.slice(1));
    if (fragment.has("q") || fragment.has("s")) {
      field.value = fragment.get("q") || "";
      const chosen = fragment.get("s");
      states.forEach((state) => { state.checked = !chosen || chosen.includes(state.value); });
      show();
      box.scrollIntoView();
      return;
    }
    const target = document.getElementById(location.hash.slice(1));
    if (target && target.hidden) {
      clear();
      show();
      target.scrollIntoView();
    }
  };

  box.hidden = false;
  box.addEventListener("input", show);
  addEventListener("hashchange", follow);
  show();
  follow();
})();
