#!/usr/bin/env bash
# Tests the viewer in a real window under Xvfb, with keys and mouse events from xdotool.
# Usage: window.sh QUOIN QUOIN_DEMO_WORLD [vulkan]. With vulkan, uses Vulkan and its validation layer. Exits with 77 and
# a message if xvfb-run or xdotool is not installed.
set -euo pipefail
quoin="$(realpath "$1")" demo_world="$(realpath "$2")" backend="${3:-cpu}"

. "$(dirname "$(realpath "$0")")/../on_screen.sh"
on_screen 1024x640 "" "$0" "$@"

cd "$work"
export XDG_CONFIG_HOME="$work/config"

title_is() { [ "$(title)" = "$1" ]; }
voxels() { "$quoin" info "$1" --json | sed -n 's/^  "voxels": \([0-9]*\).*/\1/p'; }

start() {
  launch Quoin "$quoin" view "$@" --backend "$backend"
  until_true 60 title_is "$(basename "$1") - Quoin" || fail "the file did not open"
  xdotool windowmove --sync "$window" 0 0 2>/dev/null || true
  xdotool windowfocus "$window" 2>/dev/null || true
  sleep 0.5
}
stop() {
  quit ctrl+q
  ! grep -qi 'validation' log || fail "the validation layer has complaints"
}
# Saves the finished image as NAME. Usage: save_image NAME
save_image() {
  rm -f world-*.png
  xdotool key --delay 80 F12
  until_true 120 test -s world-1.png || fail "F12 gives no image ($1)"
  mv world-1.png "$1"
}
# Saves images as NAME until one equals LIKE. Presses the key again in between, since on a busy machine earlier key
# presses may be delayed. Usage: image_becomes NAME LIKE [KEY]
image_becomes() {
  local tries
  for tries in 1 2 3 4 5 6 7 8; do
    save_image "$1"
    ! cmp -s "$1" "$2" || return 0
    sleep 0.5
    [ -z "${3:-}" ] || xdotool key --delay 80 "$3"
  done
  return 1
}
# Usage: drag BUTTON DX DY
drag() {
  xdotool mousedown "$1"
  local i
  for i in 1 2 3 4 5 6; do
    xdotool mousemove_relative -- "$2" "$3"
    sleep 0.05
  done
  xdotool mouseup "$1"
  sleep 0.3
}

mkdir -p config/quoin
"$demo_world" castle.vox
"$quoin" generate terrain world.vox --chunks 2x2x2 >/dev/null
# By day, images have fewer samples. The last step compares images of 16 samples.
samples=4
[ -z "${QUOIN_NIGHTLY:-}" ] || samples=16
if [ "$backend" = vulkan ]; then
  export VK_INSTANCE_LAYERS=VK_LAYER_KHRONOS_validation
  samples=1 # software devices are slow
  "$quoin" render castle.vox --size 32x32 --backend vulkan -o probe.png >probe.log 2>&1 || {
    # Runs without the layer, which is not part of Vulkan itself.
    unset VK_INSTANCE_LAYERS
    "$quoin" render castle.vox --size 32x32 --backend vulkan -o probe.png >probe.log 2>&1 ||
      { echo "skipped: $(cat probe.log)"; exit 77; }
  }
fi
echo "{\"width\": 640, \"height\": 400, \"samples\": $samples}" >config/quoin/viewer.json

echo "open"
start world.vox
# On a busy machine the window may not have its size yet.
save_image opened.png
for _ in 1 2 3 4 5 6 7 8; do
  xdotool key --delay 80 Home
  sleep 0.5
  save_image again.png
  ! cmp -s opened.png again.png || break
  mv again.png opened.png
done

echo "fly"
xdotool keydown w; sleep 0.5; xdotool keyup w; sleep 0.7
save_image flown.png
! cmp -s opened.png flown.png || fail "W does not move the camera"
xdotool key --delay 80 Home
image_becomes home.png opened.png Home || fail "Home does not come back to the first view"

