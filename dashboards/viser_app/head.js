// Runs before Viser's page. It spares the browser work for what is not shown here, which without a graphics card takes
// a large part of a second; should Viser change, nothing happens.
(() => {
  // Until the server has set up its lamps, Viser loads and unfolds a panorama to light the scene with.
  const load = window.fetch;
  window.fetch = (what, ...how) => {
    const url = String(what?.url ?? what);
    const panorama = url.startsWith("data:image/jpeg") && url.length > 50000;
    return panorama ? new Promise(() => {}) : load.call(window, what, ...how);
  };
  // Behind the scene it draws a picture over the whole view, also where there is none.
  let state;
  Object.defineProperty(window, "__viserMutable", {
    configurable: true,
    get: () => state,
    set: (given) => {
      state = given;
      if (given?.backgroundMaterial) given.backgroundMaterial.visible = false;
    },
  });
})();
