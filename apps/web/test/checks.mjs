// What the tests of the package and of the page count, and how they say it.
export const found = { checked: 0, failed: 0 };

export function check(isRight, what) {
  ++found.checked;
  if (isRight) return;
  ++found.failed;
  console.log(`WRONG: ${what}`);
}

/** Says what is right, too. */
export function checkAloud(isRight, what) {
  if (isRight) console.log(`right: ${what}`);
  check(isRight, what);
}

/** A function that checks that `work` throws a QuoinError, of one of the codes where any are given. */
export const refusing = (QuoinError) => async (what, work, ...codes) => {
  try {
    await work();
    check(false, `${what}: no error`);
  } catch (error) {
    check(error instanceof QuoinError && error.message !== '' && (codes.length === 0 || codes.includes(error.code)),
          `${what}: ${error?.code} ${error}`);
  }
};
