# Sourced by tests of windowed programs: a real window under Xvfb, with keys and mouse events from xdotool.

# Restarts the script on its own screen. Exits with 77 and a message if a program is not installed.
# Usage: on_screen WIDTHxHEIGHT "PROGRAM..." "$0" "$@", with the other programs that the script needs
on_screen() {
  local size="$1" program
  for program in xvfb-run xauth xdotool $2; do
    command -v "$program" >/dev/null || { echo "skipped: $program is not installed"; exit 77; }
  done
  shift 2
  if [ -z "${QUOIN_ON_SCREEN:-}" ]; then
    export QUOIN_ON_SCREEN=1
    exec xvfb-run -a -s "-screen 0 ${size}x24" "$@"
  fi
  export SDL_RENDER_DRIVER=software LC_ALL=C
  unset WAYLAND_DISPLAY SDL_VIDEODRIVER
  work="$(mktemp -d)"
  running= window=
  trap finish EXIT
}
finish() {
  [ -z "$running" ] || kill "$running" 2>/dev/null || true
  rm -rf "$work"
}

# Starts a program with output to $work/log, and sets $window to the window whose title contains NAME.
# Usage: launch NAME PROGRAM [ARGUMENT...]
launch() {
  local name="$1"
  shift
  "$@" >"$work/log" 2>&1 &
  running=$!
  window="$(timeout 60 xdotool search --sync --onlyvisible --name "$name" 2>/dev/null | head -n 1)" || true
  [ -n "$window" ] || fail "no window"
}
# Ends the program with a key, and checks that it ends without an error. Usage: quit KEY
quit() {
  xdotool key --delay 80 "$1"
  until_true 30 gone || fail "$1 does not end it"
  wait "$running" || fail "it ended with $?"
  running= window=
}
gone() { ! kill -0 "$running" 2>/dev/null; }

title() { xdotool getwindowname "$window" 2>/dev/null; }
fail() { echo "FAILED: $*; the window's title is '$(title)'"; cat "$work/log" 2>/dev/null || true; exit 1; }

# Usage: until_true SECONDS COMMAND...
until_true() {
  local left=$(($1 * 5))
  shift
  until "$@"; do
    left=$((left - 1))
    [ "$left" -gt 0 ] || return 1
    sleep 0.2
  done
}
