import { HelpPages } from "../help/HelpPages";
import { goToSignIn } from "../net/api";
import { act } from "../store/outcomes";
import { allSent } from "../store/plan";
import { Button } from "../ui/Button";
import { Dialog } from "../ui/Dialog";
import { ErrorBox } from "../ui/Outcome";
import { productVersion } from "../store/state";
import { SHORTCUTS } from "./shortcuts";
import { openDialog } from "../store/view";

const STEPS = [
  "Give a surface model: drop a GeoTIFF anywhere, or use the demo.",
  "Add points: press A and click the surface, or drop a file of points.",
  "Choose the vehicle, then tune R and H until the verdict on the right says CERTIFIED.",
  "Fly: connect a vehicle or the simulator, upload, check, then hold Start for a second.",
  "Obstacles: an alert stays until it is over and acknowledged; the ways past it stand on the right of Fly.",
  "Hold and Return stay in the second line of the page, in every view.",
  "Review: open the recording that every flight leaves, or a log (.tlog, .bin, .ulg), and play it.",
];

const TERMS = [
  ["R, H", "The safe surface keeps this far away sideways (R) and this high above (H) from everything."],
  ["Clearance", "Smallest distance in space between the line that will be flown and the surface model."],
  ["Above home, above DSM", "Height over the take-off place, and over the surface model straight below."],
  ["Cross-track", "How far beside the planned line; height error: how far above or below it."],
  ["Region, corridor", "What is searched: a sector ahead of the nose, and the mission's own next seconds."],
  ["Known ground", "Seen, and already in the surface model: drawn grey, never an alert."],
  ["Velocities", "Cones hold the velocities that lead into a moving object: red where the present one does."],
  ["Sidestep", "The nearest velocity that leads into nothing, flown level, then back to the mission."],
  ["Traversable", "Level and smooth enough to drive on. Foliage that a radar saw through: never to land on."],
  ["m above home", "Heights count from the surface model at the home point."],
];

function Keys({ keys }: { keys: string }) {
  const parts = keys.split(" ");
  return (
    <>
      {parts.map((part) =>
        ["or", "to", "then"].includes(part) ? <i> {part} </i> : <kbd key={part}>{part}</kbd>,
      )}
    </>
  );
}

/** Not before the last edit has reached the server. */
async function signOut(): Promise<void> {
  await allSent();
  if (await act("DELETE", "/api/session", "session")) goToSignIn("signed_out");
}

export function HelpSheet() {
  return (
    <Dialog title="Help" testid="help-sheet" onClose={() => (openDialog.value = null)}>
      <HelpPages />
      <div class="help">
        <section>
          <h3>From terrain to flight</h3>
          <ol>
            {STEPS.map((step) => (
              <li key={step}>{step}</li>
            ))}
          </ol>
          <h3>Words</h3>
          <dl>
            {TERMS.map(([term, text]) => (
              <div key={term}>
                <dt>{term}</dt>
                <dd>{text}</dd>
              </div>
            ))}
          </dl>
          <h3>3D view</h3>
          <p>
            Drag turns, right-drag moves, the wheel zooms. A click on a point selects it; its blue square
            drags it.
          </p>
          <ErrorBox place="session" />
        </section>
        <section>
          <h3>Keys, of the view that is shown</h3>
          <table>
            <tbody>
              {SHORTCUTS.map((shortcut) => (
                <tr key={shortcut.id}>
                  <th scope="row">
                    <Keys keys={shortcut.keys} />
                  </th>
                  <td>{shortcut.text}</td>
                </tr>
              ))}
              <tr>
                <th scope="row">
                  <Keys keys="Alt ↑ or Alt ↓" />
                </th>
                <td>Move the focused point up or down the list</td>
              </tr>
            </tbody>
          </table>
          <div class="row end">
            <span class="muted">Hedgehop {productVersion.value}</span>
            <Button
              testid="sign-out"
              title="Ends the session of this browser, on all its pages"
              onClick={signOut}
            >
              Sign out
            </Button>
          </div>
        </section>
      </div>
    </Dialog>
  );
}
