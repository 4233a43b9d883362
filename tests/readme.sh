#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Runs the README's commands, but for the first two, in a scratch copy of their surroundings: readme.sh. Needs what ./ductile needs,
# and Python's packages for pictures.
set -euo pipefail

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd)
scratch=$(mktemp -d -t ductile_readme.XXXXXX)
trap 'rm -rf -- "$scratch"' EXIT
ln -s "$root/ductile" "$root/drivers" "$scratch/"
cd -- "$scratch"

# Lines of ```sh blocks, and what stands in backquotes in a cell of a table.
# shellcheck disable=SC2016 # the backquotes are the README's
mapfile -t commands < <(awk '/^```/ {inside = $0 == "```sh"; next} inside && /^\.\/ductile/ {print}' "$root/README.md"
    sed -n 's/^| <img .*| `\(\.\/ductile [^`]*\)` |.*/\1/p' "$root/README.md")
count=0
for line in "${commands[@]}"; do
    if [[ $line =~ ^\./ductile\ (demo|test) ]]; then continue; fi
    started=$SECONDS
    bash -c "$line" >output.log 2>&1 </dev/null || {
        status=$?
        tail -n 20 output.log
        printf 'readme: status %d: %s\n' "$status" "$line" >&2
        exit 1
    }
    printf '%3d s  %s\n' "$((SECONDS - started))" "$line"
    count=$((count + 1))
done
((count >= 15)) || { printf 'readme: only %d commands found in README.md\n' "$count" >&2; exit 1; }
