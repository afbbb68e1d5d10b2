// Where runs are on the clock that they share: by time, by distance or by decision.
const liosUpper = (list, value) => {
  let [low, high] = [0, list.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (list[middle] <= value) low = middle + 1;
    else high = middle;
  }
  return low;
};
const liosInterpolate = (x, xs, ys) => {
  const i = liosUpper(xs, x);
  if (i === 0) return ys[0];
  if (i >= xs.length) return ys[ys.length - 1];
  const span = xs[i] - xs[i - 1];
  return ys[i - 1] + (span > 0 ? (x - xs[i - 1]) / span : 0) * (ys[i] - ys[i - 1]);
};
// state.clock is "time", "distance" or "decision".
function liosClock(runs, state) {
  const walked = (run) => run.wayM[run.wayM.length - 1];
  const secondOf = (run, at) => {
    if (state.clock === "time") return Math.min(at, run.duration);
    if (state.clock === "distance") return at >= walked(run) ? run.duration : liosInterpolate(at, run.wayM, run.wayS);
    const n = Math.floor(at + 1e-9);
    return n < 1 ? 0 : n > run.decisions.length ? run.duration : run.decisions[n - 1];
  };
  const readingOf = (run, seconds) => {
    if (state.clock === "time") return seconds;
    if (state.clock === "distance") return liosInterpolate(seconds, run.wayS, run.wayM);
    return liosUpper(run.decisions, seconds + 1e-9);
  };
  const lengthOf = (run) => {
    if (state.clock === "time") return run.duration;
    return state.clock === "distance" ? walked(run) : run.decisions.length + 1;
  };
  const endOf = () => Math.max(1e-9, ...runs.map(lengthOf));
  return { secondOf, readingOf, endOf };
}
