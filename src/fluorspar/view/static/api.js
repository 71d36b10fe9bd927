// What the server is asked. Addresses are relative: the token in front of them never appears in a script.

import { Shown } from "./shown.js";

/** The server refused; `message` is its own text. */
export class Refused extends Error {
  constructor(message, status) {
    super(message);
    this.status = status;
  }
}

/** Nobody answers. */
export class Gone extends Error {
  constructor() {
    super("The server does not answer. Was it stopped? Start 'fluorspar view' again and open the address it prints.");
  }
}

/** Tells "gone" and "back", as soon as an answer fails to come or comes again. */
export const contact = new EventTarget();
let lost = false;

function heard(answered) {
  if (lost === !answered) return;
  lost = !answered;
  contact.dispatchEvent(new Event(lost ? "gone" : "back"));
}

async function request(path, options = {}) {
  let response;
  try {
    response = await fetch(`api/${path}`, { cache: "no-store", ...options });
  } catch {
    heard(false);
    throw new Gone();
  }
  // whoever has the port now and does not know the token is another server
  const ours = response.status !== 404 || (path !== "about" && path !== "progress");
  heard(ours);
  if (!ours) throw new Gone();
  if (response.ok) return response;
  const text = await response.text();
  let said;
  try {
    said = JSON.parse(text).error;
  } catch {
    said = null; // not from the program itself
  }
  throw new Refused(said || `The server answered ${response.status} ${response.statusText}.`, response.status);
}

const post = (path, body) =>
  request(path, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) });
const answer = async (path, body) => (await post(path, body)).json();

export const about = async () => (await request("about")).json();
export const progress = async () => (await request("progress")).json();
export const components = (view) => answer("components", view);
export const spectrum = (view, region, reference = null) =>
  answer("spectrum", { ...view, region, ...(reference && { reference }) });
export const compare = (a, b) => answer("compare", { a, b });
export const curve = (source, id, light) => answer("curve", { source, id, light });
export const donaldson = (source, relight, surface, side) => answer("donaldson", { source, relight, surface, side });
export const command = (view) => answer("command", view);

/** The picture of a view, and what the server says of it. */
export async function picture(view) {
  const response = await post("picture", view);
  const facts = JSON.parse(response.headers.get("X-Fluorspar") || "{}");
  return { picture: new Shown(await createImageBitmap(await response.blob()), facts.size), facts };
}

/** The table of pins as text. */
export const csv = async (view, pins) => (await post("csv", { ...view, pins })).text();

/** A file that the server makes of the view, as a blob. */
export const save = async (view, format, name) => (await post("save", { ...view, format, name })).blob();

export const MOST_BYTES = 8 * 2 ** 20;

/** Hands a file to the server, which keeps it in memory. */
export async function upload(file, kind) {
  if (file.size > MOST_BYTES)
    throw new Refused(`${file.name} holds ${(file.size / 2 ** 20).toFixed(1)} MiB; a spectrum may hold at most 8 MiB.`, 413);
  const query = new URLSearchParams({ name: file.name, kind });
  return (await request(`upload?${query}`, { method: "POST", body: file })).json();
}
