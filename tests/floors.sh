#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The rules of the house: folders include downwards only, in the order of the table in lib/README.md; one place knows OpenMP's pragmas;
# what lies below the carriers does not know the command line; and on the grid the space alone loops over rows.
set -euo pipefail
cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.."

failures=0
complain() {
    printf '%s\n' "$1"
    failures=$((failures + 1))
}

# shellcheck disable=SC2016 # the backquotes are the table's
mapfile -t floors < <(sed -n 's/^| `lib\/\([a-z]*\)` |.*/\1/p' lib/README.md)
declare -A height=()
for k in "${!floors[@]}"; do height[${floors[k]}]=$((${#floors[@]} - k)); done
for folder in lib/*/; do
    folder=$(basename "$folder")
    [[ -n ${height[$folder]:-} ]] || complain "lib/$folder is not in the table of floors in lib/README.md"
done
while IFS=: read -r file include; do
    from=${file#lib/} from=${from%%/*} to=${include#*<ductile/} to=${to%%/*}
    ((${height[$from]:-0} >= ${height[$to]:-0})) || complain "$file includes $to/, which lies above $from/"
done < <(grep -rhoH '#include <ductile/[a-z]*' lib)

while IFS= read -r line; do
    complain "OpenMP outside lib/base: $line"
done < <(grep -rn 'omp ' lib --include='*.cpp' --include='*.hpp' | grep -e '#pragma omp' -e '_Pragma' | grep -v '^lib/base/' || true)

while IFS= read -r line; do
    complain "the command line below the carriers: $line"
done < <(grep -rnE '"[^"]*--[a-z]' lib/{base,space,linear,ode,scene,time,sundials,run} || true)

while IFS= read -r line; do
    complain "rows of cells outside lib/space: $line"
done < <(grep -rnE '(\.|->)row\(|for_each_row|sweep_rows' lib/quasistatic || true)

while IFS= read -r line; do
    complain "files and terminal in a law or an integrator: $line"
done < <(grep -rnE "<ductile/io/" lib/{material,ode,time,linear} || true)

while IFS= read -r file; do
    complain "$file lacks its SPDX line"
done < <(find lib drivers tests verification '(' -name '*.[ch]pp' -o -name '*.py' -o -name '*.sh' ')' \
    -exec grep -L 'SPDX-License-Identifier: GPL-3.0-or-later' {} +)

if ((failures > 0)); then
    printf '%d breaches\n' "$failures"
    exit 1
fi
printf '%d floors, no breach\n' "${#floors[@]}"
