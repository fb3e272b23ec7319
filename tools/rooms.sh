# Sourced by test.sh: the rooms of engine/README.md, and in which folders of tests/ each is tested.
# shellcheck shell=bash

has_tests() { [ "$1" = kernel ] || grep -qs '^stylet_test(' "tests/$1/CMakeLists.txt"; }

# all_rooms: those of the map's table, and every folder of tests.
all_rooms() {
  local list
  sed -n 's/^| `\([a-z_/]*\)` |.*/\1/p' engine/README.md
  for list in tests/*/CMakeLists.txt; do
    has_tests "$(basename "$(dirname "$list")")" && basename "$(dirname "$list")"
  done
}

# tests_of ROOM: the folder of tests/ that has its name (link for engine/link, physics for physics/contact); of a room
# without, the one whose tests include most of its headers. Nothing where there is no such room.
tests_of() {
  local room=${1#tests/}
  room=${room%/}
  if has_tests "$room"; then echo "$room"; return; fi
  grep -qF "| \`$room\` |" engine/README.md || return 0
  case $room in
  engine/stills) echo debrief ;;
  engine/panels) echo desktop ;;
  tools/reference) echo validation ;;
  tools/draco) echo gltf ;;
  tools/make_motion) echo readers ;;
  *)
    if has_tests "${room##*/}"; then echo "${room##*/}"
    elif has_tests "${room%%/*}"; then echo "${room%%/*}"
    else grep -ho "#include \"$room/" -r tests --include='*.cpp' -l | cut -d/ -f2 | sort | uniq -c | sort -rn | awk 'NR == 1 { print $2 }'
    fi ;;
  esac
}

# nearest NAME: the room whose name, or its last part, takes the fewest edits.
nearest() {
  all_rooms | awk -v asked="$1" '
    function least(a, b, c) { a = a < b ? a : b; return a < c ? a : c }
    function edits(a, b,  i, j, d) {
      for (i = 0; i <= length(a); ++i) d[i, 0] = i
      for (j = 0; j <= length(b); ++j) d[0, j] = j
      for (i = 1; i <= length(a); ++i)
        for (j = 1; j <= length(b); ++j)
          d[i, j] = least(d[i - 1, j] + 1, d[i, j - 1] + 1, d[i - 1, j - 1] + (substr(a, i, 1) != substr(b, j, 1)))
      return d[length(a), length(b)]
    }
    { part = $0; sub(".*/", "", part); n = edits(asked, $0); m = edits(asked, part); if (m < n) n = m
      if (NR == 1 || n < best) { best = n; name = $0 } }
    END { print name }'
}
