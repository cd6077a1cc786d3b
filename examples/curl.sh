#!/bin/sh
# The service by curl: one point, columns as JSON, columns as CSV. Needs a running service (`make serve`).
# UNDERSKIN_URL names another address, UNDERSKIN_API_KEY a key where one is needed.
set -eu
url=${UNDERSKIN_URL:-http://127.0.0.1:8000}

ask() {
    curl --silent --show-error --fail-with-body ${UNDERSKIN_API_KEY:+--header "Authorization: Bearer $UNDERSKIN_API_KEY"} "$@"
    echo
}

echo "sigma of the linear layer, at one point:"
ask "$url/v1/sigma?a_over_h=0.3&rt_over_h=0.6"

echo "FRF of a skin under four preloads; the last one is outside the table, so it is null:"
ask "$url/v1/frf" --header "Content-Type: application/json" --data '{
    "thickness_mm": 2.5, "youngs_modulus_mpa": 16, "sensor_radius_mm": 1.5,
    "indenter_radius_mm": 4, "preload_n": [0.5, 1, 3, 300], "d33_pc_per_n": 14
}'

echo "d33 of two sensors, CSV in and CSV out:"
ask "$url/v1/d33" --header "Content-Type: text/csv" --header "Accept: text/csv" --data-binary @- <<'CSV'
thickness_mm,youngs_modulus_mpa,sensor_radius_mm,indenter_radius_mm,preload_n,frf_pc_per_n,frf_uncertainty_pc_per_n
2.5,16,1.5,4,1,7.4,0.1
2.5,16,1.5,4,3,11.5,0.1
CSV
