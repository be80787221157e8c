#!/bin/sh
# Install what the tests need beyond pip, where that takes no password; elsewhere print the one
# line to type. The tests then skip with that reason, or fail where CI=true.
set -u

have() {
    for name in "$@"; do
        command -v "$name" >/dev/null && return
    done
    return 1
}

missing=""
have dot || missing="$missing graphviz"
have chromium chromium-browser google-chrome || missing="$missing chromium"
# The robots' firmware, and the emulator that runs it.
have avr-gcc || missing="$missing gcc-avr avr-libc"
have cc || missing="$missing gcc libc6-dev"
if have apt-get && [ ! -e /usr/include/simavr/sim_avr.h ]; then
    missing="$missing libsimavr-dev"
fi
# Playwright's driver links to it, and Debian's base and chromium come without.
if have apt-get && ! /sbin/ldconfig -p | grep -q libatomic.so.1; then
    missing="$missing libatomic1"
fi
# Drake's renderer of pictures links to it.
if have apt-get && ! /sbin/ldconfig -p | grep -q libEGL.so.1; then
    missing="$missing libegl1 libgl1-mesa-dri"
fi
[ -n "$missing" ] || exit 0

if [ "$(id -u)" = 0 ]; then
    as_root="env"
elif sudo -n true 2>/dev/null; then
    as_root="sudo -n env"
else
    as_root=""
fi

if [ -n "$as_root" ] && have apt-get; then
    echo "Installing for the tests:$missing"
    apt="$as_root DEBIAN_FRONTEND=noninteractive apt-get -qq -o DPkg::Lock::Timeout=300"
    log=$(mktemp)
    # $apt and $missing are lists of words.
    # shellcheck disable=SC2086
    if $apt update >"$log" 2>&1 </dev/null &&
        $apt install --yes --no-install-recommends $missing >>"$log" 2>&1 </dev/null; then
        rm -f "$log"
        exit 0
    fi
    cat "$log" >&2
    rm -f "$log"
fi

if have apt-get; then
    line="sudo apt-get install$missing"
elif have brew; then
    line="brew install$missing"
else
    line="your system's package manager, for:$missing"
fi
echo "The tests that need$missing cannot run here. To run them too: $line" >&2
[ "${CI:-}" != true ]
