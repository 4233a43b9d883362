#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# All fuzz targets at once: run.sh BUILD SECONDS [OPTION OF LIBFUZZER...]. Status 1 where one finds something; its input is then printed in base64.
set -euo pipefail

here=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd)
build=$(cd -- "$1" && pwd) seconds=$2
shift 2
folder=$(mktemp -d -t ductile_fuzz.XXXXXX)
trap 'rm -rf -- "$folder"' EXIT

declare -A running=()
for target in "$here"/fuzz_*.cpp; do
    target=$(basename "$target" .cpp)
    mkdir -p "$folder/$target/found"
    (
        cd -- "$folder/$target"
        exec "$build/tests/fuzz/$target" -dict="$here/words.dict" -max_total_time="$seconds" -timeout=60 -rss_limit_mb=2048 \
            "$@" found "$here/corpus/$target" >../"$target.log" 2>&1
    ) &
    running[$target]=$!
done
status=0
for target in "${!running[@]}"; do
    if ! wait "${running[$target]}"; then
        status=1
        tail -n 60 "$folder/$target.log"
        for file in "$folder/$target"/{crash,leak,oom,timeout}-*; do
            if [[ -f $file ]]; then printf '%s, %s:\n' "$target" "$(basename "$file")" && base64 "$file"; fi
        done
    fi
    printf '%s: %s\n' "$target" "$(tail -n 1 "$folder/$target.log")"
done
exit $status
