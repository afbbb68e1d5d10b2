// Draws moments as frames of a film: the 3D view, its labels and a caption on one canvas, encoded by the browser.
window.liosFilm = (() => {
  let canvas, context, encoder, chunks = [], description = "", count = 0, options = {}, failure = null;
  const base64 = (bytes) => { let s = ""; for (let i = 0; i < bytes.length; i += 8192) s += String.fromCharCode(...bytes.subarray(i, i + 8192)); return btoa(s); };
  const take = () => { const out = chunks; chunks = []; return out; };
  const begin = async (wanted) => {
    options = wanted;
    canvas = new OffscreenCanvas(options.width, options.height);
    context = canvas.getContext("2d");
    if (!window.VideoEncoder) throw new Error("this browser has no video encoder");
    encoder = new VideoEncoder({
      output: (chunk, info) => {
        const bytes = new Uint8Array(chunk.byteLength);
        chunk.copyTo(bytes);
        chunks.push({ data: base64(bytes), key: chunk.type === "key" });
        if (info?.decoderConfig?.description) description = base64(new Uint8Array(info.decoderConfig.description));
      },
      error: (error) => { failure = error; },
    });
    const base = { width: options.width, height: options.height, framerate: options.fps, bitrate: 6_000_000, avc: { format: "avc" } };
    for (const codec of ["avc1.640033", "avc1.640028", "avc1.42003e", "avc1.42001f"]) {
      if ((await VideoEncoder.isConfigSupported({ ...base, codec })).supported) { encoder.configure({ ...base, codec }); return; }
    }
    throw new Error("this browser cannot encode H.264");
  };
  const draw = async (moments) => {
    for (const at of moments) {
      window.lios.seek(at);
      window.lios.paint(context, options.width, options.height, options.caption);
      const frame = new VideoFrame(canvas, { timestamp: Math.round(count * 1e6 / options.fps) });
      encoder.encode(frame, { keyFrame: count % (2 * options.fps) === 0 });
      frame.close();
      count += 1;
    }
    while (encoder.encodeQueueSize > 4 && !failure) await new Promise((done) => setTimeout(done, 5));
    if (failure) throw failure;
    return take();
  };
  const end = async () => { await encoder.flush(); encoder.close(); if (failure) throw failure; return { chunks: take(), description }; };
  return { begin, draw, end };
})();
