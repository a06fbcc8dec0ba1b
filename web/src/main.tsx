import { render } from "preact";
import "uplot/dist/uPlot.min.css";
import "./styles/tokens.css";
import "./styles/base.css";
import "./styles/controls.css";
import "./styles/layout.css";
import "./styles/status.css";
import "./styles/plan.css";
import "./styles/truth.css";
import "./styles/scene.css";
import "./styles/chart.css";
import "./styles/overlays.css";
import { App } from "./shell/App";
import { connect } from "./store/stream";

const root = document.getElementById("app");
if (root) render(<App />, root);
connect();
