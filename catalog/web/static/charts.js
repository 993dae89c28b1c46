// Charts: fetched and drawn when they come into view, so that Plotly is loaded only where one is looked at.
import { dataOf, playClip } from "./playing.js";

const NARROW = 600;
let plotly;

/** Draw every chart of the page once it is seen, and again when what it is of is changed. */
export function drawCharts() {
  const seen = new IntersectionObserver(
    (entries) => {
      for (const { isIntersecting, target } of entries) {
        if (!isIntersecting) continue;
        seen.unobserve(target);
        draw(target);
      }
    },
    { rootMargin: "300px" },
  );
  for (const chart of document.querySelectorAll("[data-chart]")) seen.observe(chart);
  for (const select of document.querySelectorAll("select[data-sets]")) {
    select.addEventListener("change", () => {
      const chart = document.querySelector(`[data-chart*="name=${select.dataset.chartName}&"]`);
      const url = new URL(chart.dataset.chart, location.href);
      url.searchParams.set(select.dataset.sets, select.value);
      chart.dataset.chart = url.pathname + url.search;
      draw(chart);
    });
  }
}

async function draw(chart) {
  const asked = chart.dataset.chart;
  try {
    const { pathname, searchParams } = new URL(asked, location.href);
    const [made, Plotly] = await Promise.all([dataOf(pathname, Object.fromEntries(searchParams)), loaded()]);
    if (asked !== chart.dataset.chart) return; // another has been chosen meanwhile
    const drawing = chart.querySelector(".drawing") ?? document.createElement("div");
    drawing.className = "drawing";
    drawing.style.minHeight = chart.style.minHeight;
    chart.replaceChildren(drawing);
    await Plotly.react(drawing, made.data, fitted(made, chart.clientWidth), made.config);
    if (!drawing.dataset.listens) drawing.on("plotly_click", ({ points }) => play(points[0].customdata));
    drawing.dataset.listens = "yes";
    chart.dataset.drawn = "yes";
  } catch (error) {
    chart.classList.add("failed");
    chart.textContent = `This chart cannot be drawn: ${error.message}`;
  }
  for (const told of document.querySelectorAll("[data-while-drawn]")) told.remove();
}

// On a narrow page a legend at the side would leave no room for what it explains: it goes below, under a title in
// smaller letters.
function fitted({ data, layout }, width) {
  const shown = data.filter((one) => one.showlegend !== false).length;
  if (width >= NARROW || layout.legend?.orientation === "h" || layout.showlegend === false || shown < 2) return layout;
  const legend = { ...layout.legend, orientation: "h", x: 0, xanchor: "left", y: -0.1, yanchor: "top" };
  const title = { ...layout.xaxis?.title, font: { size: 10 } };
  return { ...layout, legend, xaxis: { ...layout.xaxis, title }, height: (layout.height ?? 450) + 10 * shown };
}

// Where a point is a clip, its clip_id is the point's own datum, or the first of several.
function play(datum) {
  const clip = Array.isArray(datum) ? datum[0] : datum;
  if (typeof clip === "string") playClip(clip);
}

function loaded() {
  plotly ??= new Promise((resolve, reject) => {
    const script = document.createElement("script");
    script.src = document.body.dataset.plotly;
    script.onload = () => resolve(window.Plotly);
    script.onerror = () => reject(new Error("Plotly could not be loaded"));
    document.head.append(script);
  });
  return plotly;
}
