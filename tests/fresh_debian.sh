#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The README's two commands on a fresh Debian: fresh_debian.sh bookworm|trixie. Needs root, debootstrap, git and a mirror of
# Debian (the one apt uses here); takes about a quarter of an hour on two cores, 5 GB in TMPDIR, and leaves nothing behind.
# What is tried is the last commit, not the files as they are.
set -euo pipefail

say() { printf 'fresh_debian: %s\n' "$*" >&2; }

release=${1:-}
if [[ $# != 1 || ! $release =~ ^(bookworm|trixie)$ ]]; then
    say "usage: fresh_debian.sh bookworm|trixie"
    exit 2
fi
if (($(id -u) != 0)); then
    say "making a Debian inside a folder needs root"
    exit 2
fi
for tool in debootstrap git chroot; do
    command -v $tool >/dev/null || { say "missing: $tool. apt-get install debootstrap git"; exit 2; }
done

# Mounts of a namespace of its own end with this script, however it ends. Where that is forbidden the trap has to do.
if [[ -z ${FRESH_DEBIAN_INSIDE:-} ]] && unshare --mount --propagation private true 2>/dev/null; then
    FRESH_DEBIAN_INSIDE=1 exec unshare --mount --propagation private bash "$0" "$@"
fi

repository=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd)
root=$(mktemp -d -t "fresh_$release.XXXXXX")
chmod 755 "$root" # it becomes the / of a user without rights

clean_up() {
    local status=$?
    trap - EXIT
    if mountpoint -q "$root/proc"; then umount "$root/proc" || umount --lazy "$root/proc" || true; fi
    if mountpoint -q "$root/proc"; then
        say "could not unmount $root/proc: $root is left"
    else
        rm -rf --one-file-system -- "$root" || say "could not remove $root"
    fi
    exit "$status"
}
trap clean_up EXIT
trap 'exit 129' HUP
trap 'exit 130' INT
trap 'exit 143' TERM

stage() { # HEADING COMMAND...
    local started=$SECONDS heading=$1
    printf '\n--- %s: %s\n' "$release" "$heading"
    "${@:2}" || { printf -- '--- %s: FAILED: %s (after %d s)\n' "$release" "$heading" "$((SECONDS - started))"; exit 1; }
    printf -- '--- %s: passed: %s (%d s)\n' "$release" "$heading" "$((SECONDS - started))"
}

within() { # USER COMMAND: in a login shell of that user, with nothing of this machine but how to reach the mirror
    chroot "$root" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 \
        ${http_proxy:+"http_proxy=$http_proxy"} ${https_proxy:+"https_proxy=$https_proxy"} ${no_proxy:+"no_proxy=$no_proxy"} \
        setpriv --reuid="$1" --regid="$1" --init-groups --reset-env bash -c \
        "export PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8; cd; cd ductile; $2" </dev/null
}

bootstrap() {
    local mirror proxy
    # shellcheck disable=SC2016  # apt expands it
    mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Label: Debian' 2>/dev/null | head -n 1 || true)
    mirror=${mirror:-http://deb.debian.org/debian/}
    proxy=$(apt-config shell proxy Acquire::http::Proxy 2>/dev/null || true)
    if [[ -n $proxy ]]; then
        eval "$proxy"
        if [[ -z ${http_proxy:-} && $proxy != DIRECT ]]; then export http_proxy=$proxy; fi
    fi
    debootstrap --variant=minbase --include=ca-certificates "$release" "$root" "$mirror" >"$root.log" 2>&1 || {
        tail -n 20 "$root.log" >&2
        rm -f "$root.log"
        return 1
    }
    rm -f "$root.log"
    # The mirror may stand behind a certificate of this machine, be old, and be known to its own hosts file only.
    cp /etc/resolv.conf /etc/hosts "$root/etc/"
    if [[ -r /etc/ssl/certs/ca-certificates.crt ]]; then
        cp /etc/ssl/certs/ca-certificates.crt "$root/etc/ssl/certs/"
    fi
    apt-config dump | grep -E '^Acquire::(http|https|Check-|Retries|ForceIPv)' >"$root/etc/apt/apt.conf.d/99as-outside" || true
    printf 'Acquire::Languages "none";\n' >"$root/etc/apt/apt.conf.d/99no-translations"
    echo force-unsafe-io >"$root/etc/dpkg/dpkg.cfg.d/no-sync" # the folder need not survive a power failure
    printf '#!/bin/sh\nexit 101\n' >"$root/usr/sbin/policy-rc.d" # packages start no services
    chmod +x "$root/usr/sbin/policy-rc.d"
    mount -t proc proc "$root/proc" 2>/dev/null || mount --bind /proc "$root/proc" 2>/dev/null || {
        say "this system forbids mounting /proc inside $root: try where root may mount"
        return 1
    }
    chroot "$root" useradd --create-home --shell /bin/bash user
    # The repository may belong to another user than the one who tests.
    printf '[safe]\n\tdirectory = *\n' >"$root/root/gitconfig"
    GIT_CONFIG_GLOBAL=$root/root/gitconfig git clone --quiet --no-hardlinks "$repository" "$root/home/user/ductile" || return 1
    chroot "$root" chown -R user:user /home/user/ductile
}

# What a user without rights is told to run as root.
told=

user_without_packages() {
    local status=0 output
    output=$(within user './ductile demo' 2>&1) || status=$?
    printf '%s\n' "$output"
    told=$(grep -x 'apt-get update && apt-get install .*libsundials-dev.*' <<<"$output") || status=0
    if ((status != 2)); then
        say "a user who cannot install packages got status $status, or not the command to run with status 2"
        return 1
    fi
}

packages_as_told() { chroot "$root" env DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8 bash -c "$told" >/dev/null </dev/null; }

demo() {
    within user 'CXXFLAGS=-Werror ./ductile demo' || return 1
    within user 'grep -q "\"status\": \"completed\"" out/demo/summary.json && [[ -s out/demo/fields.h5 && -s out/demo/fields.png ]]' || {
        say "the demonstration did not leave its results"
        return 1
    }
}

stage "debootstrap, clone" bootstrap
stage "a user without rights is told what to install" user_without_packages
stage "what he is told, as root" packages_as_told
stage "./ductile demo" demo
stage "./ductile test" within user './ductile test'
stage "the README's commands" within user 'tests/readme.sh'
printf '\nfresh_debian: %s: all passed in %d s\n' "$release" "$SECONDS"