echo "orbit"
xdotool mousemove 180 220
drag 3 15 3
save_image turned.png
! cmp -s home.png turned.png || fail "the right button does not turn"
xdotool key --delay 80 Home
xdotool mousemove 180 220
sleep 0.5

echo "the image shows the view at the time of the request"
image_becomes before.png home.png Home || fail "Home does not come back"
xdotool key --delay 1 F12 shift+5
until_true 120 test -s world-1.png || fail "F12 gives no image (before another view)"
mv world-1.png pressed.png
cmp -s before.png pressed.png || fail "F12 saves the view that came after it"
xdotool key --delay 80 Home
sleep 0.5

echo "edit, undo, redo"
xdotool key --delay 80 3 bracketright bracketright
drag 1 6 2
until_true 20 title_is "* world.vox - Quoin" || fail "the edit leaves no mark in the title"
save_image edited.png
! cmp -s home.png edited.png || fail "the edit is not seen"
xdotool key --delay 80 ctrl+z
until_true 20 title_is "world.vox - Quoin" || fail "undo does not bring back the saved state"
image_becomes undone.png home.png || fail "undo does not bring back the image"
xdotool key --delay 80 ctrl+y
image_becomes redone.png edited.png || fail "redo does not bring back the edit"

xdotool key --delay 80 ctrl+z
until_true 20 title_is "world.vox - Quoin" || fail "undo does not bring back the saved state again"

# Without a device, the viewer shows a message and continues with the CPU renderer.
if "$quoin" render castle.vox --size 32x32 --backend vulkan -o probe.png >/dev/null 2>&1; then
  echo "meshes follow edits"
  xdotool key --delay 80 F6
  sleep 0.5
  save_image blocks.png
  ! cmp -s home.png blocks.png || fail "F6 draws no meshes"
  xdotool mousemove 180 220
  drag 1 6 2
  until_true 20 title_is "* world.vox - Quoin" || fail "no edit among meshes"
  save_image blocks_edited.png
  ! cmp -s blocks.png blocks_edited.png || fail "the meshes do not follow the edit"
  xdotool key --delay 80 ctrl+z
  image_becomes blocks_undone.png blocks.png || fail "the meshes do not follow the undo"
  if [ "$backend" = vulkan ] && [ -z "${QUOIN_NIGHTLY:-}" ]; then
    # A software device would take minutes for the rest, which the run of the other backend also covers.
    until_true 20 title_is "world.vox - Quoin" || fail "undo among meshes does not bring back the saved state"
    stop
    echo "short of the rest, which ./dev nightly runs"
    exit 0
  fi
  for key in F8 F9 F7; do
    xdotool key --delay 80 "$key"
    sleep 0.5
    save_image next.png
    ! cmp -s blocks.png next.png || fail "$key changes nothing"
    mv next.png blocks.png
  done
  xdotool key --delay 80 F8 F8 F9 F9 F9 F9 F5
  image_becomes rays.png home.png F5 || fail "F5 does not bring back the rays"
  # Path-traced images take long, so the window is small for this one.
  xdotool windowsize "$window" 360 240
  sleep 0.5
  save_image small_rays.png
  xdotool key --delay 80 F3
  sleep 0.5
  save_image paths.png
  ! cmp -s small_rays.png paths.png || fail "F3 does not draw paths of light"
  xdotool key --delay 80 F5
  xdotool windowsize "$window" 640 400
  sleep 0.5
  image_becomes rays.png home.png F5 || fail "F5 does not end the paths"
fi

echo "choose a colour in the panel, paint"
xdotool key --delay 80 4
xdotool mousemove 493 158
sleep 0.3
xdotool click 1
xdotool mousemove 180 220
drag 1 6 2
save_image painted.png
! cmp -s home.png painted.png || fail "the paint is not seen"
! cmp -s edited.png painted.png || fail "painting removes"
xdotool key --delay 80 ctrl+z
until_true 20 title_is "world.vox - Quoin" || fail "painting cannot be undone"
xdotool key --delay 80 ctrl+y ctrl+z 3
xdotool mousemove 180 220
drag 1 6 2
until_true 20 title_is "* world.vox - Quoin" || fail "the second edit leaves no mark in the title"

