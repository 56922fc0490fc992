"""Keyboard, pointer, drag and drop and eyes of a person before a window of the desktop demo, through the X protocol."""

import subprocess
import time
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np
from shown_by_demo import DEMO, ROOT, display
from Xlib import XK, X
from Xlib.display import Display
from Xlib.ext import xtest
from Xlib.protocol import event


class Hands:
    """Hands of a person at the window that `process` opens."""

    def __init__(self, process: subprocess.Popen):
        self._process = process
        self._display = Display(display())
        self._root = self._display.screen().root
        self._window = self.until(lambda: self._find(self._root), "a window")
        viewable = X.IsViewable  # before, it takes no focus and no keys
        self.until(lambda: self._window.get_attributes().map_state == viewable, "a window on the screen")

    def until(self, condition, what: str, timeout_s: float = 60):
        """Returns the condition's value once it is true; the window continues meanwhile."""
        end_s = time.monotonic() + timeout_s
        while time.monotonic() < end_s:
            assert self._process.poll() is None, f"the demo ended: {self._process.stderr.read()}"
            if found := condition():
                return found
            time.sleep(0.1)
        raise AssertionError(f"there is not {what} after {timeout_s} s")

    def _find(self, window):
        if window.get_wm_name() == "Maquette" and window.get_full_property(self._atom("XdndAware"), X.AnyPropertyType):
            return window
        return next((found for child in window.query_tree().children if (found := self._find(child))), None)

    def _atom(self, name: str) -> int:
        return self._display.intern_atom(name)

    def press(self, *names: str) -> None:
        """Keys at once, as long as a hand does."""
        self._window.set_input_focus(X.RevertToParent, X.CurrentTime)
        codes = [self._display.keysym_to_keycode(XK.string_to_keysym(name)) for name in names]
        for kind, order in ((X.KeyPress, codes), (X.KeyRelease, codes[::-1])):
            for code in order:
                xtest.fake_input(self._display, kind, code)
            self._display.sync()
            time.sleep(0.15)

    def point(self, x: int, y: int) -> None:
        """The pointer, at a place of the window."""
        at = self._window.translate_coords(self._root, 0, 0)
        xtest.fake_input(self._display, X.MotionNotify, x=x - at.x, y=y - at.y)
        self._display.sync()

    def drop(self, path: Path) -> None:
        """A file, as file managers do (XDND, version 5)."""
        source = self._root.create_window(0, 0, 1, 1, 0, self._display.screen().root_depth)
        source.set_selection_owner(self._atom("XdndSelection"), X.CurrentTime)

        def tell(kind: str, *data: int) -> None:
            words = [source.id, *data, *[0] * (4 - len(data))]
            message = event.ClientMessage(window=self._window, client_type=self._atom(kind), data=(32, words))
            self._window.send_event(message)
            self._display.flush()

        tell("XdndEnter", 5 << 24, self._atom("text/uri-list"))
        tell("XdndPosition", 0, 300 << 16 | 300, X.CurrentTime, self._atom("XdndActionCopy"))

        def is_done() -> bool:
            while self._display.pending_events():
                heard = self._display.next_event()
                if heard.type == X.SelectionRequest:
                    heard.requestor.change_property(heard.property, heard.target, 8, f"file://{path}\r\n".encode())
                    answer = event.SelectionNotify(
                        time=heard.time,
                        requestor=heard.requestor,
                        selection=heard.selection,
                        target=heard.target,
                        property=heard.property,
                    )
                    heard.requestor.send_event(answer)
                    self._display.flush()
                elif heard.type == X.ClientMessage and heard.client_type == self._atom("XdndStatus"):
                    tell("XdndDrop", 0, X.CurrentTime)
                elif heard.type == X.ClientMessage and heard.client_type == self._atom("XdndFinished"):
                    return True
            return False

        self.until(is_done, "an answer to the drop")

    def see(self) -> np.ndarray:
        """The window: uint8 [height, width, 3] BGR."""
        shape = self._window.get_geometry()
        seen = self._window.get_image(0, 0, shape.width, shape.height, X.ZPixmap, 0xFFFFFFFF)
        return np.frombuffer(seen.data, np.uint8).reshape(shape.height, shape.width, 4)[..., :3]

    def looks_like(self, picture: np.ndarray, error: float = 12) -> bool:
        """Whether the left part, where images are, has this one in it, scaled to fit; by the mean difference."""
        area = self.see()[:, :-330]
        scale = min(area.shape[1] / picture.shape[1], area.shape[0] / picture.shape[0])
        wanted = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        top, left = (area.shape[0] - wanted.shape[0]) // 2, (area.shape[1] - wanted.shape[1]) // 2
        shown = area[top : top + wanted.shape[0], left : left + wanted.shape[1]]
        wanted = wanted[: shown.shape[0], : shown.shape[1]]
        return bool(np.abs(shown.astype(float) - wanted).mean() < error)


@contextmanager
def demo(*options):
    """The demo in a visible window, and the hands before it; it is closed by Ctrl+Q and must end well."""
    command = [DEMO, "--size", "1280x800", *options]
    process = subprocess.Popen(
        [str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=ROOT,
        env={"PATH": "/usr/bin:/bin", "HOME": "/tmp", "DISPLAY": display()},
    )  # fmt: skip
    try:
        hands = Hands(process)
        yield hands
        hands.press("Control_L", "q")
        assert process.wait(20) == 0, process.stderr.read()
    finally:
        process.kill()
        process.wait()
        process.stdout.close()
        process.stderr.close()
