#!/bin/sh
# The Debian packages that some tests use: nginx (the TLS proxy) and GNU Octave (the examples). Installs what is missing
# where it may; where it may not, says so, and the tests that need them are reported as skipped. Nothing else is affected.
set -eu

missing=
for command in nginx openssl octave-cli; do
    command -v "$command" >/dev/null 2>&1 || PATH=$PATH:/usr/sbin command -v "$command" >/dev/null 2>&1 ||
        missing="$missing ${command%-cli}"
done
[ -n "$missing" ] || exit 0

not_installed() {
    echo "Not installed:$missing ($1). The tests that need them will be skipped." >&2
    echo "To run them: apt-get install --no-install-recommends$missing" >&2
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

echo "Installing for the tests:$missing ..."
export DEBIAN_FRONTEND=noninteractive
log=$(mktemp)
trap 'rm -f "$log"' EXIT
# shellcheck disable=SC2086 # a list of words
if ! { $as_root apt-get update && $as_root apt-get install --yes --no-install-recommends $missing; } >"$log" 2>&1; then
    tail -n 5 "$log" >&2
    not_installed "apt-get failed, as above"
fi
