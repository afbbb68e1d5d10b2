// What panels do by themselves in any page that shows them: tables sort by a click on a heading, and everything
// with data-lios hands its words to window.liosCommand. Content is replaced often; chosen orders are kept.
(() => {
  if (window.liosPanels) return;
  window.liosPanels = true;
  const orders = {};
  const value = (cell) => {
    const words = (cell.textContent || "").trim();
    const bar = cell.querySelector(".bar div");
    if (bar) return parseFloat(bar.style.width) || 0;
    const number = parseFloat(words.replace(/\s/g, ""));
    return Number.isNaN(number) ? words.toLowerCase() : number;
  };
  const compare = (a, b) => {
    if (typeof a === typeof b) return a < b ? -1 : a > b ? 1 : 0;
    return typeof a === "number" ? -1 : 1;
  };
  const sort = (table) => {
    const order = orders[table.dataset.table];
    if (!order) return;
    const body = table.tBodies[0];
    const rows = [...body.rows];
    const sorted = rows
      .map((row, i) => [value(row.cells[order.column]), i, row])
      .sort((a, b) => order.direction * compare(a[0], b[0]) || a[1] - b[1])
      .map((entry) => entry[2]);
    if (sorted.some((row, i) => row !== rows[i])) sorted.forEach((row) => body.appendChild(row));
    [...table.tHead.rows[0].cells].forEach((cell, i) =>
      cell.setAttribute("aria-sort", i !== order.column ? "none" : order.direction > 0 ? "ascending" : "descending"));
  };
  const act = (target, event) => {
    const words = target.dataset.lios;
    if (words.startsWith("sort ")) {
      const table = target.closest("table");
      const key = table.dataset.table, column = target.cellIndex;
      const before = orders[key];
      orders[key] = { column, direction: before && before.column === column ? -before.direction : 1 };
      sort(table);
    } else if (words === "strip") {
      const box = target.getBoundingClientRect();
      const share = Math.min(1, Math.max(0, (event.clientX - box.left) / box.width));
      window.liosCommand?.("seek " + (share * parseFloat(target.dataset.strip)).toFixed(6));
    } else {
      window.liosCommand?.(words);
    }
  };
  document.addEventListener("click", (event) => {
    const target = event.target.closest?.("[data-lios]");
    if (target) act(target, event);
  });
  document.addEventListener("keydown", (event) => {
    const target = event.target.closest?.("[data-lios]");
    if (target && event.key === "Enter" && target.dataset.lios !== "strip") act(target, event);
  });
  new MutationObserver((changes) => {
    for (const change of changes)
      for (const node of change.addedNodes)
        if (node.querySelectorAll) node.querySelectorAll("table[data-table]").forEach(sort);
  }).observe(document.documentElement, { childList: true, subtree: true });
})();
