# SPDX-License-Identifier: GPL-3.0-or-later
"""The subcommands of `sinew`, one module each: a `Command` of cli.py."""
