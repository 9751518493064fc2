// Draws the figures of a page, and draws them anew where the page becomes dark, narrow or printed.
// A figure is data and layout for plotly; layout.meta.narrow is what a narrow page changes of the layout, layout.meta.phone
// what a phone changes of each trace, and layout.meta.extent how far the box of each scene reaches from its middle as its
// camera looks at it: [right, up].
const cgenFigures = (() => {
  const PRINTED = 680; // width on paper [px]: A4 and Letter within their margins
  const NARROW = 640; // a width below which the narrow layout is taken [px]
  const PHONE = 480; // and one below which its traces are a phone's [px]
  const LABELS = 48; // at both sides of the box of a scene, and below it [px]
  const ABOVE = 8; // the box, where no words are [px]
  const PRINTED_HEIGHT = 0.75; // of the height on a screen
  const NEAR = "400px"; // from the screen, where a figure in space is drawn
  const PRINTED_INK = "#1e293b";
  const CONFIG = { displaylogo: false, modeBarButtonsToRemove: ["select2d", "lasso2d", "sendChartToCloud"], plotlyServerURL: "" };
  const specifications = new Map();
  let printing = false;

  const isObject = (value) => value !== null && typeof value === "object" && !Array.isArray(value);

  function merged(base, change) {
    const result = { ...base };
    for (const [key, value] of Object.entries(change ?? {}))
      result[key] = isObject(value) && isObject(base[key]) ? merged(base[key], value) : value;
    return result;
  }

  // Lines and grids in the colours that the page's style names.
  function inColours(value) {
    const style = getComputedStyle(document.documentElement);
    const text = JSON.stringify(value).replace(/"#[0-9a-fA-F]{6}"/g, (colour) => {
      const variable = cgenColours[colour.slice(1, -1).toLowerCase()];
      return (variable && JSON.stringify(style.getPropertyValue(variable).trim() || undefined)) || colour;
    });
    return JSON.parse(text);
  }

  // Each scene as large as its part of the figure allows, all axes on one scale.
  function fitScenes(layout) {
    for (const [name, extent] of Object.entries(layout.meta?.extent ?? {})) {
      const scene = layout[name];
      const share = (k) => scene.domain?.[k] ?? [0, 1];
      const width = (layout.width - layout.margin.l - layout.margin.r) * (share("x")[1] - share("x")[0]);
      const height = (layout.height - layout.margin.t - layout.margin.b) * (share("y")[1] - share("y")[0]);
      const size = Math.min((1 - (LABELS + ABOVE) / height) / extent[1], (width - 2 * LABELS) / height / extent[0]);
      const { eye } = scene.camera;
      const [x, y, z] = layout.meta.up.map((v) => (-v * (LABELS - ABOVE)) / height); // by which all is moved up
      const camera = { ...scene.camera, eye: { x: eye.x + x, y: eye.y + y, z: eye.z + z }, center: { x, y, z } };
      const longest = Math.max(...Object.values(scene.aspectratio));
      const ratio = Object.fromEntries(Object.entries(scene.aspectratio).map(([k, v]) => [k, (v / longest) * size]));
      layout[name] = { ...scene, aspectratio: ratio, camera };
    }
  }

  function adapted(specification, width, ink) {
    const { data, layout } = printing ? specification : inColours(specification);
    const narrow = width < NARROW ? layout.meta?.narrow : {};
    const modebar = { bgcolor: "rgba(0,0,0,0)", orientation: layout.meta?.extent ? "v" : "h" }; // beside scales of colour
    const look = { width, autosize: false, uirevision: "kept", font: { color: ink }, modebar };
    const result = merged(merged(layout, narrow), look);
    if (printing) result.height = Math.round(result.height * PRINTED_HEIGHT);
    fitScenes(result);
    const changes = (width < PHONE && layout.meta?.phone) || [];
    return { data: data.map((trace, k) => merged(trace, changes[k])), layout: result };
  }

  function redraw(key) {
    const place = document.getElementById(key);
    const width = printing ? PRINTED : Math.floor(place.parentElement.clientWidth);
    const ink = printing ? PRINTED_INK : getComputedStyle(place).color;
    const state = `${width} ${ink}`;
    if (!width || place.dataset.state === state) return;
    place.dataset.state = state;
    const { data, layout } = adapted(specifications.get(key), width, ink);
    Plotly.react(place, data, layout, { ...CONFIG, displayModeBar: width < NARROW ? false : "hover" });
    const { classList } = place.parentElement;
    classList.add("drawn");
    place.removeAllListeners("plotly_webglcontextlost");
    place.on("plotly_webglcontextlost", () => classList.remove("drawn"));
  }

  const redrawAll = () => specifications.forEach((_, key) => redraw(key));

  const hasWebGL = () => {
    const canvas = document.createElement("canvas");
    return Boolean(canvas.getContext("webgl2") || canvas.getContext("webgl"));
  };

  function whenNear(element, start) {
    const observer = new IntersectionObserver((seen) => {
      if (!seen.some((entry) => entry.isIntersecting)) return;
      observer.disconnect();
      start();
    }, { rootMargin: NEAR });
    observer.observe(element);
  }

  function print(on) {
    printing = on;
    redrawAll();
  }

  window.addEventListener("beforeprint", () => print(true));
  window.addEventListener("afterprint", () => print(false));
  window.addEventListener("load", redrawAll); // of a page that had no width before
  window.addEventListener("resize", redrawAll);
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redrawAll);

  return {
    // Draw a figure into the element with its key, now and whenever the page changes: one in space, which a machine
    // without graphics draws for seconds, when it is about to be seen; until then its still picture stands there.
    draw(key, data, layout) {
      const start = () => {
        specifications.set(key, { data, layout });
        redraw(key);
      };
      if (!data.some((trace) => trace.type.endsWith("3d"))) start();
      else if (hasWebGL()) whenNear(document.getElementById(key).parentElement, start); // else the still picture stays
    },
    redrawAll,
  };
})();
