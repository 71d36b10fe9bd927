// Files that were handed to the server from this page: it keeps them in memory under an id.

import * as api from "./api.js";

/** What was uploaded, by id: {id, name, kind, ...}. */
export const uploaded = new Map();

/** Lets the user choose a file and hands it over; null if nothing was chosen. */
export function chooseFile(kind) {
  return new Promise((resolve, reject) => {
    const input = Object.assign(document.createElement("input"), { type: "file" });
    input.addEventListener("cancel", () => resolve(null));
    input.addEventListener("change", async () => {
      try {
        const answer = await api.upload(input.files[0], kind);
        uploaded.set(answer.id, { ...answer, kind });
        resolve(answer);
      } catch (error) {
        reject(error);
      }
    });
    input.click();
  });
}

export const uploadsOf = (kind) => [...uploaded.values()].filter((each) => each.kind === kind);
