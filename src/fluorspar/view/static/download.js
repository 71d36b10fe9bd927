// Files out of the page, and text onto the clipboard.

import { h } from "./element.js";

export function download(blob, name) {
  const address = URL.createObjectURL(blob);
  h("a", { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 60_000); // not before the browser has read it
}

/** Whether it went onto the clipboard: an embedded page may not be allowed to. */
export async function copyText(text) {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    return false;
  }
}
