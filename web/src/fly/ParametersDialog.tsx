import { useEffect, useState } from "preact/hooks";
import { clock } from "../format";
import { active, fleet } from "../store/fleet";
import { adopted } from "../store/flying";
import {
  comparingWith,
  compareWith,
  compareWithVehicle,
  describeBy,
  isReading,
  lookAtParameters,
  PARAMETERS,
  parameters,
  readParameters,
  written,
} from "../store/parameters";
import { openDialog } from "../store/view";
import { Button, Segmented } from "../ui/Button";
import { Changes } from "../ui/Changes";
import { chooseFiles } from "../ui/choose_files";
import { Dialog } from "../ui/Dialog";
import { Icon } from "../ui/Icon";
import { Outcome } from "../ui/Outcome";
import { LowFlight } from "./LowFlight";
import { ParameterList } from "./ParameterList";
import { WrittenList } from "./WrittenList";

const fileOf = (ending: "param" | "params") =>
  `/api/parameters/file/vehicle.${ending}?vehicle=${active.value}`;

const choose = (endings: string, take: (file: File) => Promise<void>) =>
  chooseFiles(endings, (files) => files.slice(0, 1).forEach((file) => void take(file)));

/** The station's other vehicles, where it has some. */
function Others() {
  const others = fleet.value.filter(({ number }) => number !== active.value);
  return others.map(({ number, name, link }) => (
    <Button
      key={number}
      testid={`parameters-compare-${number}`}
      disabled={comparingWith.value !== null || link !== "live"}
      title={link === "live" ? "Reads its list anew, and writes nothing" : `${name} is not connected.`}
      onClick={() => void compareWithVehicle(number)}
    >
      {comparingWith.value === number ? `Reading ${name}…` : `Compare with ${name}`}
    </Button>
  ));
}

function Files() {
  return (
    <div class="row wrap">
      <a class="button" href={fileOf("param")} download data-testid="parameters-save">
        <Icon name="export" /> Save .param
      </a>
      <a class="button" href={fileOf("params")} download>
        <Icon name="export" /> Save .params
      </a>
      <Changes>
        <Button
          icon="import"
          testid="parameters-compare"
          onClick={() => choose(".param,.parm,.params,.txt", compareWith)}
        >
          Compare with a file…
        </Button>
        <Others />
        <Button
          icon="help"
          testid="parameters-describe"
          title="The makers' units, ranges and help: apm.pdef.xml, parameters.json or parameters.json.xz"
          onClick={() => choose(".xml,.json,.xz", describeBy)}
        >
          Units and help…
        </Button>
      </Changes>
    </div>
  );
}

/** The vehicle's settings: what they will do on a low flight, and all of them. */
export function ParametersDialog() {
  const [part, setPart] = useState<"low" | "all">("low");
  // Anew once the vehicle is known again after a break of the line.
  useEffect(() => void (adopted.value && lookAtParameters()), [adopted.value?.id]);
  const doc = adopted.value ? parameters.value : null;
  return (
    <Dialog title="Parameters" testid="parameters-dialog" onClose={() => (openDialog.value = null)}>
      <Outcome place={PARAMETERS} />
      <div class="row wrap">
        <span>{doc ? `Of ${doc.vehicle}, read ${clock(doc.read_utc_s)}` : "Not read yet."}</span>
        <Changes>
          <Button
            testid="parameters-read"
            disabled={isReading.value || !adopted.value}
            onClick={() => void readParameters()}
          >
            {isReading.value ? "Reading… up to a minute over a slow radio" : doc ? "Read again" : "Read"}
          </Button>
        </Changes>
      </div>
      {doc && (
        <>
          <WrittenList written={written.value.slice(0, 5)} testid="parameters-written" />
          <Segmented
            label="Which parameters"
            testid="parameters-part"
            value={part}
            options={[
              { value: "low", label: "Before a low flight" },
              { value: "all", label: `All ${doc.parameters.length}` },
            ]}
            onChange={setPart}
          />
          {part === "all" && <Files />}
          {part === "low" ? <LowFlight doc={doc} /> : <ParameterList doc={doc} />}
        </>
      )}
    </Dialog>
  );
}
