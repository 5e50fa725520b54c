# SPDX-License-Identifier: GPL-3.0-or-later
"""What the report alone needs: a spline, and what its chapter 4 leaves to future work: fits of rigid
transforms, and inverse kinematics.

Built with the other programs of experiments/; the folder of future_work_native must be on Python's path.
"""
