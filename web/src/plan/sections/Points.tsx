import { count, latLon, number } from "../../format";
import type { PlanDoc } from "../../messages";
import { Button, Segmented } from "../../ui/Button";
import { Section } from "../../ui/Section";
import { TextField } from "../../ui/fields";
import { chooseFiles } from "../../ui/choose_files";
import { drawer } from "../../store/view";
import { sendPoints } from "../../store/files";
import { parsePlace } from "../../store/poi";
import { edit } from "../../store/plan";
import { setError } from "../../store/state";
import { setSelection } from "../../store/stream";
import { shortestOrder } from "../../store/plans";
import { ClickTools, type ClickTool } from "./ClickTools";
import { PoiList } from "./PoiList";
import { SurveyFields } from "./Survey";

type Tool = "select" | "add_poi" | "polygon" | "home";

const TOOLS: Record<Tool, Omit<ClickTool<Tool>, "tool">> = {
  select: { icon: "select", label: "Select", title: "Select and drag points (Esc)" },
  add_poi: { icon: "pin", label: "Add", title: "Add points on click (A)" },
  polygon: { icon: "polygon", label: "Corners", title: "Add corners of the survey polygon on click" },
  home: { icon: "home", label: "Home", title: "Put home, where the vehicle takes off, on click" },
};

/** On narrow screens the drawer would cover what is to be clicked. */
function take(tool: Tool): void {
  setSelection({ tool, draft: [] });
  if (tool !== "select") drawer.value = null;
}

function Tools({ plan }: { plan: PlanDoc }) {
  const tools: Tool[] = ["select", plan.source === "survey" ? "polygon" : "add_poi", "home"];
  return (
    <ClickTools
      label="Tool for clicks on the surface"
      tools={tools.map((tool) => ({ tool, ...TOOLS[tool] }))}
      hasTerrain={Boolean(plan.terrain_id)}
      onTake={take}
    />
  );
}

function Home({ plan }: { plan: PlanDoc }) {
  const set = (text: string) => {
    const place = text === "" ? null : parsePlace(text);
    if (text !== "" && !place) {
      const what = `"${text}" is no latitude and longitude.`;
      setError("points", {
        code: "place",
        what,
        where: "Home",
        advice: "Write it like 46.1234567, 7.1234567.",
      });
      return;
    }
    edit(place ? "Move home" : "Home near the first point", "points", (doc) => ({ ...doc, home: place }));
  };
  return (
    <TextField
      label="Home"
      placeholder="chosen near the first point"
      testid="home-input"
      value={plan.home ? latLon(plan.home) : ""}
      onChange={set}
    />
  );
}

function summaryOf(plan: PlanDoc): string {
  if (plan.source === "survey") return `survey, ${count(plan.survey.polygon.length, "corner")}`;
  return plan.pois.length === 0 ? "none yet" : number(plan.pois.length);
}

export function PointsSection({ plan }: { plan: PlanDoc }) {
  const isSurvey = plan.source === "survey";
  const importFiles = () =>
    chooseFiles(".csv,.geojson,.json,.kml,.waypoints,.plan,.txt", (files) =>
      files.forEach((file) => void sendPoints(file)),
    );
  const setSource = (source: PlanDoc["source"]) => {
    edit(source === "survey" ? "Switch to survey" : "Switch to points", "points", (doc) => ({
      ...doc,
      source,
    }));
    setSelection({ tool: "select" });
  };
  return (
    <Section id="points" title="Points" icon="pin" summary={summaryOf(plan)} startsOpen>
      <Segmented
        label="What is flown"
        testid="source"
        value={plan.source}
        options={[
          { value: "pois", label: "Points of interest" },
          { value: "survey", label: "Survey" },
        ]}
        onChange={setSource}
      />
      <Tools plan={plan} />
      {isSurvey ? <SurveyFields plan={plan} /> : <PoiList plan={plan} />}
      <Home plan={plan} />
      <div class="row">
        <Button icon="import" testid="points-import" disabled={!plan.terrain_id} onClick={importFiles}>
          Import…
        </Button>
        {!isSurvey && (
          <Button
            icon="route"
            testid="shortest-order"
            title="Order the points so that the way is short; home stays first"
            disabled={plan.pois.length < 4}
            onClick={() => void shortestOrder()}
          >
            Shortest order
          </Button>
        )}
      </div>
    </Section>
  );
}
