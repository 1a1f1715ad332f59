#!/usr/bin/env bash
# Fuzzes one target, or all of them one after another.
#   tests/fuzz/run.sh NAME [seconds=60]     NAME: gcode, nodes, ... or all
# New inputs are collected in build/dev/corpus/NAME; a finding is kept in build/dev/findings and
# ends the run. A finding that was repaired moves to tests/fuzz/corpus/NAME under a name that says
# what it was; every ./check replays it.
set -euo pipefail
cd "$(dirname "$0")/../.."
[[ $# -ge 1 ]] || { sed -n '2,6s/^# \?//p' "$0" >&2; exit 2; }
name=$1 seconds=${2:-60}
if [[ $name == all ]]; then
  for file in tests/fuzz/*_fuzz.cpp; do "$0" "$(basename "$file" _fuzz.cpp)" "$seconds"; done
  exit 0
fi

mkdir -p "build/dev/corpus/$name" build/dev/findings
# Several may run at once; the build is for one at a time.
flock build/dev/lock bash -c "{ cmake --preset dev && cmake --build build/dev --target vcnc_fuzz_$name; } >/dev/null"
flags=(-max_total_time="$seconds" -timeout=60 -rss_limit_mb=2048 -print_funcs=0 -verbosity=0
  -artifact_prefix="build/dev/findings/$name-")
[[ -f tests/fuzz/$name.dict ]] && flags+=(-dict="tests/fuzz/$name.dict")
# HDF5 leaks, and asks for what a damaged file claims to hold; only the child that tries it does.
[[ $name == recording ]] && flags+=(-malloc_limit_mb=1000000 -detect_leaks=0)
printf 'fuzzing %s for %s s\n' "$name" "$seconds"
"build/dev/bin/vcnc_fuzz_$name" "${flags[@]}" "build/dev/corpus/$name" "tests/fuzz/corpus/$name"
