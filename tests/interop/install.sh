#!/bin/sh
# Install Debian's Cyclone DDS and Fast DDS, with which `make interop` exchanges messages.
set -eu
packages="g++ make cyclonedds-dev cyclonedds-tools libfastrtps-dev"
if [ -e /usr/include/fastdds/dds/domain/DomainParticipant.hpp ] && command -v idlc >/dev/null; then
    exit 0
fi
line="sudo apt-get install --no-install-recommends $packages"
command -v apt-get >/dev/null || { echo "make interop needs Debian 12 or Ubuntu, for: $packages" >&2; exit 1; }
if [ "$(id -u)" = 0 ]; then
    as_root="env"
elif sudo -n true 2>/dev/null; then
    as_root="sudo -n env"
else
    echo "make interop needs these packages. Type: $line" >&2
    exit 1
fi
# $as_root and $packages are lists of words.
# shellcheck disable=SC2086
$as_root DEBIAN_FRONTEND=noninteractive apt-get -qq -o DPkg::Lock::Timeout=300 install --yes \
    --no-install-recommends $packages >/dev/null
