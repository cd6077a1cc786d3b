#!/bin/sh
# Campaigns by curl: a batch of files, d33 of the array, history. Needs a running service (`make serve`).
# UNDERSKIN_URL names another address, UNDERSKIN_API_KEY a key (of scope write) where one is needed.
set -eu
url=${UNDERSKIN_URL:-http://127.0.0.1:8000}

ask() {
    curl --silent --show-error --fail-with-body ${UNDERSKIN_API_KEY:+--header "Authorization: Bearer $UNDERSKIN_API_KEY"} "$@"
    echo
}

# Under an Idempotency-Key of your own, a batch that is sent twice is kept once.
echo "A batch of files; one recording is refused, the others are kept:"
ask "$url/v1/campaigns?skin=curl-palm" --header "Idempotency-Key: palm, summer 2017" \
    --form file=@campaigns/2017-05.csv --form file=@campaigns/2017-06.csv --form file=@campaigns/2017-07.json \
    --form file=@campaigns/2017-08.csv --form file=@campaigns/2017-09.csv

echo "d33 by the latest of them:"
latest=$(ask "$url/v1/campaigns?skin=curl-palm&limit=1" | grep -o '"id":"[^"]*"' | head -n 1 | cut -d '"' -f 4)
ask "$url/v1/campaigns/$latest/d33"

echo "d33 of each sensor over time, with its trend:"
ask "$url/v1/skins/curl-palm/history"
