# SPDX-License-Identifier: Apache-2.0
"""Where camera rays start inside of pixels, and which pixels are looked at."""
