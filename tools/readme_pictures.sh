#!/bin/bash
# Makes the pictures of README.md anew (content/pictures): two sessions with their recorded hands, a still, the debrief
# page in a browser, a short film. A quarter of an hour where the processor draws. Needs ffmpeg and Chromium's headless shell.
#   tools/readme_pictures.sh [FOLDER]    sessions go to FOLDER (out/readme); one that lies there already is taken
set -euo pipefail
cd "$(dirname "$0")/.."
stylet=${STYLET:-build/release/bin/stylet}
out=${1:-out/readme}
pictures=content/pictures

session() {  # NAME
  [ -e "$out/$1/debrief.html" ] || "$stylet" train "$1" --lockstep --view headless --out "$out/$1"
}
film() {  # NAME FROM TO SPEED: a film of some seconds that a web page shows
  "$stylet" replay "$out/$1" --out "$out/$1-film" --from "$2" --to "$3" --speed "$4"
  ffmpeg -v error -y -i "$out/$1-film/session.mp4" -vf 'fps=7.5,scale=800:-2:flags=lanczos' -c:v libwebp_anim \
    -quality 60 -compression_level 6 -loop 0 "$pictures/$1.webp"
}

session liver_biopsy
ffmpeg -v error -y -i "$out/liver_biopsy/session.png" -q:v 3 "$pictures/liver_biopsy.jpg"
session rfa
film rfa 7 24.4 3
chromium-headless-shell --no-sandbox --disable-gpu --hide-scrollbars --window-size=1200,1500 \
  --screenshot="$(realpath "$out")/debrief.png" "file://$(realpath "$out")/rfa/debrief.html" 2>/dev/null
ffmpeg -v error -y -i "$out/debrief.png" -vf scale=1000:-2 -q:v 4 "$pictures/debrief.jpg"
ls -l "$pictures"
