// "?" lists the keys of the page that shows panels; Escape, another "?" or a click closes the list.
(() => {
  if (window.liosHelp) return;
  const common = [
    ["space", "play or pause"], ["J, L", "previous, next decision"], ["shift J, shift L", "previous, next action"],
    ["U, O", "a second back, on"], ["Home, End", "start, end"], ["F", "fit the house"], ["T", "from above"],
  ];
  const mouse = [["drag, wheel", "turn, zoom"], ["right drag", "move"], ["?", "this list"]];
  window.liosHelp = (more = window.liosMoreKeys || []) => {
    const open = document.getElementById("lios-help");
    if (open) { open.remove(); return; }
    const box = document.createElement("div"), table = document.createElement("table");
    Object.assign(box, { id: "lios-help", className: "lp", onclick: () => box.remove() });
    box.setAttribute("role", "dialog");
    box.setAttribute("aria-label", "Keys");
    for (const words of [...common, ...more, ...mouse]) {
      const row = table.insertRow();
      words.forEach((word) => { row.insertCell().textContent = word; });
    }
    box.append(table);
    document.body.append(box);
  };
  document.addEventListener("keydown", (event) => {
    if (/^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName) && event.target.type !== "range") return;
    if (event.key === "?") window.liosHelp();
    if (event.key === "Escape") document.getElementById("lios-help")?.remove();
  });
})();
