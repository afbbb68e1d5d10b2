// Plays the runs that the page carries: a clock, the 3D view, and panels that were written when the page was made.
(async () => {
  const $ = (id) => document.getElementById(id);
  const bytes = Uint8Array.from(atob($("data").textContent.trim()), (c) => c.charCodeAt(0));
  const data = await new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).json();
  const runs = data.runs, focus = runs[0];
  for (const run of runs) run.imputedSet = new Set(run.imputed);
  const state = { at: 0, playing: false, speed: 1, loop: false, clock: "time", follow: false, walls: "cut", item: 0, tab: data.tabs[0][0] };

  const asked = new URLSearchParams(location.hash.slice(1));
  const theme = liosTheme($("theme"), ["light", "dark"].includes(asked.get("theme")) ? asked.get("theme") : "", () => remember());
  const upper = liosUpper, interpolate = liosInterpolate;
  const { secondOf, readingOf, endOf } = liosClock(runs, state);

  // --- the stage ------------------------------------------------------------------------------------------------
  const canvas = $("view");
  let dirty = true;
  const camera = liosCamera(canvas, () => { dirty = true; });
  let renderer = null;
  try { renderer = liosRenderer(canvas); } catch (error) { console.warn(error); }
  if (!renderer) { $("sorry").hidden = false; canvas.hidden = true; }
  const opaque = (rgb, alpha = 255) => { const out = new Uint8Array(rgb.length / 3 * 4); for (let i = 0; i < rgb.length / 3; i++) { out.set(rgb.slice(3 * i, 3 * i + 3), 4 * i); out[4 * i + 3] = alpha; } return out; };
  const drawn = [], walls = { cut: [], whole: [] };
  const shapes = {}, actors = [], furniture = [];
  let bars = null, balls = null, sight = null, marks = {};
  const empty = { centre: [], size: [], yaw: [], colour: [] };
  const add = (shape, parts, blend = false) => { const made = renderer.batch(shape, parts); made.blend = blend; drawn.push(made); return made; };
  if (renderer) {
    for (const [name, mesh] of Object.entries(data.meshes)) shapes[name] = name === "cylinder" || name === "ball" ? renderer.smooth(mesh) : renderer.mesh(mesh);
    for (const floor of data.house.floors) add(renderer.mesh(floor), { centre: [0, 0, 0], size: [1, 1, 1], yaw: [0], colour: opaque(floor.colour) });
    for (const one of data.house.furniture) furniture.push([one, add(shapes[one.shape], { ...one, colour: opaque(one.colour) })]);
    for (const key of ["cut", "whole"]) walls[key] = data.house[key].map((one) => add(shapes[one.shape], { ...one, colour: opaque(one.colour) }));
    for (const one of data.house.shadows) add(shapes[one.shape], { ...one, colour: opaque(one.colour, 18) }, true);
    bars = add(shapes.cylinder, empty);
    marks = { cross: add(shapes.cross, empty), tick: add(shapes.tick, empty), question: add(shapes.question, empty), unknown: add(shapes.unknown, empty) };
    balls = add(shapes.ball, empty);
    for (const goal of data.house.goals) add(renderer.mesh(goal), { centre: [0, 0, 0], size: [1, 1, 1], yaw: [0], colour: opaque(goal.colour) });
    sight = liosSight(renderer, focus, shapes, data.colours, add);
    runs.forEach((run, i) => {
      const c = run.colour, alpha = i ? 110 : 255;
      actors.push({
        body: add(shapes.robotBody, { centre: [0, 0, 0], size: [1, 1, 1], yaw: [0], colour: [...c, alpha] }, i > 0),
        legs: add(shapes.robotLegs, { centre: [0, 0, 0], size: [1, 1, 1], yaw: [0], colour: [52, 54, 60, alpha] }, i > 0),
        trail: add(shapes.box, empty), ahead: add(shapes.box, empty), z: 0.02 + 0.012 * Math.max(1, 6 - i), wide: i ? 0.04 : 0.06,
      });
    });
  }
  const labels = [];
  const label = (text, kind, at) => { const div = document.createElement("div"); div.className = kind; div.textContent = text; $("labels").append(div); const made = { div, at, visible: true, kind }; labels.push(made); return made; };
  data.house.rooms.forEach((room) => { label(room.name, "room", [...room.spots[0], 0.05]).spots = room.spots; });
  const orderLabels = Array.from({ length: data.labelled }, () => label("", "order", [0, 0, 0]));
  const itemLabels = [], leftLabels = [];
  const robotLabels = runs.map((run) => { const made = label(run.name, "robot", [0, 0, 0]); made.div.style.borderLeftColor = `rgb(${run.colour})`; return made; });

  // --- showing one moment ---------------------------------------------------------------------------------------
  let shownFrame = -1;
  const number = (v) => Math.abs(v) >= 1e6 ? v.toExponential(2).replace("e+", "e") : v.toFixed(1);
  const html = (id, content) => { const node = $(id); if (node && node.liosHtml !== content) { node.innerHTML = content; node.liosHtml = content; } };
  const robotAt = (run, s) => {
    const i = Math.max(0, upper(run.wayS, s) - 1);
    return { x: interpolate(s, run.wayS, run.wayX), y: interpolate(s, run.wayS, run.wayY), yaw: run.facing[i], i };
  };
  const mark = (name, containers, colour) => {
    const made = { centre: [], size: [], yaw: [], colour: [] };
    for (const o of containers) { const [x, y, z] = data.house.tops[o]; made.centre.push(x, y, z + 0.05); made.size.push(1, 1, 1); made.yaw.push(0); made.colour.push(...colour, 255); }
    marks[name].set(made);
  };
  // Where replays had to end by now, and what no run opened.
  let shownStops = null;
  const showStops = (seconds) => {
    const stops = runs.flatMap((run, i) => run.stop && seconds[i] >= run.stop[0] - 1e-9 ? [run.stop[1]] : []);
    if (!renderer || String(stops) === shownStops) return;
    shownStops = String(stops);
    mark("question", [...new Set(stops)], data.colours.unseen);
    mark("unknown", data.unopened.filter((o) => !stops.includes(o)), data.colours.unopened);
  };
  const live = {
    cost: (run, s) => number(interpolate(s, run.costS, run.cost)),
    metres: (run, s) => number(interpolate(s, run.wayS, run.wayM)),
    walked: (run, s) => live.metres(run, s) + " m",
    looks: (run, s) => String(upper(run.searchS, s + 1e-9)),
  };
  const showFrame = (k) => {
    const frame = focus.frames[k], [palette, heights, marked, beliefs, legend, itemNames, left, barPalette] = frame.looks[state.item];
    if (renderer) {
      const of = focus.palettes[palette], ofBar = focus.palettes[barPalette], height = focus.heights[heights];
      for (const [one, made] of furniture) {
        const colours = opaque(one.colour);
        one.owner.forEach((o, i) => { if (o >= 0) colours.set(of.slice(3 * o, 3 * o + 3), 4 * i); });
        made.set({ colour: colours });
      }
      const bar = { centre: [], size: [], yaw: [], colour: [] };
      height.forEach((h, o) => {
        if (h < 0.01) return;
        const [x, y, z] = data.house.tops[o];
        bar.centre.push(x, y, z + h / 2); bar.size.push(0.13, 0.13, h); bar.yaw.push(0); bar.colour.push(...ofBar.slice(3 * o, 3 * o + 3), 255);
      });
      bars.set(bar);
      for (const [name, colour] of [["cross", [84, 92, 104]], ["tick", [255, 255, 255]]]) mark(name, focus.marks[marked][name], colour);
      const ball = { centre: [], size: [], yaw: [], colour: [] };
      for (const [x, y, z, wide, wanted] of focus.balls[frame.items]) { ball.centre.push(x, y, z); ball.size.push(wide, wide, wide); ball.yaw.push(0); ball.colour.push(...data.colours[wanted ? "goal" : "item"], 255); }
      balls.set(ball);
      focus.itemNames[itemNames].forEach(([words, ...at], i) => { itemLabels[i] ??= label("", "item", at); Object.assign(itemLabels[i], { at, visible: true }).div.textContent = words; });
      itemLabels.slice(focus.itemNames[itemNames].length).forEach((made) => { made.visible = false; });
      const ordered = focus.orders[frame.order].slice(0, orderLabels.length), leftOf = new Map(focus.left[left]);
      const leftAlone = focus.left[left].filter(([o]) => !ordered.includes(o));
      leftAlone.forEach(([o, words], i) => { leftLabels[i] ??= label("", "item", [0, 0, 0]); Object.assign(leftLabels[i], { at: data.house.tops[o], visible: true }).div.textContent = words; });
      leftLabels.slice(leftAlone.length).forEach((made) => { made.visible = false; });
      orderLabels.forEach((made, n) => {
        const stop = focus.orders[frame.order][n];
        made.visible = stop !== undefined;
        if (!made.visible) return;
        const [x, y, z] = data.house.tops[stop];
        made.at = [x, y, z + 0.15 + height[stop]];
        made.div.textContent = "";
        const b = document.createElement("b"); b.textContent = n + 1;
        made.div.append(b, data.house.names[stop] + (leftOf.has(stop) ? `, ${leftOf.get(stop)}` : ""));
      });
    }
    for (const key of Object.keys(frame.html)) html("p-" + key, data.texts[frame.html[key]]);
    html("p-beliefs", data.texts[beliefs]);
    html("p-legend", data.texts[legend]);
  };
  const show = () => {
    const seconds = runs.map((run) => secondOf(run, state.at));
    const k = Math.max(0, upper(focus.frameS, seconds[0] + 1e-9) - 1);
    if (k !== shownFrame) { showFrame(k); shownFrame = k; }
    showStops(seconds);
    document.querySelectorAll("[data-live]").forEach((node) => { const i = node.dataset.run || 0; node.textContent = live[node.dataset.live](runs[i], seconds[i]); });
    runs.forEach((run, i) => {
      const s = seconds[i], robot = robotAt(run, s), frame = run.frames[Math.max(0, upper(run.frameS, s + 1e-9) - 1)];
      const walked = interpolate(s, run.wayS, run.wayM);
      robotLabels[i].at = [robot.x, robot.y, 0.95 + 0.35 * i];
      if (i === 0) {
        camera.raised = (state.follow && window.lios?.fitting?.covered) || 0;
        if (state.follow) { camera.target = [robot.x, robot.y, 0.3]; camera.turn = robot.yaw + Math.PI; camera.tilt = 0.72; camera.distance = 6.5 / (1 - camera.raised); }
      }
      if (!renderer) return;
      if (i === 0) state.sight = sight.show(robot.x, robot.y, s);
      const actor = actors[i];
      for (const part of [actor.body, actor.legs]) part.set({ centre: [robot.x, robot.y, 0], yaw: [robot.yaw] });
      const trail = { centre: [], size: [], yaw: [], colour: [] };
      let stretch = [[run.wayX[0], run.wayY[0]]], assumed = false;
      const close = () => { const made = liosRibbon(stretch, actor.z, actor.wide, run.colour, assumed ? [0.16, 0.14] : null); for (const key in trail) trail[key].push(...made[key]); };
      for (let j = 1; j <= robot.i + 1; j++) {
        const point = j <= robot.i ? [run.wayX[j], run.wayY[j]] : [robot.x, robot.y], kind = run.imputedSet.has(Math.min(j, run.wayX.length - 1));
        if (kind !== assumed) { close(); stretch = [stretch[stretch.length - 1]]; assumed = kind; }
        stretch.push(point);
      }
      close();
      actor.trail.set(trail);
      const ahead = run.ways[frame.ahead], rest = [[robot.x, robot.y]];
      let left = walked - frame.walked;
      for (let j = 1; j < ahead.length; j++) {
        const leg = Math.hypot(ahead[j][0] - ahead[j - 1][0], ahead[j][1] - ahead[j - 1][1]);
        if (left >= leg - 1e-6) { left -= leg; continue; }
        rest.push(ahead[j]); left = 0;
      }
      actor.ahead.set(liosRibbon(rest, actor.z + 0.004, actor.wide * 0.7, run.colour, [0.22, 0.16]));
    });
    for (const key of ["cut", "whole"]) walls[key].forEach((made) => { made.visible = state.walls === key; });
    $("slider").max = endOf(); $("slider").value = state.at;
    $("reading").textContent = state.clock === "decision" ? `decision ${Math.floor(state.at)}` : `${state.at.toFixed(1)} ${state.clock === "time" ? "s" : "m"}`;
    $("play").textContent = state.playing ? "Pause" : "Play";
    document.querySelectorAll(".strip .cursor").forEach((node) => { node.style.left = 100 * state.at / endOf() + "%"; });
    html("p-strip", data.strips[state.clock]);
    draw();
  };
  const draw = () => {
    if (!renderer) return;
    const m = camera.matrix();
    renderer.draw(m, drawn);
    const shown = [...robotLabels, ...orderLabels, ...leftLabels, ...itemLabels, ...labels.filter((l) => l.kind === "room")];
    liosPlaceLabels(canvas, m, shown, state.roomNames !== false);
    liosScaleBar($("scale"), 2 * camera.distance * Math.tan(camera.fov / 2) / Math.max(1, canvas.clientHeight));
  };

  // --- controls -------------------------------------------------------------------------------------------------
  const change = (changes) => { Object.assign(state, changes); state.at = Math.min(Math.max(0, state.at), endOf()); dirty = true; remember(); };
  let remembering = 0;
  const remember = () => {
    clearTimeout(remembering);
    remembering = setTimeout(() => {
      const view = [...camera.target, camera.distance, camera.turn, camera.tilt].map((v) => v.toFixed(3)).join(",");
      try { history.replaceState(null, "", `#at=${+state.at.toFixed(6)}&clock=${state.clock}&tab=${state.tab}&walls=${state.walls}${theme.chosen ? "&theme=" + theme.chosen : ""}${state.item ? "&item=" + state.item : ""}${camera.moved ? "&camera=" + view : ""}`); } catch { /* not allowed here */ }
    }, 300);
  };
  const step = (stops, direction) => {
    const near = 1e-6 * Math.max(1, endOf());
    const open = [...stops, 0, endOf()].filter((s) => direction > 0 ? s > state.at + near : s < state.at - near);
    if (open.length) change({ at: direction > 0 ? Math.min(...open) : Math.max(...open), playing: false });
  };
  const decisions = () => focus.decisions.map((s, i) => state.clock === "decision" ? i + 1 : readingOf(focus, s));
  const actions = () => focus.actions.map((s) => readingOf(focus, s));
  const toggle = () => change({ playing: !state.playing, at: !state.playing && state.at >= endOf() * (1 - 1e-9) ? 0 : state.at });
  const points = [...data.house.corners.flatMap(([x, y]) => [[x, y, 0], [x, y, 1.2]]), ...data.house.tops.map(([x, y, z]) => [x, y, z + 1.35])];
  const look = (how) => { if (how === "follow") change({ follow: !state.follow }); else { change({ follow: false }); camera.fit(points, { above: how === "above" }); camera.moved = false; } };
  const nextWalls = () => change({ walls: { cut: "whole", whole: "none", none: "cut" }[state.walls] });
  $("play").onclick = toggle;
  $("first").onclick = () => change({ at: decisions()[0] || 0, playing: false });
  $("back").onclick = () => step(decisions(), -1);
  $("next").onclick = () => step(decisions(), 1);
  $("last").onclick = () => change({ at: endOf(), playing: false });
  $("speed").onchange = (e) => change({ speed: parseFloat(e.target.value) });
  $("loop").onchange = (e) => change({ loop: e.target.checked });
  $("clock").onchange = (e) => { state.clock = e.target.value; change({ at: 0 }); };
  $("clock").hidden = runs.length < 2;
  $("slider").oninput = (e) => change({ at: parseFloat(e.target.value), playing: false });
  document.querySelectorAll("[data-camera]").forEach((b) => { b.onclick = () => look(b.dataset.camera); });
  document.querySelector("[data-walls]").onclick = nextWalls;
  const keys = { " ": toggle, l: () => step(decisions(), 1), j: () => step(decisions(), -1), L: () => step(actions(), 1), J: () => step(actions(), -1), o: () => change({ at: state.at + 1 }), u: () => change({ at: state.at - 1 }), Home: () => change({ at: 0 }), End: () => change({ at: endOf() }), f: () => look("fit"), t: () => look("above"), r: () => look("follow"), w: nextWalls, d: () => theme.toggle() };
  window.liosMoreKeys = [["R", "follow the robot"], ["W", "walls"], ["D", "light or dark"]];
  $("keys").onclick = () => window.liosHelp();
  document.addEventListener("keydown", (e) => {
    if (e.ctrlKey || e.metaKey || e.altKey || /^(SELECT|TEXTAREA)$/.test(e.target.tagName) || (e.target.tagName === "BUTTON" && e.key === " ")) return;
    if (keys[e.key]) { e.preventDefault(); keys[e.key](); }
  });
  window.liosCommand = (words) => {
    const [verb, rest] = words.split(" ");
    if (verb === "seek") change({ at: parseFloat(rest) || 0, playing: false });
    if (verb === "look" && data.house.tops[rest]) { const [x, y] = data.house.tops[rest]; Object.assign(camera, { target: [x, y, 0.4], distance: 6, moved: true }); state.follow = false; dirty = true; }
  };
  for (const [key, title] of data.tabs) {
    const button = document.createElement("button"), pane = document.createElement("div");
    Object.assign(button, { textContent: title, onclick: () => choose(key) });
    button.setAttribute("role", "tab");
    button.dataset.tab = key;
    pane.id = "p-" + key;
    $("tabs").append(button);
    $("panes").append(pane);
  }
  const choose = (key) => {
    state.tab = key;
    document.querySelectorAll("#tabs button").forEach((b) => b.setAttribute("aria-selected", b.dataset.tab === key));
    data.tabs.forEach(([other]) => { $("p-" + other).hidden = other !== key; });
    remember();
  };
  html("p-title", data.title);
  if (data.still.comparison) html("p-comparison", data.still.comparison);
  const chooseItem = (index) => {
    state.item = index >= 0 && index <= focus.items.length ? index : 0;
    $("item").value = state.item;
    html("p-plots", data.still.plots[state.item]);
    shownFrame = -1;
    change({});
  };
  focus.items.forEach((name, i) => { const option = document.createElement("option"); option.value = i + 1; option.textContent = "item: " + name; $("item").append(option); });
  $("item").onchange = (e) => chooseItem(parseInt(e.target.value, 10));

  // --- what the address asks for, then the first picture ----------------------------------------------------------
  if (["time", "distance", "decision"].includes(asked.get("clock"))) { state.clock = asked.get("clock"); $("clock").value = state.clock; }
  if (["cut", "whole", "none"].includes(asked.get("walls"))) state.walls = asked.get("walls");
  choose(data.tabs.some(([key]) => key === asked.get("tab")) ? asked.get("tab") : data.tabs[0][0]);
  state.at = Math.min(endOf(), Math.max(0, parseFloat(asked.get("at")) || 0));
  chooseItem(parseInt(asked.get("item"), 10) || 0);
  const placed = () => {
    const view = (asked.get("camera") || "").split(",").map(Number);
    if (view.length === 6 && view.every(Number.isFinite)) { camera.target = view.slice(0, 3); [camera.distance, camera.turn, camera.tilt] = view.slice(3); camera.moved = true; dirty = true; } else camera.fit(points);
  };
  placed();
  new ResizeObserver(() => { if (!camera.moved && !state.follow) camera.fit(points, window.lios?.fitting); dirty = true; }).observe(canvas);
  let last = performance.now();
  const tick = (now) => {
    if (state.playing) {
      const pace = state.clock === "time" ? 1 : endOf() / Math.max(1e-9, focus.duration);
      state.at += (now - last) / 1000 * state.speed * pace;
      if (state.at >= endOf()) { if (state.loop) state.at = 0; else { state.at = endOf(); state.playing = false; } }
      dirty = true;
    }
    last = now;
    if (dirty) { dirty = false; show(); }
    requestAnimationFrame(tick);
  };
  show();
  requestAnimationFrame(tick);

  // --- for pictures and tests -------------------------------------------------------------------------------------
  const captionLines = () => {
    const seconds = runs.map((run) => secondOf(run, state.at));
    const told = [...($("p-now").querySelector("p")?.childNodes || [])];
    const doing = told.map((node) => node.textContent.trim()).filter(Boolean).join(": ");
    const costOf = (run, i) => number(interpolate(seconds[i], run.costS, run.cost));
    return [
      [data.plainTitle, 600],
      [`${seconds[0].toFixed(1)} s   ${doing}`, 400],
      ...runs.map((run, i) => [`${run.name}: cost ${costOf(run, i)}`, 600, `rgb(${run.colour})`]),
    ];
  };
  const paint = (context, w, h, caption) =>
    liosPaint(context, w, h, { canvas, stage: $("stage"), labels, caption: caption ? captionLines() : null });
  let captioned = null;
  window.lios = {
    paint,
    state, end: endOf, start: 0,
    seek: (at) => { change({ at, playing: false }); dirty = false; show(); },
    bare: ({ caption = true, above = false, rooms = true, coveredPx = 0 } = {}) => {
      document.body.classList.add("bare");
      theme.set("light"); // pictures and films look the same on every system
      state.roomNames = rooms;
      $("caption").hidden = !caption;
      if (caption && !$("caption").firstChild) { const box = document.createElement("div"); box.append($("p-now"), $("p-legend")); $("caption").append(box); }
      const refit = () => {
        const px = caption ? $("caption").getBoundingClientRect().height + 16 : coveredPx;
        window.lios.fitting = { above, covered: Math.min(0.45, px / Math.max(1, canvas.clientHeight)) };
        if (!camera.moved && !state.follow) camera.fit(points, window.lios.fitting);
        dirty = true;
      };
      show();
      refit();
      captioned?.disconnect();
      captioned = new ResizeObserver(refit);
      captioned.observe($("caption"));
    },
    camera: (view) => { Object.assign(camera, view, { moved: true }); show(); },
    follow: (on) => { state.follow = on; show(); },
    walls: (mode) => { state.walls = mode; show(); },
  };
})();
