#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Tests of the launcher: launcher.sh PATH_OF_THE_LAUNCHER. Stand-ins for apt-get, cmake and the like write what they
# were asked to do into a log; nothing is installed or built.
# shellcheck disable=SC2016,SC2115  # the variables of a stand-in are its own; nothing below is ever empty
set -euo pipefail

launcher=$1
sandbox=$(mktemp -d)
trap 'rm -rf -- "$sandbox"' EXIT
log=$sandbox/log
tree="$sandbox/a tree"

fail() {
    printf 'FAILED: %s\n--- log\n%s\n--- output\n%s\n' "$1" "$(cat "$log")" "$(cat "$sandbox/output")" >&2
    exit 1
}
expect() { grep -qF -e "$2" "$sandbox/$1" || fail "$1 lacks: $2"; }
expect_not() { ! grep -qF -e "$2" "$sandbox/$1" || fail "$1 has: $2"; }

stand_in() { # NAME, body on standard input
    { printf '#!%s\nname=%s\nsandbox=%q\nlog=%q\n' "$(command -v bash)" "$1" "$sandbox" "$log"; cat; } >"$sandbox/bin/$1"
    chmod +x "$sandbox/bin/$1"
}

fresh() { # a fresh machine and a fresh copy of the tree
    rm -rf "$tree" "$sandbox/bin" "$sandbox/installed" "$sandbox/lists" "$sandbox/uid"
    mkdir -p "$tree/drivers" "$sandbox/bin" "$sandbox/elsewhere"
    # Debian's Python is a stand-in, too.
    sed "s|/usr/bin/python3|$sandbox/bin/python3|" "$launcher" >"$tree/ductile"
    chmod +x "$tree/ductile"
    touch "$tree/drivers/alpha.cpp" "$sandbox/installed"
    echo 0 >"$sandbox/uid"
    local tool
    for tool in bash basename cat chmod dirname env flock grep mkdir nproc paste realpath sed tail; do
        ln -s "$(command -v $tool)" "$sandbox/bin/$tool"
    done
    stand_in python3 <<'END'
if [[ $1 == -c ]]; then grep -q python3-matplotlib "$sandbox/installed"; exit; fi
echo "python3 $*" >>"$log"
exit 7
END
    stand_in id <<<'cat "$sandbox/uid"'
    stand_in dpkg-query <<<'sed "s/$/ installed/" "$sandbox/installed"'
    stand_in apt-cache <<<'[[ -e $sandbox/lists ]]'
    stand_in apt-get <<'END'
echo "apt-get $*" >>"$log"
[[ $* == *" update" ]] && : >"$sandbox/lists"
if [[ $* == *" install "* ]]; then
    [[ -e $sandbox/lists && ! -e $sandbox/broken ]] || exit 100
    for package; do echo "$package"; done >>"$sandbox/installed"
fi
END
    stand_in cmake <<'END'
echo "cmake $*" >>"$log"
mkdir -p build/release
if [[ $1 == --preset ]]; then
    echo "CMAKE_HOME_DIRECTORY:INTERNAL=$PWD" >build/release/CMakeCache.txt
    : >build/release/build.ninja
else
    printf '#!/bin/sh\necho "ran in $PWD with $*"; exit 7\n' >build/release/alpha
    chmod +x build/release/alpha
fi
END
}

launch() { # EXPECTED_STATUS ARGUMENT...
    local expected=$1 status=0
    shift
    : >"$log"
    (cd "$sandbox/elsewhere" && PATH=$sandbox/bin "$tree/ductile" "$@") >"$sandbox/output" 2>&1 </dev/null || status=$?
    [[ $status == "$expected" ]] || fail "status $status instead of $expected from: ductile $*"
}

: >"$log"
: >"$sandbox/output"

fresh # help and mistakes touch nothing
launch 0 --help
expect output alpha
launch 0
launch 2 beta
expect output "no program 'beta'"
expect_not output "Did you mean"
launch 2 alhpa
expect output "Did you mean 'alpha'?"
launch 2 tset
expect output "Did you mean 'test'?"
launch 2 plto
expect output "Did you mean 'plot'?"
launch 2 --hepl
expect_not output "Did you mean 'alpha'?"
launch 2 ../drivers/alpha
[[ ! -s $log ]] || fail "help or a mistake has done something"

# root on a fresh machine: lists, packages, configuration, build, run; arguments, directory and status reach the program
launch 7 alpha --cells 8 'two words'
expect output "missing Debian packages: g++ cmake"
expect log "update"
expect log "install --yes --no-install-recommends g++"
expect log "cmake --preset release"
expect log "--target alpha"
expect output "ran in $sandbox/elsewhere with --cells 8 two words"

launch 7 alpha # the second time only the build is asked for
expect_not log apt-get
expect_not log "cmake --preset"
expect_not output missing

mv "$tree" "$sandbox/moved tree" # a tree that has moved is configured anew
tree="$sandbox/moved tree" launch 7 alpha
expect log "cmake --preset release"
rm -rf "$sandbox/moved tree"

fresh # one package missing: only that is installed; known lists are not fetched again
: >"$sandbox/lists"
launch 7 alpha
sed -i /libfmt-dev/d "$sandbox/installed"
launch 7 alpha
expect output "missing Debian packages: libfmt-dev"
expect_not log " update"

fresh # neither root nor sudo: the exact command, status 2, nothing done
echo 1000 >"$sandbox/uid"
launch 2 alpha
expect output "apt-get update && apt-get install --yes --no-install-recommends g++ cmake"
[[ ! -s $log ]] || fail "something was done without root"

stand_in sudo <<<'echo "sudo $*" >>"$log"; [[ $1 == -n ]] && shift; [[ $1 == true ]] || exec "$@"' # now with sudo
launch 7 alpha
expect log "sudo env DEBIAN_FRONTEND=noninteractive"

stand_in sudo <<<'exit 1' # sudo that would ask for a password, and no terminal
: >"$sandbox/installed"
launch 2 alpha
expect output "apt-get update && apt-get install"

fresh # apt-get fails
: >"$sandbox/broken"
launch 1 alpha
expect output "apt-get failed"
expect_not log "cmake --"
rm "$sandbox/broken"

fresh # figures: only what they need is installed, nothing is built; arguments and status pass through
: >"$sandbox/lists"
launch 7 plot out/a 'out/two words' --last
expect log "install --yes --no-install-recommends python3-numpy python3-h5py python3-matplotlib"
expect log "python3 $tree/verification/plot.py out/a out/two words --last"
expect_not log cmake
launch 7 compare out/a out/b
expect log "python3 $tree/verification/compare.py out/a out/b"
expect_not log apt-get

fresh # a sweep runs one program, which is built first: the one it names, or that of scenes
: >"$sandbox/lists"
launch 7 sweep drivers/scenes/x.toml 'a=1,2'
expect log "--target scene"
launch 7 sweep alpha 'a=1,2'
expect log "--target alpha"
expect log "python3 $tree/verification/sweep.py alpha a=1,2"

fresh # the packages are there and Python does not see them
: >"$sandbox/lists"
stand_in python3 <<<'exit 1'
launch 2 plot out/a
expect output "cannot import numpy"

fresh # not Debian
rm "$sandbox"/bin/apt-get
launch 2 plot out/a
expect output "not a Debian system"
expect output python3-matplotlib
expect_not output cmake
launch 2 alpha
expect output "not a Debian system"
expect output libsundials-dev

echo "the launcher behaves"
