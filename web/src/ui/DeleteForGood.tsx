import { Button } from "./Button";

/** Asked before anything is deleted that cannot be had back. */
export function DeleteForGood(props: { testid: string; onDelete: () => void; onKeep: () => void }) {
  return (
    <span class="row confirm">
      <Button kind="danger" testid={props.testid} onClick={props.onDelete}>
        Delete for good
      </Button>
      <Button kind="quiet" onClick={props.onKeep}>
        Keep
      </Button>
    </span>
  );
}
