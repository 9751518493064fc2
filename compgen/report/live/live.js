// The sliders of a what-if page, in closed form: what the package has in thermal/ and pipelines/uncertainty/band_columns.py, here
// for a browser. Places and samples: pipelines/study/live_places.py; the band's quantities: live_band.py, with the same
// letters. With the day's state z_0 by its stages, tau when the run begins, w what a robot that stands still tends to, C
// what the cycle adds until then, T how long it is since the first stage, and a u what air does to modes since then,
//
//   z = w + (e^{-rate tau} z_0 + C - w) e^{-rate d}          the modes as the program starts, run at tau, d late
//   r(p) = O (e^{-rate t_p} z + a u(T + t_p)) + F(p)         rises at place p
//   e(n) = e0(n) + sum_m u_m(n) B_m r(n)                     at sample n, of shapes u; r straight from place to place
"use strict";
(() => {
const root = document.getElementById("live");
const data = JSON.parse(document.getElementById("live-data").textContent);
const UM = 1e6, MINUTE = 60, HOUR = 3600, MM = 1e-3;

// ---- packed arrays -------------------------------------------------------------------------------------------------
const KINDS = {f4: Float32Array, f8: Float64Array, i2: Int16Array};
function unpack(value) {
  if (Array.isArray(value)) return value.map(unpack);
  if (value === null || typeof value !== "object") return value;
  if (value.bdata === undefined) {
    for (const key of Object.keys(value)) value[key] = unpack(value[key]);
    return value;
  }
  const text = atob(value.bdata), bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  return new KINDS[value.dtype](bytes.buffer);
}
const live = unpack(data.live), heat = live.heat, band = live.band;
const sliders = live.sliders, S = heat.rate.length, K = heat.names.length;
const zeros = count => new Float64Array(count);

// ---- the day: stages, each in closed form --------------------------------------------------------------------------
// A stage repeats n times a stretch of motion of length T, which heats towards m, and a rest of length D towards h:
//
//   z -> e^{-rate (T + D)} z + c        once,     c = (m (1 - e^{-rate T}) - h) e^{-rate D} + h
//   z -> q^n z + c (1 - q^n) / (1 - q)  n times,  q = e^{-rate (T + D)}
//
// With f the feed and s the share of the time in motion, the nodes' goals are their own law, and the network's lie
// between moving and held, which are known at the feeds of a table (each is a program planned anew):
//
//   m = A (i + (1 - i) s (f / f_ref)^p)        h = A i            (nodes)
//   m = s M(f) + (1 - s) H(f)                  h = H(f)           (network)
//
// Servo off, goals are zero. No power is taken for q^n, and where nothing decays its sum is n.
// A law is that of the nodes {rate, amplitude, exponent, idle, reference_feed}, of what builds up {rate, idle}, or null.
function movingGoal(law, feed, share) {
  if (!law.amplitude) return law.rate.map(() => law.idle + (1 - law.idle) * share);
  return law.rate.map((_, s) => law.amplitude[s] * (law.idle
    + (1 - law.idle) * share * Math.pow(feed / law.reference_feed, law.exponent[s])));
}
const heldGoal = law => law.rate.map((_, s) => (law.amplitude ? law.amplitude[s] : 1) * law.idle);

function goals(law, stage, modes) {
  const zero = zeros(modes);
  let moving, held;
  if (!law) {
    if (stage.goal) return [stage.goal, zero];
    if (!stage.stops) return [zero, zero];
    let k = 0;
    stage.stops.feed.forEach((f, n) => {
      if (Math.abs(f - stage.feed) < Math.abs(stage.stops.feed[k] - stage.feed)) k = n;
    });
    held = stage.stops.held.subarray(k * modes, (k + 1) * modes);
    moving = stage.stops.moving.subarray(k * modes, (k + 1) * modes)
      .map((m, s) => stage.share * m + (1 - stage.share) * held[s]);
  } else {
    moving = movingGoal(law, stage.feed, stage.share);
    held = heldGoal(law);
  }
  const first = {moving, idle: held, off: zero}[stage.state];
  return [first, stage.rest === "idle" ? held : zero];
}

function afterStages(law, rate, stages, begin) {
  const z = Float64Array.from(begin);
  for (const stage of stages) {
    const [m, h] = goals(law, stage, rate.length);
    for (let s = 0; s < rate.length; s++) {
      const once = (m[s] * -Math.expm1(-rate[s] * stage.duration) - h[s]) * Math.exp(-rate[s] * stage.dwell) + h[s];
      const q = rate[s] * (stage.duration + stage.dwell);
      const sum = q > 0 ? Math.expm1(-stage.count * q) / Math.expm1(-q) : stage.count;
      z[s] = z[s] * Math.exp(-stage.count * q) + once * sum;
    }
  }
  return z;
}
const STANDING = {state: "idle", feed: 0, share: 1, count: 1, dwell: 0, rest: "idle"};
const total = stage => stage.count * (stage.duration + stage.dwell);
const passed = stages => stages.reduce((sum, stage) => sum + total(stage), 0);

// ---- stages that keep to the shifts, cut at their edges -------------------------------------------------------------
const DAY = 24 * HOUR;
function pieces(stage, part, now) {  // moving in the shifts, idle in their breaks, off between them
  const end = now + part.duration, spans = [];
  for (let day = Math.floor(now / DAY) - 1; day * DAY < end; day++) {
    for (const shift of live.shifts) shift.forEach(([a, b], n) => spans.push([day * DAY + a, day * DAY + b, n > 0]));
  }
  const inside = spans.flatMap(([a, b]) => [a, b]).filter(t => now < t && t < end);
  const at = [...new Set([now, ...inside, end])].sort((a, b) => a - b), out = [];
  for (let k = 0; k + 1 < at.length; k++) {
    const middle = (at[k] + at[k + 1]) / 2, over = spans.filter(([a, b]) => a <= middle && middle < b);
    const state = !over.length ? "off" : over.some(span => span[2]) ? "idle" : part.state;
    out.push({...stage, state, duration: at[k + 1] - at[k], count: 1, dwell: 0});
  }
  return out;
}
function cut(stages) {
  let clock = live.clock;
  return stages.flatMap(stage => {
    const begin = clock;
    clock += total(stage);
    if (!stage.keeps_to_shifts) return [stage];
    if (!stage.dwell) return pieces(stage, {state: stage.state, duration: stage.duration * stage.count}, begin);
    const pair = stage.duration + stage.dwell, out = [];
    for (let n = 0; n < stage.count; n++) {
      out.push(...pieces(stage, stage, begin + n * pair));
      out.push(...pieces(stage, {state: stage.rest, duration: stage.dwell}, begin + n * pair + stage.duration));
    }
    return out;
  });
}

// ---- the air: straight from knot to knot, and one wave; exactly, mode by mode ---------------------------------------
function level(air, t) {
  const {time, rise} = air, last = time.length - 1;
  if (t <= time[0]) return rise[0];
  if (t >= time[last]) return rise[last];
  let k = 0;
  while (time[k + 1] < t) k++;
  return rise[k] + (rise[k + 1] - rise[k]) * (t - time[k]) / (time[k + 1] - time[k]);
}
const inBalance = heat.start === null;
const edgesOf = new Map();
function edges(air, rate) {  // when the air turns, and the modes then; the day does not move it, so it is kept
  const kept = edgesOf.get(rate);
  if (kept && kept.key === air.key) return kept;
  const at = [0, ...Array.from(air.time).filter(t => t > 0)];
  const levels = at.map(t => level(air, t));
  const states = [rate.map(() => inBalance ? levels[0] : 0)];
  for (let k = 0; k + 1 < at.length; k++) {
    const dt = at[k + 1] - at[k], slope = (levels[k + 1] - levels[k]) / dt;
    states.push(rate.map((r, s) => ramp(r, levels[k], slope, states[k][s], dt)));
  }
  const made = {key: air.key, at, levels, states};
  edgesOf.set(rate, made);
  return made;
}
const ramp = (r, from, slope, state, t) =>
  from + slope * t - slope / r + (state - (from - slope / r)) * Math.exp(-r * t);

function airSince(air, rate, time, out) {  // u at rising times, (M x modes)
  const {at, levels, states} = edges(air, rate), modes = rate.length;
  const w = 2 * Math.PI / air.period;
  let k = 0;
  for (let n = 0; n < time.length; n++) {
    const t = time[n];
    while (k + 1 < at.length && at[k + 1] <= t) k++;
    const slope = k + 1 < at.length ? (levels[k + 1] - levels[k]) / (at[k + 1] - at[k]) : 0;
    const flat = !slope && states[k].every(state => state === levels[k]);
    for (let s = 0; s < modes; s++) {
      const r = rate[s];
      let u = flat ? levels[k] : ramp(r, levels[k], slope, states[k][s], t - at[k]);
      if (air.amplitude) {  // Re[a r / (r + i w) e^{i w (t - peak)}]
        const forced = x => air.amplitude * r * (r * Math.cos(w * (x - air.peak)) + w * Math.sin(w * (x - air.peak)))
          / (r * r + w * w);
        u += forced(t) - (inBalance ? 0 : forced(0) * Math.exp(-r * t));
      }
      out[n * modes + s] = u;
    }
  }
  return out;
}

// ---- a setting of the sliders, and the state in which the program starts ------------------------------------------------
function stateOf(values) {
  const moved = live.stages.map(stage => ({...stage}));
  const air = {...heat.air, rise: Float64Array.from(heat.air.rise)};
  let delay = 0, run = 0, factor = 1;
  sliders.forEach((slider, n) => {
    const value = values[n], stage = moved[slider.stage];
    if (slider.kind === "air") slider.knots.forEach((k, q) => { air.rise[q] += (value - slider.value) * k; });
    else if (slider.kind === "delay") delay = value * MINUTE;
    else if (slider.kind === "run") run = slider.stops.indexOf(value);
    else if (slider.kind === "cte") factor = value / live.cte;
    else if (slider.kind === "duration") stage.duration = value * HOUR;
    else if (slider.kind === "repeat") stage.count = value;
    else if (slider.kind === "duty") stage.share = value;
    else if (slider.kind === "feed") {
      stage.feed = value * MM;
      if (stage.repeated) stage.duration = stage.stops.run_time[slider.stops.indexOf(value)];
    }
  });
  air.key = Array.from(air.rise).join();
  const stages = cut(moved), before = passed(stages), tau = heat.run[run];
  const z = afterStages(heat.law, heat.rate, stages, heat.start || zeros(S));
  for (let s = 0; s < S; s++) {
    const w = heat.standing[s], r = heat.rate[s];
    z[s] = w + (Math.exp(-r * tau) * z[s] + heat.cycle[run * S + s] - w) * Math.exp(-r * delay);
  }
  return {z, stages, air, run, delay, factor, elapsed: before + tau + delay};
}

function rises(state, time, program) {  // (P x K)
  const P = time.length, out = zeros(P * K);
  const u = airSince(state.air, heat.rate, time.map(t => state.elapsed + t), zeros(P * S));
  for (let p = 0; p < P; p++) {
    for (let s = 0; s < S; s++) {
      const mode = Math.exp(-heat.rate[s] * time[p]) * state.z[s] + heat.ambient[s] * u[p * S + s];
      for (let k = 0; k < K; k++) out[p * K + k] += heat.outputs[k * S + s] * mode;
    }
    for (let k = 0; k < K; k++) out[p * K + k] += program[p * K + k];
  }
  return out;
}

function displaced(side, r, factor) {  // d = (B_c + factor B_g) r, (P x 3)
  const P = side.time.length, out = zeros(P * 3);
  for (let p = 0; p < P; p++) for (let i = 0; i < 3; i++) {
    let sum = 0;
    for (let k = 0; k < K; k++) {
      const n = (p * 3 + i) * K + k;
      sum += ((side.slope ? side.slope[n] : 0) + factor * side.growth[n]) * r[p * K + k];
    }
    out[p * 3 + i] = sum;
  }
  return out;
}

function errors(side, state) {
  const r = rises(state, side.time, side.program), M = side.at.length, P = side.time.length, R = side.slope.length / K / 3;
  const moved = zeros(P * R * 3);  // B_m r at the places
  for (let p = 0; p < P; p++) for (let m = 0; m < R * 3; m++) {
    let sum = 0;
    for (let k = 0; k < K; k++) sum += (side.slope[m * K + k] + state.factor * side.growth[m * K + k]) * r[p * K + k];
    moved[p * R * 3 + m] = sum;
  }
  const size = zeros(M), local = zeros(P);
  let largest = 0, square = 0, weight = 0;
  for (let n = 0; n < M; n++) {
    const j = Math.min(Math.floor(side.at[n]), Math.max(P - 2, 0)), x = side.at[n] - j;
    let a = j * R * 3, b = Math.min(j + 1, P - 1) * R * 3;
    let ex = side.own[n * 3], ey = side.own[n * 3 + 1], ez = side.own[n * 3 + 2];
    for (let m = n * R; m < (n + 1) * R; m++, a += 3, b += 3) {
      const u = side.shape[m];
      ex += u * ((1 - x) * moved[a] + x * moved[b]);
      ey += u * ((1 - x) * moved[a + 1] + x * moved[b + 1]);
      ez += u * ((1 - x) * moved[a + 2] + x * moved[b + 2]);
    }
    const e = Math.sqrt(ex * ex + ey * ey + ez * ez);
    size[n] = e;
    if (e > largest) largest = e;
    if (e > local[j]) local[j] = e;
    square += e * e * side.length[n];
    weight += side.length[n];
  }
  return {largest, p99: share99(size, side.length, weight), rms: Math.sqrt(square / weight), local, r};
}

function share99(size, length, weight) {  // the smallest size that 99 % of the length stay at or below
  let low = -1, high = 0;
  for (const e of size) if (e > high) high = e;
  for (let step = 0; step < 45; step++) {
    const middle = (low + high) / 2;
    let below = 0;
    for (let n = 0; n < size.length; n++) if (size[n] <= middle) below += length[n];
    if (below >= 0.99 * weight) high = middle; else low = middle;
  }
  let least = Infinity;
  for (let n = 0; n < size.length; n++) if (length[n] > 0 && size[n] > low && size[n] < least) least = size[n];
  return least;
}

// ---- the band: what the files leave open ------------------------------------------------------------------------------
function heatsOf(state) {
  const N = band.time.length, tau = heat.run[state.run], {rate} = band.build_up;
  const atStart = (law, begin, cycle) => {  // modes of a law as the program starts, in still air
    const z = afterStages(law, law.rate, state.stages, begin), modes = law.rate.length;
    for (let s = 0; s < modes; s++) z[s] = Math.exp(-law.rate[s] * tau) * z[s] + cycle[state.run * modes + s];
    return afterStages(law, law.rate, [{...STANDING, duration: state.delay}], z);
  };
  const y = atStart(band.build_up, zeros(K), band.build_up_cycle);
  const pairs = band.models.map(pair => {
    const [plus, minus] = pair.laws.map((law, side) => {
      const z = atStart(law, heat.start || zeros(S), pair.cycle[side]);
      const u = airSince(state.air, law.rate, Array.from(band.time, t => state.elapsed + t), zeros(N * S));
      const goal = movingGoal(law, band.feed, 1);
      return [z.map((v, s) => v - goal[s]), goal, law.rate, u];
    });
    const of = ([z, goal, rates, u], n, s) => goal[s] + z[s] * Math.exp(-band.time[n] * rates[s]) + u[n * S + s];
    return (n, s) => (of(plus, n, s) - of(minus, n, s)) / (2 * pair.step);
  });
  return band.quantities.map(q => {
    if (!q.has_heat) return null;
    const h = zeros(N * K);
    for (let n = 0; n < N; n++) for (let k = 0; k < K; k++) {
      const t = band.time[n];
      let sum = q.missed[k] * (1 + (y[k] - 1) * Math.exp(-t * rate[k]));
      if (!inBalance) sum += q.start[k] * Math.exp(-(state.elapsed + t) * rate[k]);
      if (q.air) for (let s = 0; s < S; s++) {
        const share = inBalance ? 1 : -Math.expm1(-(state.elapsed + t) * heat.rate[s]);
        sum += q.air * heat.outputs[k * S + s] * heat.ambient[s] * share;
      }
      h[n * K + k] = q.model < 0 ? sum : sum + pairs[q.model](n, k);
    }
    return h;
  });
}

function squares(S6, x, y, z) {
  S6[0] += x * x; S6[1] += x * y; S6[2] += x * z; S6[3] += y * y; S6[4] += y * z; S6[5] += z * z;
}

function radius([xx, xy, xz, yy, yz, zz]) {  // of 95 %, by Welch and Satterthwaite
  const trace = xx + yy + zz;
  if (!(trace > 0)) return 0;
  const square = xx * xx + yy * yy + zz * zz + 2 * (xy * xy + xz * xz + yz * yz);
  const freedom = Math.min(3, Math.max(1, trace * trace / square)), {quantile} = band;
  const at = (freedom - 1) / 2 * (quantile.length - 1), k = Math.min(Math.floor(at), quantile.length - 2);
  return Math.sqrt(trace / freedom * (quantile[k] + (at - k) * (quantile[k + 1] - quantile[k])));
}

function bandAt(state) {
  const N = band.time.length, r = rises(state, band.time, band.program), heats = heatsOf(state);
  const warm = displaced(band, r, state.factor), largest = zeros(band.sources.length);
  const touches = band.on_part.some(w => w > 0);
  let whole = 0;
  for (let n = 0; n < N; n++) {
    if (touches && !(band.on_part[n] > 0)) continue;
    const S6 = band.sources.map(() => zeros(6)), offset = zeros(3);
    band.quantities.forEach((q, number) => {
      const c = [q.column[n * 3], q.column[n * 3 + 1], q.column[n * 3 + 2]], h = heats[number];
      let {mean, deviation} = q;
      if (q.absolute) {
        const [low, high] = q.absolute.map(limit => limit / (live.cte * state.factor) - 1);
        mean = (low + high) / 2;
        deviation = (high - low) / Math.sqrt(12);
      }
      for (let i = 0; i < 3; i++) for (let k = 0; k < K; k++) {
        const at = (n * 3 + i) * K + k;
        if (q.by_rise) c[i] += (q.expands ? state.factor : 1) * q.by_rise[at] * r[n * K + k];
        if (h) c[i] += ((band.slope ? band.slope[at] : 0) + state.factor * band.growth[at]) * h[n * K + k];
      }
      squares(S6[q.source], c[0] * deviation, c[1] * deviation, c[2] * deviation);
      for (let i = 0; i < 3; i++) offset[i] += mean * c[i];
    });
    squares(S6[band.one_sided], ...offset);
    const left = i => warm[n * 3 + i] + (band.taken ? band.taken[n * 3 + i] : 0);  // a taught frame took up the rest
    const hot = band.missing * Math.hypot(left(0), left(1), left(2));
    for (const [source, size] of [[band.missing_source, hot], ...band.undirected]) {
      for (const i of [0, 3, 5]) S6[source][i] += size * size;
    }
    const sum = zeros(6);
    S6.forEach((S1, source) => {
      for (let i = 0; i < 6; i++) { S1[i] *= band.scale * band.scale; sum[i] += S1[i]; }
      largest[source] = Math.max(largest[source], radius(S1));
    });
    whole = Math.max(whole, radius(sum));
  }
  return {whole, largest};
}

// ---- where the model was measured --------------------------------------------------------------------------------------
function beyond(values, state, sides) {  // words beside each slider
  const {box} = live, words = sliders.map(() => []);
  let hours = live.duration + heat.run_moving[state.run];
  state.stages.forEach(stage => { if (stage.state === "moving") hours += stage.count * stage.duration * stage.share; });
  let hottest = 0, coldest = 0;
  let z = heat.start || zeros(S);
  if (heat.law) for (const stage of state.stages) {
    z = afterStages(heat.law, heat.rate, [stage], z);
    hottest = Math.max(hottest, ...z);
  }
  for (const side of sides) for (const r of side.r) { hottest = Math.max(hottest, r); coldest = Math.min(coldest, r); }
  sliders.forEach((slider, n) => {
    const value = values[n];
    if (slider.kind === "feed" && (value < box.feed[0] || value > box.feed[1])) words[n].push(
      `beyond ${fixed(box.feed[0])} to ${fixed(box.feed[1])} mm/s, where the warmth was measured`);
    if (["duration", "repeat", "duty", "run"].includes(slider.kind) && hours > box.hours * HOUR) {
      if (live.stages[slider.stage] === undefined || live.stages[slider.stage].state === "moving") words[n].push(
        `${(hours / HOUR).toFixed(2)} h of motion by the program's end: the warmth was measured over ${fixed(box.hours)} h`);
    }
    const late = (value - slider.value) * MINUTE + live.early;  // than the start that the program's remark counts from
    if (slider.kind === "delay" && late > live.window && live.window > 0) words[n].push(
      `later than the ${Math.floor(live.window)} s that the program's remark allows`);
    if (slider.kind === "cte" && live.cte_limits
        && (value < live.cte_limits[0] - 1e-9 || value > live.cte_limits[1] + 1e-9)) words[n].push(
      `beyond ${fixed(live.cte_limits[0])} to ${fixed(live.cte_limits[1])}, what the robot file holds for possible`);
    if (slider.kind === "air" && (hottest > box.rise || coldest < -box.rise)) words[n].push(riseWords());
  });
  const all = [];
  function riseWords() {
    return hottest > box.rise ? `a rise of ${hottest.toFixed(1)} K is above the ${fixed(box.rise)} K that were measured`
      : `a rise of ${coldest.toFixed(1)} K lies further below zero than the ${fixed(box.rise)} K measured above it`;
  }
  if (hottest > box.rise || coldest < -box.rise) all.push(riseWords());
  return [words, all];
}
const fixed = value => String(+value.toPrecision(6));

// ---- what the page shows ------------------------------------------------------------------------------------------------
const $ = id => document.getElementById(id);
const micro = value => (value * UM).toFixed(2);
const rounded = value => value * UM >= 9.95 ? (value * UM).toFixed(0) : (value * UM).toFixed(1);
const text = (element, words) => { if (element.textContent !== words) element.textContent = words; };
const SVG = "http://www.w3.org/2000/svg";
const plannedValues = sliders.map(slider => slider.value);
let values = [...plannedValues];
const refused = sliders.map(() => "");  // why what was typed is not shown

function overrides() {
  const out = live.averaged ? [`'${live.one_start}'`] : [];
  sliders.forEach((slider, n) => {
    const isStart = slider.kind === "delay" || slider.kind === "run";
    if (values[n] !== slider.value || (live.averaged && isStart)) out.push(`${slider.key}=${String(values[n])}`);
  });
  return out.map(item => ` --set ${item}`).join("");
}

// -- the state of the sliders in the page's address: a link to it opens in the same state
function fragment() {  // of those that were moved
  const moved = sliders.flatMap((slider, n) => values[n] === slider.value ? []
    : [`${encodeURIComponent(slider.key)}=${encodeURIComponent(values[n])}`]);
  return moved.join("&");
}
function linked() {  // the setting that the address has; the planned one where any of it is not what a slider can say
  const setting = [...plannedValues];
  try {
    for (const part of location.hash.slice(1).split("&").filter(part => part)) {
      const [key, word, ...more] = part.split("=").map(decodeURIComponent);
      const n = sliders.findIndex(slider => slider.key === key), slider = sliders[n], value = Number(word);
      if (!slider || more.length || !/^-?[0-9.]+(e-?[0-9]+)?$/.test(word) || !(value >= slider.low && value <= slider.high)
          || (slider.stops.length && !slider.stops.includes(value))
          || (slider.kind === "repeat" && !Number.isInteger(value))) return [...plannedValues];
      setting[n] = value;
    }
  } catch { return [...plannedValues]; }  // no text in such an address
  return setting;
}
function writeLink() {
  const state = fragment();
  if (state === location.hash.slice(1)) return;
  try { history.replaceState(null, "", state ? `#${state}` : location.pathname + location.search); }
  catch { /* a page inside another may not change its address */ }
}
window.addEventListener("hashchange", () => { values = linked(); refused.fill(""); later(); });

// -- the path, and the error along it
const view = {axes: [0, 1], colour: "after"};
const frame = {w: 640, h: 440};
const DRAWN = 600;  // stretches of a colour: what a browser has to style anew with every move
function scaled(side) {
  const [i, j] = view.axes, xs = [], ys = [];
  for (let p = 0; p < side.time.length; p++) { xs.push(side.position[p * 3 + i]); ys.push(side.position[p * 3 + j]); }
  const low = [Math.min(...xs), Math.min(...ys)], high = [Math.max(...xs), Math.max(...ys)];
  const size = Math.max((high[0] - low[0]) / (frame.w - 40), (high[1] - low[1]) / (frame.h - 40), 1e-6);
  const cx = (low[0] + high[0]) / 2, cy = (low[1] + high[1]) / 2;
  return xs.map((x, p) => [frame.w / 2 + (x - cx) / size, frame.h / 2 - (ys[p] - cy) / size]);
}
let lines = [];  // [what is drawn in one colour, its first place, the place after its last]
function drawPath() {
  const side = live[view.colour], points = scaled(side), group = $("live-path"), last = points.length - 1;
  const most = Math.ceil(points.length / DRAWN);
  group.replaceChildren();
  lines = [];
  for (let p = 0; p < last;) {
    if (side.gap[p]) { p++; continue; }
    const begin = p;
    while (p < last && p - begin < most && !side.gap[p]) p++;
    const line = document.createElementNS(SVG, "polyline");
    line.setAttribute("points", points.slice(begin, p + 1).map(([x, y]) => `${x.toFixed(1)},${y.toFixed(1)}`).join(" "));
    group.append(line);
    lines.push([line, begin, p]);
  }
  text($("live-axes"), `seen along ${"XYZ"[3 - view.axes[0] - view.axes[1]]}: ${"XYZ"[view.axes[0]]} to the right, ` +
    `${"XYZ"[view.axes[1]]} up`);
}
const stops = live.colours.map(hex => [1, 3, 5].map(at => parseInt(hex.slice(at, at + 2), 16)));
const palette = Array.from({length: 101}, (_, n) => {
  const at = n / 100 * (stops.length - 1), k = Math.min(Math.floor(at), stops.length - 2);
  return `rgb(${stops[k].map((v, c) => Math.round(v + (at - k) * (stops[k + 1][c] - v))).join()})`;
});
function colourPath(shown) {
  const {local, largest} = shown[view.colour];
  const top = largest > 0 ? largest : 1;
  for (const [line, begin, end] of lines) {
    let most = 0;
    for (let p = begin; p < end; p++) if (local[p] > most) most = local[p];
    line.setAttribute("stroke", palette[Math.round(100 * Math.min(1, most / top))]);
  }
  text($("live-scale-top"), `${micro(largest)} µm`);
}
const chart = {left: 52, right: 632, height: 96};
function curve(side, {local, largest}, key) {
  const length = side.arc[side.arc.length - 1] - side.arc[0] || 1, top = largest || 1;
  let path = "", pen = "M";
  for (let p = 0; p + 1 < local.length; p++) {
    if (side.gap[p]) { pen = "M"; continue; }
    const x = chart.left + (side.arc[p] - side.arc[0]) / length * (chart.right - chart.left);
    path += `${pen}${x.toFixed(1)} ${(chart.height - local[p] / top * (chart.height - 8)).toFixed(1)}`;
    pen = "L";
  }
  $(`live-curve-${key}`).setAttribute("d", path || "M0 0");
  text($(`live-top-${key}`), (top * UM).toFixed(top * UM < 10 ? 1 : 0));
}

function update(announce = true) {
  const began = performance.now();
  const state = stateOf(values);
  const shown = {before: errors(live.before, state), after: errors(live.after, state)};
  const open = bandAt(state);
  for (const key of ["before", "after"]) for (const part of ["largest", "p99", "rms"]) {
    const cell = $(`live-${key}-${part}`);
    cell.dataset.um = shown[key][part] * UM;
    text(cell, micro(shown[key][part]));
  }
  curve(live.before, shown.before, "before");
  curve(live.after, shown.after, "after");
  colourPath(shown);
  const moved = sliders.filter((slider, n) => values[n] !== slider.value);
  const where = moved.length ? "in this state" : "as planned";
  const sentence = `Largest error ${where}: ${micro(shown.before.largest)} µm before, ` +
    `${micro(shown.after.largest)} µm after with the same file.`;
  text($("live-sentence"), sentence);
  if (announce) { clearTimeout(update.later); update.later = setTimeout(() => { text($("live-announcement"), sentence); writeLink(); }, 400); }
  $("live-band").dataset.um = open.whole * UM;
  text($("live-band"), rounded(open.whole));
  band.sources.forEach((_, n) => {
    const cell = $(`live-source-${n}`), row = cell.closest("tr");
    row.hidden = !(open.largest[n] * UM >= 0.005);
    cell.dataset.um = open.largest[n] * UM;
    text(cell, rounded(open.largest[n]));
  });
  const [words, all] = beyond(values, state, [shown.before, shown.after]);
  words.forEach((list, n) => { text($(`live-note-${n}`), [refused[n], ...list].filter(w => w).join("; ")); });
  text($("live-beyond"), all.length ? `Beyond what was measured: ${all.join("; ")}.` : "");
  $("live-beyond").hidden = !all.length;
  sliders.forEach((slider, n) => {
    const input = $(`live-${n}`), number = $(`live-number-${n}`);
    input.value = slider.stops.length ? slider.stops.indexOf(values[n]) : values[n];
    input.setAttribute("aria-valuetext", `${fixed(values[n])} ${slider.spoken}`.trim());
    if (number.tagName === "OUTPUT") text(number, fixed(values[n]));
    else if (document.activeElement !== number) number.value = fixed(values[n]);
    const when = $(`live-when-${n}`);
    if (when) text(when, slider.when[slider.stops.indexOf(values[n])]);
    input.closest(".live-row").classList.toggle("live-moved", values[n] !== slider.value);
  });
  const sets = overrides();
  text($("live-command-before"), `cgen predict ${live.command}${sets} --json`);
  text($("live-command-after"), `cgen check ${live.command} --written ${live.program}${sets} --json`);
  $("live-reset").disabled = !moved.length;
  root.getBoundingClientRect();  // what the browser has to lay out anew counts as well
  root.dataset.ms = performance.now() - began;
  text($("live-ms"), `${Math.max(1, Math.round(root.dataset.ms))} ms`);
}

// ---- the controls -------------------------------------------------------------------------------------------------------
function snapped(slider, value) {
  const step = Math.round((value - slider.low) / slider.step) * slider.step + slider.low;
  return Math.min(slider.high, Math.max(slider.low, +step.toFixed(9)));
}
let waiting = false;
function later() {
  if (waiting) return;
  waiting = true;
  requestAnimationFrame(() => { waiting = false; update(); });
}
sliders.forEach((slider, n) => {
  $(`live-${n}`).addEventListener("input", event => {
    const value = +event.target.value;
    values[n] = slider.stops.length ? slider.stops[value] : snapped(slider, value);
    refused[n] = "";
    later();
  });
  const number = $(`live-number-${n}`);
  if (number.tagName === "OUTPUT") return;
  number.addEventListener("change", event => {
    const typed = event.target.value.trim(), value = typed === "" ? NaN : +typed.replace(",", ".");
    const unit = slider.unit ? ` ${slider.unit}` : "";
    refused[n] = "";
    if (Number.isNaN(value)) {
      refused[n] = `${typed ? `"${typed.slice(0, 20)}" is not a number` : "no number was typed"}: it stays`;
    } else {
      values[n] = Math.min(slider.high, Math.max(slider.low, value));
      if (slider.kind === "repeat") values[n] = Math.round(values[n]);
      if (value < slider.low || value > slider.high) {
        refused[n] = `${typed.slice(0, 20)} is beyond this slider: ${fixed(slider.low)} to ${fixed(slider.high)}${unit}`;
      }
    }
    event.target.value = fixed(values[n]);
    later();
  });
});
$("live-reset").addEventListener("click", () => { values = [...plannedValues]; refused.fill(""); later(); });
for (const input of root.querySelectorAll("input[name=live-colour]")) input.addEventListener("change", event => {
  view.colour = event.target.value;
  drawPath();
  later();
});
for (const input of root.querySelectorAll("input[name=live-view]")) input.addEventListener("change", event => {
  view.axes = event.target.value.split("").map(Number);
  drawPath();
  later();
});
view.axes = root.querySelector("input[name=live-view]:checked").value.split("").map(Number);
drawPath();
values = linked();
for (let turn = 0; turn < 3; turn++) update(false);  // a browser compiles what it has seen before: quick from the first move
root.classList.add("live-ready");
})();
