#!/usr/bin/env bash
# Counts the instructions of the filter's steps (valgrind's callgrind; one thread, fixed seeds) and compares them with
# tests/instructions.txt: instructions do not depend on the machine's mood. Fails when a step needs over 5 % more.
# `tests/instructions.sh --renew` stores what is counted now; `--build` only builds what counts. Needs valgrind, and a
# processor with AVX2: without it a step takes more.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

tolerance=5 # percent
stored=tests/instructions.txt
if ! command -v valgrind >/dev/null; then
    echo "instructions.sh: valgrind is missing: install it (apt install valgrind)" >&2
    exit 1
fi
program=$(cargo bench --quiet --package palpate-filter --bench instructions --no-run --message-format=json |
    sed -n 's/.*"executable":"\([^"]*\)".*/\1/p' | tail -n 1)
if [ "${1:-}" = --build ]; then
    exit
fi
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

# Instructions a step, each case by itself, all at once.
count() {
    local steps
    steps=$(valgrind --tool=callgrind --collect-atstart=no --toggle-collect='instructions::counted*' \
        --callgrind-out-file="$folder/$1.out" "$program" "$1" 2>"$folder/$1.log")
    awk -v case="$1" -v steps="$steps" '/^summary:/ { printf "%s %d\n", case, $2 / steps }' "$folder/$1.out"
}
cases="paper-converged paper-ambiguous palpate"
for case in $cases; do
    count "$case" >"$folder/$case.txt" &
done
wait
for case in $cases; do
    cat "$folder/$case.txt"
done >"$folder/counted.txt"
if [ "$(wc -l <"$folder/counted.txt")" != 3 ]; then
    cat "$folder"/*.log >&2
    exit 1
fi
if [ "${1:-}" = --renew ]; then
    cp "$folder/counted.txt" "$stored"
    cat "$stored"
    exit
fi

echo "instructions a step: stored, counted, change"
join <(sort "$stored") <(sort "$folder/counted.txt") | awk -v tolerance="$tolerance" '
    {
        change = 100 * ($3 / $2 - 1)
        printf "%-16s %11d %11d %+6.1f %%\n", $1, $2, $3, change
        if (change > tolerance) slower = slower " " $1
        if (change < -tolerance) faster = faster " " $1
    }
    END {
        if (faster) print "faster:" faster ". Keep it so: tests/instructions.sh --renew"
        if (slower) { print "slower:" slower ". If that is meant: tests/instructions.sh --renew"; exit 1 }
        if (NR != 3) { print "stored and counted cases differ: tests/instructions.sh --renew"; exit 1 }
    }'
