#!/usr/bin/env bash
# Makes .deps/camera-vm: Debian's kernel image for the virtual machine, unpacked but not installed.
#
#   tests/camera_vm/fetch-guest.sh
#
# Needs no root and changes nothing of the system. About 70 MB are fetched, once, by apt, which checks them against
# Debian's signatures; remove the folder to fetch them again. Exit status 1 when the kernel cannot be had.
set -euo pipefail
cd "$(dirname "$0")/../.."
case "${1:-}" in
    "") ;;
    -h | --help) sed -n '2,7s/^# \{0,1\}//p' "$0"; exit 0 ;;
    *) sed -n '2,7s/^# \{0,1\}//p' "$0" >&2; exit 2 ;;
esac

guest="$PWD/.deps/camera-vm"
stamp="$guest/.ready"
# The stamp is written last and holds what made the folder, so an interrupted or older one is made again.
made_by="$(sha256sum <"$0")"
[ "$(cat "$stamp" 2>/dev/null || true)" = "$made_by" ] && exit 0

PATH="$PATH:/usr/sbin:/sbin"  # where Debian keeps depmod, out of the way of users
for tool in apt-get apt-cache dpkg-deb depmod; do
    command -v "$tool" >/dev/null || {
        echo "$tool is missing: the camera tests run Debian's kernel (scripts/install-packages.sh camera-vm)." >&2
        exit 1
    }
done

# linux-image-amd64 is an empty package that depends on the newest kernel of the release.
package="$(apt-cache depends linux-image-amd64 2>/dev/null | awk '/Depends: linux-image-/ { print $2; exit }')"
if [ -z "$package" ]; then
    echo "apt knows no package linux-image-amd64: run apt-get update, on Debian for x86-64." >&2
    exit 1
fi

rm -rf "$guest"
mkdir -p "$guest/root"
echo "Fetching Debian's kernel $package (70 MB, once)"
(cd "$guest" && apt-get -qq -o APT::Sandbox::User= download "$package")
dpkg-deb --extract "$guest"/linux-image-*.deb "$guest/root"
rm "$guest"/linux-image-*.deb

# The package lists its modules' dependencies only when it is installed.
release="$(basename "$guest"/root/lib/modules/*)"
depmod -b "$guest/root" "$release"
[ -s "$guest/root/boot/vmlinuz-$release" ] || {
    echo "$package holds no kernel boot/vmlinuz-$release." >&2
    exit 1
}
for module in vivid uvcvideo vhci-hcd; do
    modprobe -d "$guest/root" -S "$release" --show-depends "$module" >/dev/null || {
        echo "$package holds no module $module, so it cannot show a camera." >&2
        exit 1
    }
done
printf '%s\n' "$made_by" >"$stamp"
