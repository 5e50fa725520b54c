# SPDX-License-Identifier: GPL-3.0-or-later
"""What several features measure: shapes beside each other, over frames or the poses of the battery."""
