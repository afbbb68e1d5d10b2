// Runs before Viser's page. It spares the browser work for what is not shown here, which without a graphics card takes
// a large part of a second; should Viser change, nothing happens.
(() => {
  const SETTLE_MS = 250; // for so long Viser draws one frame after another whenever something has changed
  const LATER_MS = 260; // what is ready a little later (text, textures) is drawn then

  // Until the server has set up its lamps, Viser loads and unfolds a panorama to light the scene with. It is the first
  // picture that the page asks for by its data; all others are let through.
  const load = window.fetch;
  let waiting = true;
  window.fetch = (what, ...how) => {
    const panorama = waiting && String(what?.url ?? what).startsWith("data:image/jpeg");
    waiting &&= !panorama;
    return panorama ? new Promise(() => {}) : load.call(window, what, ...how);
  };

  // A change is drawn once, and once more when it has settled, not for as long as it might settle.
  const thrifty = (view) => {
    let draw = view.requestRender;
    const clock = performance.now;
    let later = 0;
    const once = () => {
      performance.now = () => clock.call(performance) - SETTLE_MS; // for Viser, the time to settle is then over
      try {
        draw();
      } finally {
        performance.now = clock;
      }
    };
    const request = () => {
      // Messages wait for a frame, which would be drawn before what they change; they can do without one.
      const queued = view.messageQueue?.length > 0 && view.getRenderRequestState === "ready";
      if (queued) window.queueMicrotask(() => view.drainMessageQueue?.());
      once();
      clearTimeout(later);
      later = setTimeout(once, LATER_MS);
    };
    Object.defineProperty(view, "requestRender", {
      configurable: true,
      get: () => request,
      set: (given) => {
        draw = given;
      },
    });
  };

  // The first picture is drawn once the timeline and the panel have their places: in another size it would be drawn in
  // vain, and shaders compiled for what is not complete yet.
  const PATIENCE_MS = 4000;
  const begin = (view, began) => {
    const canvas = document.querySelector(".lios-canvas canvas[data-engine]");
    const sized = canvas && Math.abs(canvas.width - canvas.clientWidth * window.devicePixelRatio) < 2;
    if (sized || performance.now() - began > PATIENCE_MS) {
      view.scene.visible = true;
      view.requestRender();
      requestAnimationFrame(() => setTimeout(() => (window.liosDrawn = true)));
    } else setTimeout(begin, 20, view, began);
  };

  let state;
  Object.defineProperty(window, "__viserMutable", {
    configurable: true,
    get: () => state,
    set: (given) => {
      state = given;
      // Behind the scene it draws a picture over the whole view, also where there is none.
      if (given?.backgroundMaterial) given.backgroundMaterial.visible = false;
      if (typeof given?.requestRender === "function") thrifty(given);
      if (given?.scene) {
        given.scene.visible = false;
        begin(given, performance.now());
      }
    },
  });
})();
