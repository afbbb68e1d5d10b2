// Draws batches of boxes, cylinders and balls with WebGL 2: instanced, lit by sky and sun, sized to the screen.
function liosRenderer(canvas) {
  const gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
  if (!gl) return null;
  const vertex = `#version 300 es
    layout(location=0) in vec3 aPos; layout(location=1) in vec3 aNormal;
    layout(location=2) in vec3 iCentre; layout(location=3) in vec3 iSize; layout(location=4) in float iYaw;
    layout(location=5) in vec4 iColour;
    uniform mat4 uView; out vec3 vNormal; out vec4 vColour; out float vHeight;
    void main() {
      float c = cos(iYaw), s = sin(iYaw); vec3 p = aPos * iSize;
      vec3 q = vec3(c * p.x - s * p.y, s * p.x + c * p.y, p.z) + iCentre;
      vec3 n = aNormal / max(iSize, vec3(1e-4));
      vNormal = vec3(c * n.x - s * n.y, s * n.x + c * n.y, n.z); vColour = iColour; vHeight = q.z;
      gl_Position = uView * vec4(q, 1.0);
    }`;
  const fragment = `#version 300 es
    precision highp float; in vec3 vNormal; in vec4 vColour; in float vHeight; out vec4 colour;
    void main() {
      vec3 n = normalize(vNormal); if (!gl_FrontFacing) n = -n;
      float sky = 0.5 + 0.5 * n.z; float sun = max(0.0, dot(n, normalize(vec3(-0.42, -0.6, 0.85))));
      float low = mix(0.86, 1.0, clamp(vHeight / 0.5, 0.0, 1.0));
      vec3 light = mix(vec3(0.46, 0.44, 0.42), vec3(0.62, 0.63, 0.65), sky) * low + vec3(0.50, 0.48, 0.44) * sun;
      vec3 lit = pow(vColour.rgb, vec3(2.2)) * light;
      colour = vec4(pow(lit, vec3(1.0 / 2.2)), vColour.a);
    }`;
  const program = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  const uView = gl.getUniformLocation(program, "uView");
  const buffer = (data, kind = gl.ARRAY_BUFFER, use = gl.STATIC_DRAW) => {
    const made = gl.createBuffer();
    gl.bindBuffer(kind, made);
    gl.bufferData(kind, data, use);
    return made;
  };
  const normals = (v, f) => {
    const n = new Float32Array(v.length);
    for (let i = 0; i < f.length; i += 3) {
      const [a, b, c] = [f[i] * 3, f[i + 1] * 3, f[i + 2] * 3];
      const u = [v[b] - v[a], v[b + 1] - v[a + 1], v[b + 2] - v[a + 2]];
      const w = [v[c] - v[a], v[c + 1] - v[a + 1], v[c + 2] - v[a + 2]];
      const x = [u[1] * w[2] - u[2] * w[1], u[2] * w[0] - u[0] * w[2], u[0] * w[1] - u[1] * w[0]];
      for (const k of [a, b, c]) for (let j = 0; j < 3; j++) n[k + j] += x[j];
    }
    return n;
  };
  const mesh = ({ vertices, faces }) => {
    // Every face gets corners of its own, so that edges stay sharp; round shapes bring many faces.
    const v = [], f = [];
    faces.forEach((k, i) => { v.push(vertices[3 * k], vertices[3 * k + 1], vertices[3 * k + 2]); f.push(i); });
    const flat = new Float32Array(v);
    return { position: buffer(flat), normal: buffer(normals(flat, f)), count: f.length };
  };
  const smooth = ({ vertices, faces }) => {
    const v = [], n = [], all = normals(new Float32Array(vertices), faces);
    faces.forEach((k) => { for (let j = 0; j < 3; j++) { v.push(vertices[3 * k + j]); n.push(all[3 * k + j]); } });
    return { position: buffer(new Float32Array(v)), normal: buffer(new Float32Array(n)), count: faces.length };
  };
  const fan = (rays) => {
    // A flat fan about a point, whose corners may be moved.
    const flat = new Float32Array(9 * rays), up = new Float32Array(9 * rays).map((_, i) => (i % 3 === 2 ? 1 : 0));
    const made = { position: buffer(flat, gl.ARRAY_BUFFER, gl.DYNAMIC_DRAW), normal: buffer(up), count: 3 * rays };
    made.move = (middle, ends, z) => {
      ends.forEach((end, i) => flat.set([...middle, z, ...end, z, ...ends[(i + 1) % rays], z], 9 * i));
      gl.bindBuffer(gl.ARRAY_BUFFER, made.position);
      gl.bufferData(gl.ARRAY_BUFFER, flat, gl.DYNAMIC_DRAW);
    };
    return made;
  };
  const attribute = (vao, at, made, size, kind = gl.FLOAT, divisor = 0, normalized = false) => {
    gl.bindBuffer(gl.ARRAY_BUFFER, made);
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, size, kind, normalized, 0, 0);
    gl.vertexAttribDivisor(at, divisor);
  };
  const batch = (shape, { centre, size, yaw, colour }) => {
    // colour: 4 bytes an instance. Arrays may be replaced later with set().
    const vao = gl.createVertexArray();
    const made = { vao, shape, visible: true, count: yaw.length, blend: false };
    gl.bindVertexArray(vao);
    attribute(vao, 0, shape.position, 3);
    attribute(vao, 1, shape.normal, 3);
    made.buffers = [new Float32Array(centre), new Float32Array(size), new Float32Array(yaw), new Uint8Array(colour)]
      .map((data) => buffer(data, gl.ARRAY_BUFFER, gl.DYNAMIC_DRAW));
    [[2, 3, gl.FLOAT, false], [3, 3, gl.FLOAT, false], [4, 1, gl.FLOAT, false], [5, 4, gl.UNSIGNED_BYTE, true]]
      .forEach(([at, n, kind, norm], i) => attribute(vao, at, made.buffers[i], n, kind, 1, norm));
    gl.bindVertexArray(null);
    made.set = (parts) => {
      for (const [i, key, Kind] of [[0, "centre", Float32Array], [1, "size", Float32Array], [2, "yaw", Float32Array], [3, "colour", Uint8Array]]) {
        if (!parts[key]) continue;
        gl.bindBuffer(gl.ARRAY_BUFFER, made.buffers[i]);
        gl.bufferData(gl.ARRAY_BUFFER, new Kind(parts[key]), gl.DYNAMIC_DRAW);
      }
      if (parts.yaw) made.count = parts.yaw.length;
    };
    return made;
  };
  const draw = (view, batches) => {
    const ratio = window.devicePixelRatio || 1;
    const [w, h] = [Math.max(1, Math.round(canvas.clientWidth * ratio)), Math.max(1, Math.round(canvas.clientHeight * ratio))];
    if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
    gl.viewport(0, 0, w, h);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.useProgram(program);
    gl.uniformMatrix4fv(uView, false, view);
    for (const blend of [false, true]) {
      if (blend) { gl.enable(gl.BLEND); gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA); gl.depthMask(false); }
      for (const one of batches) {
        if (!one.visible || !one.count || one.blend !== blend) continue;
        gl.bindVertexArray(one.vao);
        gl.drawArraysInstanced(gl.TRIANGLES, 0, one.shape.count, one.count);
      }
    }
    gl.disable(gl.BLEND);
    gl.depthMask(true);
    gl.bindVertexArray(null);
  };
  return { mesh, smooth, fan, batch, draw };
}

