# SPDX-License-Identifier: GPL-3.0-or-later
"""Browsers without a screen, with WebGL and WebGPU in software, for tests of pages: all are asked alike."""

from __future__ import annotations

import base64
import os
import shutil
import socket
import subprocess
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path

import numpy as np

SECONDS = 120
# Drivers take far longer for a list of numbers.
_AS_TEXT = """
const found = await %s;
// Firefox hides the numbers of pages from scripts.
const bytes = new Uint8Array(Float32Array.from(found.wrappedJSObject || found).buffer);
let text = "";
for (let i = 0; i < bytes.length; i += 4096) text += String.fromCharCode(...bytes.subarray(i, i + 4096));
return btoa(text)
"""


class Browser:
    """What all have. Subclasses have PROGRAMS, and run() and picture() of the page that is open.

    PROGRAMS  packages of Debian, by the programs that are needed; of each row any
    way       of drawing: webgl, webgpu, or what the page chooses
    """

    PROGRAMS: tuple[tuple[str, ...], ...] = ()
    PACKAGES = ""
    way = ""

    @classmethod
    def missing(cls):
        """Packages to install; empty where nothing is missing."""
        return "" if all(any(map(shutil.which, row)) for row in cls.PROGRAMS) else cls.PACKAGES

    @classmethod
    def program(cls, row):
        return next(filter(None, map(shutil.which, cls.PROGRAMS[row])))

    def __enter__(self):
        with ExitStack() as stack:
            self.start(stack)
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *_):
        self._stack.close()

    def wait(self, condition):
        """Waits until a JavaScript expression is true, and returns it."""
        end = time.monotonic() + SECONDS
        while time.monotonic() < end:
            found = self.run(f"return {condition}")
            if found:
                return found
            time.sleep(0.05)
        raise AssertionError(f"not within {SECONDS} s: {condition}")

    def show(self, page, width=1280, height=800, is_dark=False, is_still=False):
        """Opens a page, and waits until it has drawn the character.

        is_still  as if somebody had the system show as little motion as it can
        """
        self.resize(width, height)
        self.prefer(is_dark, is_still)
        self.open(f"{page.as_uri()}?draw={self.way}")
        said = self.wait("window.sinew ? 'drawn' : document.getElementById('message').textContent")
        assert said == "drawn", said

    def floats(self, expression):
        """float32 [n] of an expression that is a Float32Array."""
        text = self.run(_AS_TEXT % expression)
        return np.frombuffer(base64.b64decode(text), "<f4")


class Chromium(Browser):
    PROGRAMS = (("chromium", "chromium-browser", "google-chrome"), ("chromedriver",))
    PACKAGES = "chromium and chromium-driver"
    # For WebGPU to show textures.
    VULKAN = ("enable-features=Vulkan", "use-vulkan=swiftshader")

    def start(self, stack):
        from selenium import webdriver

        options = webdriver.ChromeOptions()
        options.binary_location = self.program(0)
        words = "headless=new", "no-sandbox", "use-angle=swiftshader", "enable-unsafe-swiftshader"
        for word in (*words, "enable-unsafe-webgpu", "use-webgpu-adapter=swiftshader", *self.VULKAN):
            options.add_argument(f"--{word}")
        service = webdriver.ChromeService(self.program(1))
        self._driver = webdriver.Chrome(options=options, service=service)
        stack.callback(self._driver.quit)
        self._driver.set_script_timeout(SECONDS)

    def resize(self, width, height):
        values = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self._driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", values)

    def prefer(self, is_dark, is_still):
        values = {
            "prefers-color-scheme": "dark" if is_dark else "light",
            "prefers-reduced-motion": "reduce" if is_still else "no-preference",
        }
        features = [{"name": name, "value": value} for name, value in values.items()]
        self._driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})

    def open(self, address):
        self._driver.get(address)

    def run(self, code):
        return self._driver.execute_script(code)

    def press(self, key):
        from selenium.webdriver.common.action_chains import ActionChains

        ActionChains(self._driver).send_keys(key).perform()

    def picture(self):
        return self._driver.get_screenshot_as_png()


class Firefox(Browser):
    """Without a screen it has no WebGL (bugzilla.mozilla.org, 1375585), so it gets a virtual one."""

    PROGRAMS = (("firefox-esr", "firefox"), ("Xvfb",))
    PACKAGES = "firefox-esr and xvfb"

    def start(self, stack):
        from marionette_driver.marionette import Marionette

        profile = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        settings = {
            "marionette.port": str(port),
            "webgl.force-enabled": "true",
            "dom.webgpu.enabled": "true",
            "gfx.webgpu.ignore-blocklist": "true",
            "browser.shell.checkDefaultBrowser": "false",
            "datareporting.policy.dataSubmissionEnabled": "false",
        }
        lines = [f'user_pref("{name}", {value});' for name, value in settings.items()]
        (profile / "user.js").write_text("\n".join(lines) + "\n", encoding="utf-8")
        reading, writing = os.pipe()
        screen = f"-displayfd {writing} -screen 0 1600x1200x24 -nolisten tcp"
        self._run(stack, [self.program(1), *screen.split()], pass_fds=[writing])
        os.close(writing)
        with os.fdopen(reading) as pipe:
            display = pipe.readline().strip()
        env = {**os.environ, "DISPLAY": f":{display}", "HOME": str(profile)}
        words = [self.program(0), "--marionette", "--remote-allow-system-access", "--no-remote"]
        words += ["--profile", str(profile)]
        self._run(stack, words, env=env)
        self._driver = Marionette(host="127.0.0.1", port=port, startup_timeout=SECONDS)
        self._driver.raise_for_port(SECONDS)
        self._driver.start_session()
        stack.callback(self._driver.delete_session)
        self._driver.timeout.script = SECONDS

    @staticmethod
    def _run(stack, words, **options):
        output = subprocess.DEVNULL
        process = subprocess.Popen(words, stdout=output, stderr=output, **options)

        def end():
            process.terminate()
            process.wait(SECONDS)

        stack.callback(end)

    def resize(self, width, height):
        # The window has a frame of the browser's own.
        self._driver.set_window_rect(width=width, height=height)
        extra = self.run("return [outerWidth - innerWidth, outerHeight - innerHeight]")
        self._driver.set_window_rect(width=width + extra[0], height=height + extra[1])

    def prefer(self, is_dark, is_still):
        self._driver.set_pref("layout.css.prefers-color-scheme.content-override", 0 if is_dark else 1)
        self._driver.set_pref("ui.prefersReducedMotion", int(is_still))

    def open(self, address):
        self._driver.navigate(address)

    def run(self, code):
        # Scripts have windows of their own, which do not show what pages add to theirs.
        own = code.replace("window.sinew", "window.wrappedJSObject.sinew")
        ends = "(found) => end([found, null]), (error) => end([null, String(error)])"
        words = f"const end = arguments[0]; (async () => {{{own}}})().then({ends})"
        found, error = self._driver.execute_async_script(words)
        assert error is None, error
        return found

    def press(self, key):
        self._driver.actions.sequence("key", "keyboard").send_keys(key).perform()

    def picture(self):
        return base64.b64decode(self._driver.screenshot(full=False))


ALL = (Chromium, Firefox)
