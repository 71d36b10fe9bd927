// Filling a <select>: options, in groups where there are several kinds.

import { h } from "./element.js";

const filled = new WeakMap();

/** `entries`: [value, text] or {group, entries}; values are written as JSON, so that they may be anything. */
export function fillSelect(select, entries, chosen) {
  // an open menu would close if it were filled again
  const key = JSON.stringify(entries);
  if (filled.get(select) === key) {
    select.value = JSON.stringify(chosen);
    return;
  }
  filled.set(select, key);
  const option = ([value, text]) => h("option", { value: JSON.stringify(value) }, text);
  select.replaceChildren(
    ...entries
      .filter((entry) => Array.isArray(entry) || entry.entries.length)
      .map((entry) => (Array.isArray(entry) ? option(entry) : h("optgroup", { label: entry.group }, entry.entries.map(option)))),
  );
  select.value = JSON.stringify(chosen);
}

export const chosenIn = (select) => JSON.parse(select.value);