// A camera that orbits about a point on the floor.
function liosCamera(canvas, changed) {
  // raised: the target stands in the middle of what the lowest `raised` of the picture's height leaves.
  const camera = { target: [0, 0, 0], distance: 20, turn: -1.8, tilt: 0.94, fov: 0.66, raised: 0 };
  const limit = () => {
    camera.tilt = Math.min(1.5706, Math.max(0.08, camera.tilt));
    camera.distance = Math.min(400, Math.max(1, camera.distance));
  };
  camera.axes = () => {
    const [ct, st, cu, su] = [Math.cos(camera.tilt), Math.sin(camera.tilt), Math.cos(camera.turn), Math.sin(camera.turn)];
    const back = [ct * cu, ct * su, st], right = [-su, cu, 0];
    const up = [back[1] * right[2] - back[2] * right[1], back[2] * right[0] - back[0] * right[2], back[0] * right[1] - back[1] * right[0]];
    return { back, right, up };
  };
  camera.matrix = () => {
    const { back, right, up } = camera.axes();
    const eye = camera.target.map((t, i) => t + back[i] * camera.distance);
    const aspect = Math.max(0.1, canvas.clientWidth / Math.max(1, canvas.clientHeight));
    const f = 1 / Math.tan(camera.fov / 2), near = camera.distance / 100 + 0.05, far = camera.distance * 6 + 100;
    const dot = (a) => -(a[0] * eye[0] + a[1] * eye[1] + a[2] * eye[2]);
    const v = [right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0, dot(right), dot(up), dot(back), 1];
    const p = [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, -camera.raised, (far + near) / (near - far), -1, 0, 0, 2 * far * near / (near - far), 0];
    const m = new Float32Array(16);
    for (let i = 0; i < 4; i++) for (let j = 0; j < 4; j++) for (let k = 0; k < 4; k++) m[4 * i + j] += v[4 * i + k] * p[4 * k + j];
    return m;
  };
  camera.fit = (points, { above = false, covered = 0 } = {}) => {
    // The same fit as the Viser app's: slide and step back until the house fills the picture.
    camera.turn = above ? -Math.PI / 2 : -1.815;
    camera.tilt = above ? 1.5706 : 0.942;
    const half = Math.tan(camera.fov / 2), aspect = Math.max(0.2, canvas.clientWidth / Math.max(1, canvas.clientHeight));
    const { back, right, up } = camera.axes();
    const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let at = [0, 1, 2].map((i) => points.reduce((sum, p) => sum + p[i], 0) / points.length), distance = 40;
    for (let round = 0; round < 50; round++) {
      let [x0, x1, y0, y1] = [9e9, -9e9, 9e9, -9e9];
      for (const p of points) {
        const away = p.map((v, i) => v - at[i]), depth = Math.max(0.1, distance - dot(away, back));
        const x = dot(away, right) / depth / half / aspect, y = dot(away, up) / depth / half;
        x0 = Math.min(x0, x); x1 = Math.max(x1, x); y0 = Math.min(y0, y); y1 = Math.max(y1, y);
      }
      const low = -1 + 2 * covered, spread = Math.max((x1 - x0) / 2, (y1 - y0) / (1 - low)) / 0.92;
      const mx = (x0 + x1) / 2 * aspect, my = (y0 + y1) / 2 - (low + 1) / 2;
      at = at.map((v, i) => v + (right[i] * mx + up[i] * my) * half * distance * 0.7);
      distance = Math.max(1, distance * (1 + 0.7 * (spread - 1)));
    }
    const down = at[2] / back[2];
    camera.target = at.map((v, i) => v - back[i] * down);
    camera.distance = distance + down;
    limit();
    changed();
  };
  const fingers = new Map();
  const pan = (dx, dy) => {
    const { right } = camera.axes(), step = camera.distance * Math.tan(camera.fov / 2) * 2 / canvas.clientHeight;
    const ahead = [-Math.cos(camera.turn), -Math.sin(camera.turn)];
    camera.target[0] -= right[0] * dx * step - ahead[0] * dy * step / Math.max(0.3, Math.sin(camera.tilt));
    camera.target[1] -= right[1] * dx * step - ahead[1] * dy * step / Math.max(0.3, Math.sin(camera.tilt));
  };
  canvas.addEventListener("pointerdown", (e) => { canvas.setPointerCapture(e.pointerId); fingers.set(e.pointerId, [e.clientX, e.clientY]); camera.moved = true; });
  canvas.addEventListener("pointermove", (e) => {
    const before = fingers.get(e.pointerId);
    if (!before) return;
    const [dx, dy] = [e.clientX - before[0], e.clientY - before[1]];
    if (fingers.size === 2) {
      const [other] = [...fingers].filter(([id]) => id !== e.pointerId).map(([, p]) => p);
      const was = Math.hypot(before[0] - other[0], before[1] - other[1]), is = Math.hypot(e.clientX - other[0], e.clientY - other[1]);
      camera.distance *= was / Math.max(1, is);
      pan(dx / 2, dy / 2);
    } else if (e.buttons === 2 || e.shiftKey) pan(dx, dy);
    else { camera.turn -= dx * 0.006; camera.tilt += dy * 0.006; }
    fingers.set(e.pointerId, [e.clientX, e.clientY]);
    limit();
    changed();
  });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (e) => fingers.delete(e.pointerId));
  canvas.addEventListener("contextmenu", (e) => e.preventDefault());
  canvas.addEventListener("wheel", (e) => { e.preventDefault(); camera.distance *= Math.exp(e.deltaY * 0.001); camera.moved = true; limit(); changed(); }, { passive: false });
  return camera;
}
