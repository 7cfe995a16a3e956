#!/usr/bin/env bash
# Tests bench/spread on a program whose times differ between processes.
set -euo pipefail
spread="$(dirname "$(realpath "$0")")/spread"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
cd "$work"
fail() { echo "FAILED: $*"; exit 1; }

cat >program <<'TEXT'
#!/usr/bin/env bash
# Three benchmarks; the ray benchmarks take 10, 11, 12 ... ms, depending on the number of earlier processes.
out=
filter=.
for argument in "$@"; do
  case "$argument" in
    --benchmark_out=*) out="${argument#*=}" ;;
    --benchmark_filter=*) filter="${argument#*=}" ;;
    --benchmark_list_tests=true) printf 'rays/a/single\nrays/b/1\nother\n' | grep -E "$filter"; exit 0 ;;
  esac
done
[ ! -e broken ] || exit 3
echo x >>processes
time=$((9 + $(wc -l <processes)))
{
  echo '{"benchmarks": ['
  comma=
  for name in rays/a/single rays/b/1 other; do
    echo "$name" | grep -qE "$filter" || continue
    echo "$comma{\"name\": \"$name\", \"run_name\": \"$name\", \"run_type\": \"iteration\", \"cpu_time\": $time, \"time_unit\": \"ms\"}"
    comma=,
  done
  echo ']}'
} >"${out:-/dev/null}"
TEXT
chmod +x program

./program --benchmark_out=all.json
"$spread" ./program --benchmark_out=all.json --benchmark_out_format=json >said
[ "$(wc -l <processes)" = 6 ] || fail "not five more processes"
grep -qE '^rays/a/single +13\.000 ms +36\.4 %$' said || fail "the spread of 11 to 15 ms is not reported: $(cat said)"
! grep -q '^other' said || fail "a benchmark without rays ran again"
python3 - <<'TEXT' || fail "the file lacks the processes: $(cat all.json)"
import json
runs = {run["name"]: run for run in json.load(open("all.json"))["benchmarks"]}
assert runs["rays/b/1"]["cpu_time"] == 10
assert runs["rays/b/1"]["process_cpu_times"] == [11, 12, 13, 14, 15]
assert abs(runs["rays/b/1"]["process_spread"] - 4 / 11) < 1e-9
assert "process_spread" not in runs["other"]
TEXT

rm processes
"$spread" ./program --benchmark_filter=single >said
grep -q '^rays/a/single' said && ! grep -q '^rays/b' said || fail "the filter is not heeded: $(cat said)"
"$spread" ./program --benchmark_filter=other >said
[ ! -s said ] || fail "says something without a benchmark of rays"
touch broken
! "$spread" ./program >said 2>&1 || fail "a program that fails is no error"
echo "ok"
