"""A bare Debian 12 in a folder, with a user who may install packages."""

import contextlib
import os
import re
import shutil
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

RELEASE = "bookworm"
# Beyond Debian's smallest system: what the README asks for, what each desktop has, and certificates to fetch with.
PACKAGES = ("git", "make", "sudo", "ca-certificates", "libgl1-mesa-dri")
USER = "reader"
HOME = f"/home/{USER}"
# How this machine reaches package servers.
SETTINGS = ("/etc/apt/apt.conf.d", "/etc/apt/sources.list", "/etc/apt/sources.list.d", "/etc/apt/auth.conf.d",
            "/etc/pip.conf", "/etc/resolv.conf", "/etc/hosts", "/etc/ssl/certs/ca-certificates.crt",
            "/usr/local/share/ca-certificates")  # fmt: skip
USER_SETTINGS = (".npmrc", ".config/pip/pip.conf", ".netrc")
PASSED_ON = re.compile(r"(?i)proxy|_cert|ca_|ssl_|^pip_|^npm_|^ort_")


def debian_mirror() -> str:
    """The server of Debian's packages that apt uses here. Raises RuntimeError where apt has none for the release."""
    targets = subprocess.run(
        ["apt-get", "indextargets", "--format", "$(REPO_URI) $(RELEASE)", "Created-By: Packages"],
        capture_output=True, text=True, check=True,
    ).stdout.split("\n")  # fmt: skip
    found = [line.split()[0] for line in targets if line.endswith(f" {RELEASE}")]
    if not found:
        raise RuntimeError(f"apt has no server of Debian's {RELEASE} here. Run it on Debian 12.")
    return found[0]


class BareSystem:
    """Made by `debootstrap` in `folder`, which `remove` deletes with all that is in it."""

    def __init__(self, folder: Path) -> None:
        self.root = folder
        self.home = folder / HOME[1:]

    def make(self) -> None:
        self.root.mkdir(parents=True)
        _run("debootstrap", "--variant=minbase", f"--include={','.join(PACKAGES)}", RELEASE, self.root, debian_mirror())
        (self.root / "etc/apt/sources.list").unlink(missing_ok=True)  # debootstrap's, beside those of this machine
        for setting in map(Path, SETTINGS):
            copy = self.root / str(setting)[1:]
            if setting.is_dir():
                shutil.copytree(setting, copy, dirs_exist_ok=True)
            elif setting.exists():
                shutil.copyfile(setting, copy)
        _run("chroot", self.root, "useradd", "--create-home", "--shell", "/bin/bash", USER)
        (self.root / "etc/sudoers.d/reader").write_text(f"{USER} ALL=(ALL) NOPASSWD: ALL\n")
        for name in USER_SETTINGS:
            if (setting := Path.home() / name).exists():
                copy = self.home / name
                copy.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(setting, copy)
        self.give_to_user()

    def give_to_user(self) -> None:
        _run("chroot", self.root, "chown", "-R", f"{USER}:{USER}", HOME)

    @contextlib.contextmanager
    def running(self, script: str, folder: str, output: Path, display: str) -> Iterator[subprocess.Popen]:
        """Runs `script` by bash as the user in `folder` of the home; its processes end with the context."""
        environment = {name: value for name, value in os.environ.items() if PASSED_ON.search(name)}
        environment |= {"HOME": HOME, "USER": USER, "LANG": "C.UTF-8", "TERM": "dumb", "DISPLAY": display}
        environment["PATH"] = "/usr/local/bin:/usr/bin:/bin:/usr/sbin:/sbin"
        (self.root / "tmp/commands.sh").write_text(f"cd {HOME}/{folder}\n{script}")
        enter = (
            f'cd "{self.root}" && mount -t proc proc proc && mount -t tmpfs tmpfs dev/shm &&'
            f" mount -t devpts devpts dev/pts && exec chroot . setpriv --reuid {USER} --regid {USER} --init-groups"
            f" env PATH=/usr/local/bin:/usr/bin:/bin /bin/bash -e -v /tmp/commands.sh"
        )
        with output.open("wb") as file:
            process = subprocess.Popen(
                ["unshare", "--mount", "--pid", "--fork", "--kill-child", "sh", "-c", enter],
                env=environment, stdin=subprocess.DEVNULL, stdout=file, stderr=subprocess.STDOUT,
                start_new_session=True,
            )  # fmt: skip
            try:
                yield process
            finally:
                if process.poll() is None:
                    os.killpg(process.pid, signal.SIGKILL)
                    process.wait()

    def remove(self) -> None:
        shutil.rmtree(self.root, ignore_errors=True)


def _run(*words: object) -> None:
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, errors="replace")
    if done.returncode != 0:
        raise RuntimeError(f"{words[0]} failed:\n{(done.stdout + done.stderr)[-2000:]}")
