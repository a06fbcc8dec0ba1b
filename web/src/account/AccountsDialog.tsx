import { useEffect, useState } from "preact/hooks";
import { day } from "../format";
import type { AccountDoc, SessionDoc } from "../messages";
import { me, notInCharge } from "../store/flying";
import { openDialog } from "../store/view";
import { Button } from "../ui/Button";
import { Dialog } from "../ui/Dialog";
import { SelectField } from "../ui/fields";
import { Outcome } from "../ui/Outcome";
import {
  accounts,
  addAccount,
  changePassword,
  endOthers,
  endSession,
  invitation,
  invite,
  PLACE,
  refresh,
  removeAccount,
  sessions,
} from "./accounts";

/** Others come in and go while it is open. */
const EVERY_MS = 3000;

const when = (utc_s: number) => day(new Date(1000 * utc_s).toISOString());

function SessionRow({ session }: { session: SessionDoc }) {
  return (
    <tr data-testid="session-row">
      <th scope="row">
        {session.name} {session.in_charge && <span class="tag">in charge</span>}
      </th>
      <td>{session.role}</td>
      <td>since {when(session.since_utc_s)}</td>
      <td>seen {when(session.seen_utc_s)}</td>
      <td>{session.address}</td>
      <td class="actions">
        <Button disabled={session.mine} onClick={() => void endSession(session.id)}>
          {session.mine ? "This one" : "Sign out"}
        </Button>
      </td>
    </tr>
  );
}

function wayIn({ name, has_password, invited_until_utc_s }: AccountDoc): string {
  if (has_password) return "password";
  if (invited_until_utc_s) return "invited";
  const isIn = sessions.value.some((session) => session.name === name);
  return isIn ? "signed in, without a password" : "no way in: make a link";
}

function AccountRow({ account }: { account: AccountDoc }) {
  return (
    <tr data-testid="account-row">
      <th scope="row">{account.name}</th>
      <td>{account.role}</td>
      <td>{wayIn(account)}</td>
      <td class="actions">
        <Button onClick={() => void invite(account.name)}>Link</Button>
        <Button
          kind="quiet"
          icon="trash"
          title={`Remove ${account.name}: signed out at once`}
          onClick={() => void removeAccount(account.name)}
        />
      </td>
    </tr>
  );
}

function NewAccount() {
  const [name, setName] = useState("");
  const [role, setRole] = useState<AccountDoc["role"]>("observer");
  const add = async () => {
    if (await addAccount(name, role)) setName("");
  };
  return (
    <div class="row wrap new-account">
      <input
        aria-label="Name"
        placeholder="Name"
        maxLength={40}
        value={name}
        data-testid="account-name"
        onInput={(event) => setName(event.currentTarget.value)}
      />
      <SelectField
        label="Role"
        value={role}
        testid="account-role"
        options={[
          { value: "observer", label: "observer" },
          { value: "operator", label: "operator" },
        ]}
        onChange={setRole}
      />
      <Button icon="plus" disabled={name.trim() === ""} testid="account-add" onClick={() => void add()}>
        Invite
      </Button>
    </div>
  );
}

function Invitation() {
  const made = invitation.value;
  if (!made) return null;
  return (
    <p class="invitation" data-testid="invitation">
      This link signs {made.name} in once, until {when(made.expires_utc_s)}:
      <br />
      <code>{made.link}</code>
    </p>
  );
}

function OwnPassword() {
  const [password, setPassword] = useState("");
  return (
    <div class="row wrap new-account">
      <input
        type="password"
        aria-label="New password"
        placeholder="New password, 8 characters or more"
        autocomplete="new-password"
        maxLength={1024}
        value={password}
        data-testid="own-password"
        onInput={(event) => setPassword(event.currentTarget.value)}
      />
      <Button
        disabled={password.length < 8}
        testid="own-password-set"
        onClick={() => void changePassword(password)}
      >
        Change my password
      </Button>
    </div>
  );
}

function ForOperators() {
  return (
    <>
      <h3>Accounts</h3>
      <table class="people">
        <tbody>
          {accounts.value.map((account) => (
            <AccountRow key={account.name} account={account} />
          ))}
        </tbody>
      </table>
      <NewAccount />
      <Invitation />
      <h3>Sessions</h3>
      <table class="people">
        <tbody>
          {sessions.value.map((session) => (
            <SessionRow key={session.id} session={session} />
          ))}
        </tbody>
      </table>
      <Button testid="end-others" onClick={() => void endOthers()}>
        Sign out everywhere else
      </Button>
    </>
  );
}

function close(): void {
  openDialog.value = null;
  invitation.value = null;
}

/** Who may sign in, and who is in: for operators; whoever has an account can change their own password. */
export function AccountsDialog() {
  useEffect(() => {
    void refresh();
    const timer = setInterval(() => void refresh(), EVERY_MS);
    return () => clearInterval(timer);
  }, []);
  const operates = me.value?.role === "operator";
  return (
    <Dialog title="Accounts and sessions" testid="accounts-dialog" onClose={close}>
      <Outcome place={PLACE} />
      <p>
        Signed in as {me.value?.name ?? "…"}. {operates ? "You may operate." : `${notInCharge.value}.`}
      </p>
      {me.value && !me.value.owner && <OwnPassword />}
      {operates && <ForOperators />}
      <h3>Commands</h3>
      <Button icon="shield" testid="audit-open" onClick={() => (openDialog.value = "audit")}>
        Audit log of all commands
      </Button>
    </Dialog>
  );
}
