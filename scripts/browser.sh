#!/bin/sh
# Is there a Chromium for the tests of the report? Where we may, Debian's is installed; where not, these tests are skipped.
set -eu
for name in "${GLSK_CHROMIUM:-chromium}" chromium chromium-browser google-chrome chrome; do
    if command -v "$name" >/dev/null 2>&1; then
        exit 0
    fi
done
if command -v apt-get >/dev/null 2>&1 && [ "$(id -u)" = 0 ]; then
    as_root=env
elif command -v apt-get >/dev/null 2>&1 && sudo -n true 2>/dev/null; then
    as_root="sudo -n env"
else
    exit 0
fi
echo "Installing Chromium for the tests of the report"
$as_root apt-get update -qq || true
$as_root DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends chromium >/dev/null || true
