#!/usr/bin/env bash
# Runs the commands of README.md, as they stand there, in a bare root:
#
#   tests/newcomer/run.sh [docs]      docs: those of the guides, too
#
# Closes with "N passed, N failed"; results also in build/test-results/newcomer.xml (JUnit), what the commands said in
# build/newcomer/log. Exit status 77: it could not be run, and the last line says why.
set -euo pipefail
cd "$(dirname "$0")/../.."
checkout=$PWD
work=$checkout/build/newcomer
report=$checkout/build/test-results/newcomer.xml
archive=com.github.asus4.onnxruntime-0.4.8.tgz

case "${1:-}" in
    '' | docs) ;;
    *) sed -n '2,7s/^# \{0,1\}//p' "$0"; [ "$1" = -h ] || [ "$1" = --help ] || exit 2; exit 0 ;;
esac
mkdir -p "$(dirname "$report")"
rm -f "$report"

not_run() {
    printf '<testsuite name="newcomer"><testcase name="newcomer"><skipped message="%s"/></testcase></testsuite>\n' \
        "$1" >"$report"
    echo "not run: $1"
    exit 77
}

# Namespaces of this user's own where root is not to be had. The check does what bare_root does first.
alone=(unshare --mount --net --pid --fork --kill-child)
[ "$(id -u)" -eq 0 ] || alone+=(--map-root-user)
"${alone[@]}" sh -c 'mount --make-rprivate / && mount -t tmpfs tmpfs /opt && mount -o remount,bind,ro /' 2>/dev/null ||
    not_run "this machine lets nobody make a mount and a network namespace (unshare)"
command -v Xvfb >/dev/null || not_run "Xvfb is missing (scripts/install-packages.sh test)"
[ -x .venv/bin/python ] || not_run "the Python environment is missing (scripts/make-venv.sh dev)"
[ -f ".deps/$archive" ] || not_run ".deps/$archive is missing: the release build fetches it (make build)"

# A clone with what differs from the commit, too, and what the newcomer brings along.
rm -rf "$work"
mkdir -p "$work/home"
git clone -q --no-hardlinks "$checkout" "$work/clone"
git diff --name-only --diff-filter=D HEAD | (cd "$work/clone" && xargs -r rm -f)
git ls-files -z -co --exclude-standard --deduplicate | while IFS= read -r -d '' file; do
    [ ! -e "$file" ] || printf '%s\0' "$file"
done | tar -c --null -T - | tar -x -C "$work/clone"
mkdir "$work/clone/.deps"
ln "$(readlink -f ".deps/$archive")" "$work/clone/.deps/$archive" 2>/dev/null ||
    cp ".deps/$archive" "$work/clone/.deps/"
cp tests/media/photo.jpg tests/media/clip.mp4 "$work/clone/"
cp -r tests/media/room "$work/clone/my-place"

# bare_root: this checkout in /mnt and everything read-only but the newcomer's folder and the report's; nothing installed by
# hand; temporary files of its own. The project's Python, which walks, may itself be installed by hand.
hidden='/tmp /opt'
case "$(readlink -f .venv/bin/python)" in /usr/local/*) ;; *) hidden+=' /usr/local' ;; esac
# shellcheck disable=SC2016
bare_root='
    set -e
    mount --make-rprivate /
    mount --bind "$CHECKOUT" /mnt
    mount --bind "/mnt/build/newcomer" /mnt/build/newcomer
    mount --bind "/mnt/build/test-results" /mnt/build/test-results
    for folder in $HIDDEN; do mount -t tmpfs tmpfs "$folder"; done
    mount -t proc proc /proc
    mount -o remount,bind,ro /mnt
    mount -o remount,bind,ro /
    exec "$@"'
CHECKOUT=$checkout HIDDEN=$hidden "${alone[@]}" sh -c "$bare_root" bare_root \
    /mnt/.venv/bin/python /mnt/tests/newcomer/walk.py /mnt/build/newcomer "/mnt/${report#"$checkout"/}" "$@"
