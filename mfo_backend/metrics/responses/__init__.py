# SPDX-License-Identifier: Apache-2.0
"""What a squared difference is taken of: radiance, log, PU21, ITP."""
