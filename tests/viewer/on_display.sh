#!/usr/bin/env bash
# Runs tests that open windows on a separate display. Exits with 77 and a message if xvfb-run is not installed.
# Usage: on_display.sh PROGRAM [ARGUMENT...]
set -euo pipefail
for program in xvfb-run xauth; do
  command -v "$program" >/dev/null || { echo "skipped: $program is not installed"; exit 77; }
done
unset WAYLAND_DISPLAY SDL_VIDEODRIVER
exec xvfb-run -a -s '-screen 0 1024x640x24 -noreset' "$@"
