# SPDX-License-Identifier: GPL-3.0-or-later
"""What riggers do with Sinew besides: each folder has its state, operators and panel."""
