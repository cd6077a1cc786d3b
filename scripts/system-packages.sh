#!/bin/sh
# Debian packages that tests and benchmarks use. Installs what is missing where it may; where it may not, says so, and
# goes on: what needs a missing one says so too (a test is skipped). Usage: scripts/system-packages.sh PACKAGE...
set -eu

command_of() { # PACKAGE
    case $1 in
        iproute2) echo ip ;;
        octave) echo octave-cli ;;
        postgresql) echo initdb ;;
        *) echo "$1" ;;
    esac
}

PATH=$PATH:/usr/sbin
for folder in /usr/lib/postgresql/*/bin; do
    PATH=$PATH:$folder # Debian keeps the server's programs there
done
missing=
for package in "$@"; do
    command -v "$(command_of "$package")" >/dev/null 2>&1 || missing="$missing $package"
done
[ -n "$missing" ] || exit 0

not_installed() { # REASON
    echo "Not installed:$missing ($1). What needs them is left out." >&2
    echo "To have it: apt-get install --no-install-recommends$missing" >&2
    exit 0
}

command -v apt-get >/dev/null 2>&1 || not_installed "this system has no apt-get"
if [ "$(id -u)" -eq 0 ]; then
    as_root=
elif sudo -n true 2>/dev/null; then
    as_root="sudo -n"
else
    not_installed "that takes root, or sudo without a password"
fi

echo "Installing$missing ..."
export DEBIAN_FRONTEND=noninteractive
log=$(mktemp)
trap 'rm -f "$log"' EXIT
# shellcheck disable=SC2086 # a list of words
if ! { $as_root apt-get update && $as_root apt-get install --yes --no-install-recommends $missing; } >"$log" 2>&1; then
    tail -n 5 "$log" >&2
    not_installed "apt-get failed, as above"
fi
