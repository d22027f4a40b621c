# SPDX-License-Identifier: Apache-2.0
"""From scene-linear radiance to what a display shows, and back."""
