# SPDX-License-Identifier: GPL-3.0-or-later
# For CMAKE_USER_MAKE_RULES_OVERRIDE_CXX: how zig links a module for macOS. Not by -bundle, which it does not know, and so
# ends with a segmentation fault (github.com/ziglang/zig/issues/25451). Python loads a shared library as well.
set(CMAKE_SHARED_MODULE_CREATE_CXX_FLAGS "-shared")
