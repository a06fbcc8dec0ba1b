import { latLon, metres } from "../format";
import { LIMITS, type LandingSiteDoc, type PlanDoc } from "../messages";
import { CopyPlace } from "../ui/CopyPlace";
import { drawer } from "../store/view";
import { pending } from "../store/outcomes";
import { selection } from "../store/state";
import { setSelection } from "../store/stream";
import { traversability } from "../store/traversability";
import { Button } from "../ui/Button";
import { Icon } from "../ui/Icon";
import { NumberField } from "../ui/NumberField";
import { Outcome } from "../ui/Outcome";
import { LANDING, aim, findSites, pointOut, rotorSpan_m, searched_m, span_m } from "./ground_orders";
import { places } from "./places";
import { reasonsOf, siteMark, siteTitle } from "./ground_words";

function takeAim(): void {
  if (selection.value.tool === "landing") {
    setSelection({ tool: "select" });
    return;
  }
  aim();
  // On narrow screens the drawer would cover what is to be clicked.
  drawer.value = null;
}

function Near({ plan }: { plan: PlanDoc }) {
  const isBusy = pending.value.has(LANDING);
  const isAiming = selection.value.tool === "landing";
  return (
    <div class="sites-near" role="group" aria-label="Near">
      <Button
        icon="target"
        pressed={isAiming}
        disabled={isBusy}
        title="Then click the surface"
        testid="sites-click"
        onClick={takeAim}
      >
        {isAiming ? "Click the surface…" : "Click a place"}
      </Button>
      {places(plan).map(({ id, label, place, why }) => (
        <Button
          key={id}
          disabled={isBusy || place === null}
          title={place ? `Landing sites near: ${label}` : why}
          testid={`sites-${id}`}
          onClick={() => place && void findSites(place)}
        >
          <span class="sites-near-label">{label}</span>
        </Button>
      ))}
    </div>
  );
}

function Site({ site }: { site: LandingSiteDoc }) {
  const isChosen = selection.value.site_rank === site.rank;
  return (
    <li class={`site ${isChosen ? "chosen" : ""}`} data-testid="site-row" data-rank={site.rank}>
      <button
        type="button"
        class="badge site-badge"
        aria-pressed={isChosen}
        aria-label={siteTitle(site)}
        title={isChosen ? "Pointed out in 3D" : "Point it out in 3D"}
        data-testid={`site-${site.rank}`}
        onClick={() => pointOut(isChosen ? null : site.rank)}
      >
        {siteMark(site)}
      </button>
      <div class="site-facts">
        <p class="site-head">
          <strong>{metres(site.distance_m, 0)}</strong> away
          <span class="muted">{metres(site.alt_dsm_m)} DSM</span>
        </p>
        <ul class="site-reasons">
          {reasonsOf(site).map((reason) => (
            <li key={reason}>{reason}</li>
          ))}
        </ul>
        <p class="row place">
          <span class="muted number">{latLon(site)}</span>
          <CopyPlace place={site} name={siteTitle(site)} />
        </p>
      </div>
    </li>
  );
}

function Answer() {
  const { sites, sites_near, no_site } = traversability.value;
  if (pending.value.has(LANDING))
    return (
      <p class="working" role="status">
        <span class="spinner" aria-hidden="true" /> Looking for landing sites…
      </p>
    );
  if (sites_near === null)
    return <p class="hint">Level, smooth and two rotor spans from any obstacle: the best five.</p>;
  const [lat_deg, lon_deg] = sites_near;
  return (
    <>
      <p class="hint" data-testid="sites-near">
        Near <span class="number">{latLon({ lat_deg, lon_deg })}</span>
      </p>
      {sites.length === 0 ? (
        <p class="callout" data-testid="no-site">
          <Icon name="info" /> <span>{no_site || "No landing site was found."}</span>
        </p>
      ) : (
        <ol class="sites" aria-label="Landing sites, best first">
          {sites.map((site) => (
            <Site key={site.rank} site={site} />
          ))}
        </ol>
      )}
    </>
  );
}

/** The best places to land near a point, from the map before clearing: a rotor must not touch leaves. */
export function LandingSites({ plan }: { plan: PlanDoc }) {
  return (
    <div class="landing" data-testid="landing">
      <h3>Landing sites near</h3>
      <Near plan={plan} />
      <div class="field-grid">
        <NumberField
          label="Rotor span"
          unit="m"
          {...LIMITS.LandingSitesBody.rotor_span_m}
          step={0.1}
          value={span_m()}
          testid="rotor-span"
          onChange={(value) => (rotorSpan_m.value = value)}
        />
        <NumberField
          label="Search within"
          unit="m"
          {...LIMITS.LandingSitesBody.radius_m}
          step={10}
          value={searched_m.value}
          testid="search-radius"
          onChange={(value) => (searched_m.value = value)}
        />
      </div>
      <Answer />
      <Outcome place={LANDING} />
    </div>
  );
}
