#!/bin/sh
# Is there what pip cannot bring: the shared libraries that Open3D loads when it is imported, and, while there is no
# virtual environment yet, the means to make one? What is missing is installed where we may, and named where we may not.
# usage: scripts/system-deps.sh PYTHON VENV
set -eu
python=$1
venv=$2

# library=package, as Debian and Ubuntu name them
libraries="libEGL.so.1=libegl1 libGL.so.1=libgl1 libX11.so.6=libx11-6 libidn2.so.0=libidn2-0 libudev.so.1=libudev1
libusb-1.0.so.0=libusb-1.0-0"

missing_packages() {
    "$python" - $libraries <<'PY'
import ctypes
import sys

for pair in sys.argv[1:]:
    library, package = pair.split("=")
    try:
        ctypes.CDLL(library)
    except OSError:
        print(package, end=" ")
PY
    [ -x "$venv/bin/python" ] || "$python" -c "import ensurepip, venv" 2>/dev/null || echo python3-venv
}

[ "$(uname -s)" = Linux ] || exit 0
missing=$(missing_packages)
[ -n "$missing" ] || exit 0

if command -v apt-get >/dev/null 2>&1; then
    if [ "$(id -u)" = 0 ]; then
        as_root=env
    elif sudo -n true 2>/dev/null; then
        as_root="sudo -n env"
    else
        as_root=
    fi
    if [ -n "$as_root" ]; then
        echo "Installing what Open3D needs from the system:" $missing
        # what counts is the check after this: a package source that fails may be another one
        $as_root apt-get update -qq || true
        $as_root DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $missing || true
        missing=$(missing_packages)
        [ -n "$missing" ] || exit 0
    fi
fi

cat >&2 <<MESSAGE

Open3D cannot be installed and imported here: the system lacks what Debian and Ubuntu have in the packages
$(echo $missing). Please run this as root, then try again:

    apt-get update && apt-get install -y --no-install-recommends $(echo $missing)

On other systems install what provides libEGL, libGL, libX11, libidn2, libudev and libusb-1.0, and Python's venv module.
MESSAGE
exit 1
