// What an expert has begun for a pick: kept while they look back, and over a reload.

const PLACE = "torc-draft";
const EMPTY = { selected: null, note: "", isTarget: false };

export function keepDraft(key, pick, { selected, note, isTarget }) {
  // A browser that keeps nothing loses no more than that.
  try { sessionStorage.setItem(PLACE, JSON.stringify({ at: [key, pick], selected, note, isTarget })); } catch { /* as said */ }
}

export function draftOf(key, pick) {
  try {
    const { at, ...draft } = JSON.parse(sessionStorage.getItem(PLACE));
    return at[0] === key && at[1] === pick ? draft : EMPTY;
  } catch { return EMPTY; }
}

export function forgetDraft() {
  try { sessionStorage.removeItem(PLACE); } catch { /* nothing was kept */ }
}
