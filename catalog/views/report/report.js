// What a report does when it is looked at: plays takes, draws charts. It stands in one module with player.js.

const MOST_PLAYERS = 6; // each holds its takes in memory; the one opened first closes for a seventh
const NARROW = 600; // pixels: in a narrower chart a legend at the side would leave no room for the chart
const players = [];

// ---- takes

document.addEventListener("click", ({ target }) => {
  const button = target.closest("button[data-figures]");
  if (button) play(document.getElementById(button.dataset.stage), button.dataset.figures.split(" "), button);
});

function play(stage, names, button) {
  close(stage);
  const figures = names.map((name) => JSON.parse(document.getElementById(name).textContent));
  const host = document.createElement("div");
  stage.append(closing(stage, button), host);
  stage.player = createPlayer(host, { figures }, { autoplay: true });
  button?.setAttribute("aria-expanded", "true");
  stage.button = button;
  players.push(stage);
  if (players.length > MOST_PLAYERS) close(players[0]);
  const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
  stage.scrollIntoView({ block: "nearest", behavior: calm ? "auto" : "smooth" });
}

function close(stage) {
  if (!stage.player) return;
  stage.player.destroy();
  stage.player = null;
  stage.button?.removeAttribute("aria-expanded");
  stage.replaceChildren();
  players.splice(players.indexOf(stage), 1);
}

function closing(stage, button) {
  const made = document.createElement("button");
  made.type = "button";
  made.className = "close";
  made.textContent = "Close";
  made.addEventListener("click", () => {
    close(stage);
    button?.focus();
  });
  return made;
}

// ---- charts, one after another, each when it is about to be seen

const seen = new IntersectionObserver(
  (entries) => {
    for (const { isIntersecting, target } of entries) {
      if (!isIntersecting) continue;
      seen.unobserve(target);
      drawing = drawing.then(() => draw(target));
    }
  },
  { rootMargin: "300px" },
);
let drawing = Promise.resolve();
for (const chart of document.querySelectorAll("[data-packed]")) seen.observe(chart);

async function draw(chart) {
  try {
    if (!window.Plotly) await runPlotly();
    const { figure, config } = JSON.parse(await unpacked(chart.dataset.packed));
    if (chart.clientWidth < NARROW) legendBelow(figure.layout);
    await Plotly.newPlot(chart, figure.data, figure.layout, config);
    chart.style.minHeight = "";
    if (chart.id === "map-chart") chart.on("plotly_click", ({ points }) => playPoint(points[0]));
  } catch (error) {
    chart.style.minHeight = "";
    chart.textContent = `This chart cannot be drawn: ${error.message}`;
  }
}

function legendBelow(layout) {
  layout.legend = { ...layout.legend, orientation: "h", x: 0, y: -0.15, xanchor: "left", yanchor: "top" };
  layout.height = (layout.height ?? 440) + 160;
}

async function runPlotly() {
  const script = document.createElement("script");
  script.textContent = await unpacked("plotly");
  document.head.append(script);
}

async function unpacked(name) {
  const bytes = Uint8Array.from(atob(document.getElementById(name).textContent), (one) => one.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
}

function playPoint({ customdata }) {
  const clip = [customdata].flat()[0];
  const name = JSON.parse(document.getElementById("figures").textContent)[clip];
  const said = document.getElementById("map-said");
  said.textContent = name ? "" : `The page does not hold ${clip}; motionary browse CATALOG plays every clip.`;
  if (name) play(document.getElementById("map-stage"), [name]);
}

// ---- what a style sheet cannot do

// A table that is wider than the page is scrolled by keys as well.
const sized = new ResizeObserver((entries) => {
  for (const { target } of entries) {
    if (target.scrollWidth > target.clientWidth) target.tabIndex = 0;
    else target.removeAttribute("tabindex");
  }
});
for (const wide of document.querySelectorAll(".wide")) sized.observe(wide);

document.documentElement.dataset.ready = "yes";
