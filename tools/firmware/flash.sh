#!/bin/sh
# First programming of a node by wire: loader, application and serial number in one go. No compiler is needed.
# flash.sh --tool ipecmd|pk2cmd|picberry [--hex WIRE.hex] [--serial N] [--dry-run]
# Without --hex the committed image; `make firmware` makes one of your own.
# Environment besides: IPECMD_TOOL (PPK3: a PICkit 3), PICBERRY_FAMILY (dspic33f), PICBERRY_PINS.
set -eu
cd "$(dirname "$0")/../.."
tool='' hex=firmware/images/node_wire.hex serial='' dry_run=''

fail() {
    echo "flash: $1" >&2
    exit 1
}

while [ $# -gt 0 ]; do
    case $1 in
        --tool | --hex | --serial) [ $# -gt 1 ] || fail "$1: wants a value; see the top of tools/firmware/flash.sh" ;;
    esac
    case $1 in
        --tool) tool=$2 && shift ;;
        --hex) hex=$2 && shift ;;
        --serial) serial=$2 && shift ;;
        --dry-run) dry_run=yes ;;
        *) fail "$1: not an option; see the top of tools/firmware/flash.sh" ;;
    esac
    shift
done

case $tool in
    ipecmd) places='ipecmd ipecmd.sh' from='MPLAB X with its IPE (microchip.com); ipecmd.sh lies in mplab_platform/mplab_ipe' ;;
    pk2cmd) places='pk2cmd' from='pk2cmd for the PICkit 2; its device list must know the dsPIC33FJ128MC802' ;;
    picberry) places='picberry' from='picberry (github.com/WallaceIT/picberry) on a Raspberry Pi' ;;
    '') fail 'which programmer? make flash TOOL=ipecmd, TOOL=pk2cmd or TOOL=picberry' ;;
    *) fail "TOOL=$tool: not known; use ipecmd, pk2cmd or picberry" ;;
esac
case $serial in
    *[!0-9]* | 0) fail "SERIAL=$serial: give a whole number from 1, another for each node" ;;
esac

program=''
for name in $places; do
    [ -n "$program" ] || program=$(command -v "$name" || true)
done
[ -n "$program" ] || [ -n "$dry_run" ] || fail "$tool: not found on PATH; install $from"
[ -n "$program" ] || program=$tool
[ -r "$hex" ] || fail "$hex: not there; give a file of make firmware with HEX=FILE"
.venv/bin/python tools/firmware/make_image.py check "$hex" || exit 1

mkdir -p build/firmware
if [ -n "$serial" ]; then
    numbered=build/firmware/node_$serial.hex
    .venv/bin/python tools/firmware/make_image.py wire "$hex" "$numbered" --serial "$serial" --whole || exit 1
    hex=$numbered
else
    echo 'flash: no SERIAL=n: the node cannot be addressed alone by its number' >&2
fi

case $tool in
    ipecmd) set -- "$program" -P33FJ128MC802 "-TP${IPECMD_TOOL:-PPK3}" -M "-F$hex" -OL ;;
    pk2cmd) set -- "$program" -PdsPIC33FJ128MC802 -M "-F$hex" -Y -R ;;
    picberry) set -- "$program" ${PICBERRY_PINS:+-g "$PICBERRY_PINS"} -f "${PICBERRY_FAMILY:-dspic33f}" ;;
esac
# picberry ends with 0 whatever its own comparison found, and never looks at the configuration words: the chip is read back.
read_back=''
[ "$tool" != picberry ] || read_back=build/firmware/read_back.hex
if [ -n "$dry_run" ]; then
    echo "$*${read_back:+ -w $hex}"
    exit 0
fi
trouble="$tool failed; check supply (3.3 V), the wires PGC, PGD, MCLR and ground, then try again"
if [ -z "$read_back" ]; then
    "$@" || fail "$trouble"
else
    rm -f "$read_back"
    "$@" -w "$hex" || fail "$trouble"
    "$@" -r "$read_back" || fail "$trouble"
    [ -s "$read_back" ] || fail "$tool read nothing back, so the node may not be programmed; check supply, wires and free disk space"
    .venv/bin/python tools/firmware/make_image.py verify "$hex" "$read_back" || exit 1
    echo 'flash: read back and compared: flash, serial number and configuration words are right'
fi
