// Counts and reports the checks of the package and page tests.
export const found = { checked: 0, failed: 0 };

export function check(isRight, what) {
  ++found.checked;
  if (isRight) return;
  ++found.failed;
  console.log(`WRONG: ${what}`);
}

/** Also reports passed checks. */
export function checkAloud(isRight, what) {
  if (isRight) console.log(`right: ${what}`);
  check(isRight, what);
}

/** Returns a function that checks that `work` throws a QuoinError, with one of the codes if any are given. */
export const refusing = (QuoinError) => async (what, work, ...codes) => {
  try {
    await work();
    check(false, `${what}: no error`);
  } catch (error) {
    check(error instanceof QuoinError && error.message !== '' && (codes.length === 0 || codes.includes(error.code)),
          `${what}: ${error?.code} ${error}`);
  }
};
