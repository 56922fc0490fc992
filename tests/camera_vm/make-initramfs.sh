#!/usr/bin/env bash
# Packs what the virtual machine runs into an initramfs, the file system that a kernel starts from.
#
#   tests/camera_vm/make-initramfs.sh OUT.cpio [OPTION]...
#
#   --module NAME        a kernel module of .deps/camera-vm, with those it needs
#   --program FILE       into /bin
#   --file FILE=PATH     a file, to PATH
#   --tree FOLDER=PATH   a folder, to PATH, with the files its symbolic links lead to
#
# Shared libraries of all programs and libraries packed come along, in the place they have here. Not compressed: the
# machine is emulated, and unpacking would take longer than reading.
set -euo pipefail
usage() { sed -n '2,12s/^# \{0,1\}//p' "$0"; }

case "${1:-}" in
    -h | --help) usage; exit 0 ;;
    "" | -*) usage >&2; exit 2 ;;
esac
out="$(realpath -m "$1")"
shift
here="$(cd "$(dirname "$0")" && pwd)"
kernel="$(realpath "$here/../../.deps/camera-vm/root")"
release="$(basename "$kernel"/lib/modules/*)"
PATH="$PATH:/usr/sbin:/sbin"  # where Debian keeps modprobe, out of the way of users

root="$(mktemp -d)"
trap 'rm -rf "$root"' EXIT
# /lib and others are links as on the host: a library is then found by each of its names.
mkdir -p "$root"/{dev,proc,sys,tmp,run,etc,usr/bin,usr/lib64,usr/sbin,"usr/lib/modules/$release"}
for folder in bin lib lib64 sbin; do ln -s "usr/$folder" "$root/$folder"; done

# add_libraries FILE [TREE]: those that FILE loads, but for those in TREE, which come with it.
add_libraries() {
    local library
    { ldd "$1" 2>/dev/null || true; } | grep -o '/[^ ]*' | while read -r library; do
        case "$library" in "${2:-/none}"/*) continue ;; esac
        [ -e "$root$library" ] || install -D "$library" "$root$library"
    done || true
}
is_elf() { [ "$(head -c 4 "$1" | tr -d '\0')" = $'\x7fELF' ]; }

add_module() {
    local file
    modprobe -d "$kernel" -S "$release" --show-depends "$1" | awk '$1 == "insmod" { print $2 }' | while read -r file; do
        install -D -m 644 "$file" "$root/usr/lib/modules/$release/${file#*"/lib/modules/$release/"}"
    done
}

install "$(command -v busybox)" "$root/bin/busybox"
# Its list of commands has itself in it.
for applet in $(busybox --list); do [ -e "$root/bin/$applet" ] || ln -s busybox "$root/bin/$applet"; done
install "$here/guest-init.sh" "$root/init"

while [ $# -gt 0 ]; do
    [ $# -ge 2 ] || { usage >&2; exit 2; }
    from="${2%%=*}" to="${2#*=}"
    case "$1" in
        --module) add_module "$2" ;;
        --program)
            install "$2" "$root/bin/"
            add_libraries "$2"
            ;;
        --file) install -D "$from" "$root/$to" ;;
        --tree)
            mkdir -p "$root/$to"
            cp -rL "$from/." "$root/$to"
            while read -r file; do
                if is_elf "$file"; then add_libraries "$file" "$(realpath "$from")"; fi
            done < <(find -L "$(realpath "$from")" -type f \( -perm -u+x -o -name '*.so*' \))
            ;;
        *) usage >&2; exit 2 ;;
    esac
    shift 2
done

cp "$kernel/lib/modules/$release"/modules.{builtin,builtin.modinfo,order} "$root/usr/lib/modules/$release/"
depmod -b "$root" "$release"
mkdir -p "$(dirname "$out")"
(cd "$root" && find . | cpio --quiet -o -H newc -R 0:0) >"$out"