echo "save"
before="$(voxels world.vox)"
xdotool key --delay 80 ctrl+s
until_true 30 title_is "world.vox - Quoin" || fail "Ctrl+S does not save"
after="$(voxels world.vox)"
[ "$after" -lt "$before" ] || fail "the saved file has $after voxels, the first one $before: nothing was removed"

echo "resize, help, panel"
xdotool windowsize "$window" 500 300
sleep 0.5
xdotool key --delay 80 F1 F1 F2
save_image small.png
stop

echo "settings are remembered"
grep -q '"panel": false' config/quoin/viewer.json || fail "the panel's state is not remembered"
grep -q '"width": 500' config/quoin/viewer.json || fail "the window's size is not remembered"
grep -q 'world.vox' config/quoin/viewer.json || fail "the file is not among the recent ones"

echo "who asks to save and thinks better of it can go on"
echo '{"width": 640, "height": 400, "samples": 1, "panel": false}' >config/quoin/viewer.json
echo '{"quoin_scene": 1, "files": [{"id": "a", "path": "world.vox"}], "instances": [{"file": "a"}]}' >sc.json
start sc.json
xdotool mousemove 320 220
sleep 0.5
xdotool key --delay 80 3
xdotool click 1
until_true 20 title_is "* sc.json - Quoin" || fail "no edit in a scene file"
xdotool key --delay 80 ctrl+q
sleep 1
# The viewer does not write scene files: Save asks for a name.
xdotool mousemove 214 224
sleep 0.5
xdotool click 1
sleep 1
xdotool key --delay 80 Escape
sleep 1
xdotool key --delay 80 Escape
sleep 1
xdotool key --delay 80 ctrl+z
until_true 20 title_is "sc.json - Quoin" || fail "the window takes no keys after Save as was cancelled"
stop

echo "a world on disk: chunks come, edits are saved without being asked"
echo '{"width": 640, "height": 400, "samples": 1, "panel": false}' >config/quoin/viewer.json
if "$quoin" generate terrain world.quoin --endless >/dev/null 2>no_worlds; then
  cp world.quoin before.quoin
  start world.quoin --distance 200 --memory 128
  save_image flown.png
  xdotool mousemove 320 300
  sleep 0.5
  xdotool key --delay 80 3
  xdotool click 1
  sleep 2
  save_image dug.png
  ! cmp -s flown.png dug.png || fail "nothing was removed from the world"
  title_is "world.quoin - Quoin" || fail "an edit of a world on disk waits to be saved"
  stop
  "$quoin" world check world.quoin >/dev/null || fail "the world is damaged"
  stored() { "$quoin" world info "$1" | sed -n 's/^Grid 0.*: \([0-9]*\) chunks.*/\1/p'; }
  [ "$(stored world.quoin)" -gt "$(stored before.quoin)" ] || fail "no chunk that was made is kept"
  [ ! -e world.quoin-wal ] || fail "the world's log was left behind"
  "$quoin" view world.quoin --bare --size 320x240 --distance 200 --screenshot again.png --backend "$backend" >log 2>&1
  "$quoin" view before.quoin --bare --size 320x240 --distance 200 --screenshot untouched.png --backend "$backend" >>log 2>&1
  ! cmp -s again.png untouched.png || fail "removed voxels came back"
else
  cat no_worlds
fi

echo "another file, and the image of the settled window is the renderer's"
"$quoin" view castle.vox --bare --size 320x240 --screenshot window.png --backend "$backend" >log 2>&1
"$quoin" render castle.vox --size 320x240 --samples 16 -o render.png --backend "$backend" >/dev/null
cmp window.png render.png || fail "the window shows another image than quoin render"
! grep -qi 'validation' log || fail "the validation layer has complaints"
echo "passed"
