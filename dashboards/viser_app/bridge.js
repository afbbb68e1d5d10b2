// Between a Viser page and its session: clicks in panels become words in the "Go to" field, which the server reads;
// and the page's address carries the view, so that a link or a reload restores it.
(() => {
  const field = () => {
    const label = [...document.querySelectorAll("label")].find((l) => l.textContent === "Go to");
    return label?.parentElement?.parentElement?.parentElement?.querySelector("input");
  };
  const write = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set;
  window.liosCommand = (words) => {
    const input = field();
    if (!input) return;
    const marked = "> " + words; // people's own words are read once they stop typing, these at once
    write.call(input, input.value === marked ? marked + " " : marked);
    input.dispatchEvent(new Event("input", { bubbles: true }));
  };
  window.liosTab = (label) => {
    const tab = [...document.querySelectorAll('[role="tab"]')].find((t) => t.textContent.trim() === label);
    if (!tab || tab.getAttribute("aria-selected") === "true") return;
    // Viser's tabs can be dragged: they listen to the pointer, not to clicks.
    const box = tab.getBoundingClientRect();
    const at = { clientX: box.left + box.width / 2, clientY: box.top + box.height / 2 };
    for (const kind of ["pointerdown", "pointerup"])
      tab.dispatchEvent(new PointerEvent(kind, { ...at, bubbles: true, button: 0, pointerId: 1, isPrimary: true }));
    tab.click();
  };
  // The tab in front is the page's own affair: the server does not hear of it. The address names it unless it is the
  // first one.
  const tabs = () => {
    const known = [...document.querySelectorAll('[role="tab"]')].find((t) => t.textContent.trim() === "Belief");
    return known ? [...known.closest('[role="tablist"]').querySelectorAll('[role="tab"]')] : [];
  };
  const front = () => tabs().findIndex((t) => t.getAttribute("aria-selected") === "true");
  let query = null;
  window.liosAddress = (said) => {
    query = said;
    const at = front();
    const tab = at > 0 ? "&tab=" + encodeURIComponent(tabs()[at].textContent.trim()) : "";
    history.replaceState(null, "", said + tab);
  };
  new MutationObserver(() => query === null || window.liosAddress(query)).observe(document.body, {
    subtree: true,
    attributeFilter: ["aria-selected"],
  });
  const asked = window.location.search;
  const system = matchMedia("(prefers-color-scheme: dark)");
  const scheme = () => "scheme=" + (system.matches ? "dark" : "light");
  system.addEventListener("change", () => window.liosCommand("address ?" + scheme()));
  const wanted = new URLSearchParams(asked).get("tab");
  // What takes long to load is loaded after the first picture.
  const drawn = () => (window.liosDrawn ? window.liosCommand("drawn") : setTimeout(drawn, 100));
  let tries = 0;
  const arrive = () => {
    if (field() && front() >= 0) {
      if (tabs().some((t) => t.textContent.trim() === wanted)) window.liosTab(wanted);
      window.liosCommand(`address ${asked || "?"}&${scheme()}`);
      setTimeout(drawn, 300); // not before the server has read the address from the same field
    } else if (tries++ < 600) setTimeout(arrive, 100);
  };
  arrive();
})();
