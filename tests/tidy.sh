#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# tests/tidy.sh [all]: clang-tidy (.clang-tidy says which checks) on what has changed since the branch left main, or, on main itself,
# in its last ten commits, the 8 files that changed most: a minute on two cores. A header is checked within a file of its name, or
# the first that includes it. all: everything, a quarter of an hour.
set -euo pipefail
cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.."
git() { command git -c safe.directory='*' "$@"; }

sources=('lib/*.cpp' 'drivers/*.cpp' 'verification/*.cpp')
if [[ ${1:-} == all ]]; then
    mapfile -t files < <(git ls-files -- "${sources[@]}")
else
    head=$(git rev-parse HEAD) base=$(git merge-base HEAD origin/main 2>/dev/null || git merge-base HEAD main 2>/dev/null || true)
    if [[ -z $base || $base == "$head" ]]; then
        base=$(git rev-parse --verify --quiet HEAD~10 || git rev-list --max-parents=0 HEAD | tail -n 1)
    fi
    mapfile -t files < <(git diff --numstat --diff-filter=d "$base" -- "${sources[@]}" 'lib/*.hpp' | sort -rn | cut -f 3 | while IFS= read -r file; do
        if [[ $file == *.cpp ]]; then
            echo "$file"
        elif [[ -f ${file%.hpp}.cpp ]]; then
            echo "${file%.hpp}.cpp"
        else
            git grep -lF "#include <ductile/${file#lib/}>" -- 'lib/*.cpp' | head -n 1 || true
        fi
    done | awk '!seen[$0]++')
    if ((${#files[@]} > 8)); then
        echo "tidy: $((${#files[@]} - 8)) files that changed less are left out (tests/tidy.sh all)"
        files=("${files[@]:0:8}")
    fi
fi
if ((${#files[@]} == 0)); then
    echo "tidy: nothing has changed"
    exit
fi

# Without precompiled headers, which clang-tidy cannot read, and file by file.
build=build/tidy
if [[ ! -f $build/build.ninja ]]; then cmake --preset clang -B "$build" -D CMAKE_DISABLE_PRECOMPILE_HEADERS=ON -D CMAKE_UNITY_BUILD=OFF >/dev/null; fi
cmake --build "$build" --target ductile_commit >/dev/null
status=0
printf '%s\0' "${files[@]}" | xargs -0 -n 1 -P "$(nproc)" clang-tidy -p "$build" --quiet 2> >(grep -v 'warnings\? generated\.$' >&2) || status=$?
((status == 0)) || exit 1
echo "tidy: ${#files[@]} files, nothing found"
