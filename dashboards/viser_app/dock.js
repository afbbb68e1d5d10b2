// The timeline stays below the house and beside the panel, and the house has all that is left: Viser docks panels to the
// sides only, so that the picture is told here how high the timeline is.
(() => {
  const root = document.documentElement.style;
  const watch = new ResizeObserver(() => place());
  let canvas = null;
  let timeline = null;
  function place() {
    if (!canvas?.isConnected || !timeline?.isConnected) return;
    const all = canvas.parentElement.getBoundingClientRect();
    const free = canvas.getBoundingClientRect();
    root.setProperty("--lios-left", `${free.left - all.left}px`);
    root.setProperty("--lios-right", `${all.right - free.right}px`);
    root.setProperty("--lios-dock", `${timeline.getBoundingClientRect().height}px`);
  }
  const scale = document.querySelector(".lios-scale") || document.createElement("div"); // this may run again
  scale.className = "lios-scale";
  scale.title = "True to scale in the middle of the picture";
  window.liosScale = (px, words) => {
    scale.style.width = `${px}px`;
    scale.textContent = words;
    if (canvas && scale.parentElement !== canvas) canvas.append(scale);
  };
  function find() {
    if (!canvas?.isConnected || !timeline?.isConnected) {
      const picture = [...document.querySelectorAll("canvas")].find((c) => c.clientWidth > 300);
      canvas = picture?.parentElement ?? null;
      timeline = document.querySelector(".lios-timeline")?.closest(".mantine-Paper-root") ?? null;
      if (canvas && timeline) {
        canvas.classList.add("lios-canvas");
        if (scale.textContent) canvas.append(scale);
        watch.disconnect();
        [canvas, timeline].forEach((part) => watch.observe(part));
        place();
      }
    }
    setTimeout(find, canvas && timeline ? 500 : 30); // soon: another size of the first picture would be drawn anew
  }
  find();
})();
