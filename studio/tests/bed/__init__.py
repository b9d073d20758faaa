"""The test bed: real browsers whose real Web Serial finds virtual modules, and web servers for their pages.

conftest.py has the fixtures; `browser.py` says what a test can do with a browser. Debian's packages chromium and
firefox-esr have to be installed, with `cc`, and mounts have to be allowed, as they are to root.
"""

# The longest wait for anything, in seconds: a busy computer is slow.
PATIENCE = 60
