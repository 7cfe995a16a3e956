#!/usr/bin/env bash
# Plays apps/demo/miner in a real window under Xvfb, with keys and mouse events from xdotool: walks, digs a shaft and a
# tunnel, lights it with torches, starts a landslide, watches ships.
# Usage: play.sh QUOIN_MINER [FOLDER [DEVICE]]. Keeps images in FOLDER; DEVICE is the game's --device. Exits with 77 and
# a message if a program is not installed.
set -euo pipefail
miner="$(realpath "$1")"
. "$(dirname "$(realpath "$0")")/../on_screen.sh"
on_screen 960x540 "import convert" "$0" "$@"
images="${2:-$work}"
device="${3:-}"
mkdir -p "$images"

# Prints a value from the window title: x, y, z, sky, lamps or fallen
said() {
  title | sed -n 's/^Miner at \(-\?[0-9]*\) \(-\?[0-9]*\) \(-\?[0-9]*\), sky \([0-9]*\), lamps \([0-9]*\), fallen \([0-9]*\)$/\1 \2 \3 \4 \5 \6/p' |
    awk -v what="$1" '{ split("x y z sky lamps fallen", names); for (i in names) if (names[i] == what) print $i }'
}
is() { local now; now="$(said "$1")"; [ -n "$now" ] && [ "$now" "$2" "$3" ]; }
# Usage: look DOWN, in hundredths of a radian
look() { xdotool mousemove_relative --sync -- 0 "$(($1 * 10 / 3))" || true; sleep 0.3; }
hold() { xdotool keydown "$1"; sleep "$2"; xdotool keyup "$1"; }
shot() { sleep 0.5; import -window root "$images/$1.png"; }
# Prints the mean of an image channel, 0 to 255. Usage: mean NAME CHANNEL
mean() { convert "$images/$1.png" -format "%[fx:round(255*mean.$2)]" info:; }

# Counts the pixels that differ between two images.
other() { convert "$images/$1.png" "$images/$2.png" -compose difference -composite -colorspace gray -threshold 8% -format '%[fx:round(mean*w*h)]' info:; }

start() {
  launch Miner "$miner" --units 4 --edits 0 ${device:+--device "$device"} "$@"
  until_true 60 is y -gt 0 || fail "the game does not begin"
  xdotool windowfocus "$window" 2>/dev/null || true
  # Waits until the player has landed.
  local before
  until before="$(said y)"; sleep 1; [ "$before" = "$(said y)" ]; do :; done
}
# Places a torch ahead, walking with KEY if that is out of reach. Usage: torch KEY
torch() {
  local tries
  for tries in 1 2 3 4 5 6 7 8; do
    xdotool key --delay 80 "$1"
    ! until_true 4 is lamps -gt 0 || return 0
    hold w 0.3
  done
  fail "torch $1 does not shine"
}
stop() { quit Escape; }

echo "walk"
start --ships 0
shot meadow
before="$(said x) $(said z)"
hold w 1.5
[ "$before" != "$(said x) $(said z)" ] || fail "it does not walk"

echo "dig"
top="$(said y)"
for _ in 1 2 3 4 5 6; do look 30; done
for _ in $(seq 60); do
  ! is y -lt $((top - 12)) || break
  xdotool click 1
  sleep 0.4
done
is y -lt $((top - 12)) || fail "it does not dig down"
shot shaft
xdotool key --delay 80 Home
for _ in $(seq 60); do
  ! is sky -lt 3 || break
  xdotool click 1
  hold w 0.3
done
is sky -lt 3 || fail "the tunnel does not get dark"
shot dark

echo "torch"
is lamps -eq 0 || fail "there is lamplight already"
torch 1
shot orange
[ "$(mean orange r)" -ge $(($(mean dark r) + 20)) ] || fail "the cave gets no lighter: $(mean dark r), $(mean orange r)"
[ "$(mean orange r)" -gt $(($(mean orange b) + 8)) ] || fail "the light of the torch is not orange"
xdotool click 1
until_true 20 is lamps -eq 0 || fail "it is lit though the torch is gone"
shot dark_again
[ "$(mean dark_again r)" -lt $(($(mean dark r) + 10)) ] || fail "the cave stays light"
torch 2
shot blue
[ "$(mean blue b)" -gt $(($(mean blue r) + 8)) ] || fail "the light of the other torch is not blue"
stop

echo "landslide"
start --ships 0 --seed 5
look 30; look 30
shot before_slide
xdotool key --delay 80 l
until_true 30 is fallen -gt 400 || fail "no sand falls"
sleep 3
shot after_slide
[ "$(other before_slide after_slide)" -gt 5000 ] || fail "the landslide is not to be seen"
stop

echo "ships"
start --ships 60 --seed 5
look -5
for _ in 1 2 3 4 5 6 7 8; do
  shot ships
  shot ships_later
  [ "$(other ships ships_later)" -le 300 ] || break
done
[ "$(other ships ships_later)" -gt 300 ] || fail "no ships fly"
stop
echo "played"
